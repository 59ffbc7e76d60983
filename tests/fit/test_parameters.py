"""What numbers cost by their priors."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.fit.parameters import Known, Parameter, ParameterVector

VECTOR = ParameterVector(
    (
        Parameter("stated", "kg", 1.0, 0.1),
        Parameter("unknown", "N m", 1.0, 0.1, flat=True),
        Parameter("cause", "1", 0.0, 0.1, released=True),
    )
)


@pytest.mark.parametrize("far", [-30.0, -1.0, -1e-7, 0.0, 1e-9, 0.5, 200.0])
def test_a_prior_is_the_square_of_its_residual(far: float) -> None:
    normal, cauchy = VECTOR.priors(np.array([0.5, 7.0, far]))
    assert normal**2 == pytest.approx(0.25)
    assert cauchy**2 == pytest.approx(2 * np.log(1 + far**2))
    assert np.sign(cauchy) == np.sign(far)


@pytest.mark.parametrize("far", [-30.0, -1.0, -1e-4, 0.0, 0.5, 200.0])
def test_its_slopes_are_those_of_differences(far: float) -> None:
    x, step = np.array([0.5, 7.0, far]), 1e-6
    slopes = VECTOR.prior_slopes(x)
    for column in range(3):
        aside = step * np.eye(3)[column]
        change = VECTOR.priors(x + aside) - VECTOR.priors(x - aside)
        assert slopes[:, column] == pytest.approx(change / (2 * step), abs=1e-5)


def test_what_other_runs_say_takes_the_place_of_a_prior() -> None:
    root = np.array([[2.0, 1.0], [0.0, 3.0]])
    known = Known(("cause", "stated"), np.array([0.4, -0.2]), root)
    vector = ParameterVector(VECTOR.parameters, known)
    x = np.array([-0.2, 7.0, 0.4])
    assert vector.priors(x) == pytest.approx([0.0, 0.0])
    off = np.array([0.1, 0.3])  # of cause and stated
    found = vector.priors(x + np.array([off[1], 5.0, off[0]]))
    assert np.sum(found**2) == pytest.approx(off @ root.T @ root @ off)
    slopes = vector.prior_slopes(x)
    assert slopes @ np.array([off[1], 5.0, off[0]]) == pytest.approx(found)
    assert vector.weighted.tolist() == [True, False, True]
