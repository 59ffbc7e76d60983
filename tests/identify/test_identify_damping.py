"""Damping against amplitude: of viscous swings, of swings that rub, and of the simulated robot."""

from __future__ import annotations

import numpy as np
import pytest
from linear_robot import BOUNCE, SWAY, driven, released

from workbench.errors import InputError
from workbench.identify import damping

PULLS = (0.006, 0.015, 0.03)


def test_viscous_swings_have_their_damping_at_every_amplitude() -> None:
    modes = damping([released(pull=pull, seed=k) for k, pull in enumerate(PULLS)])
    assert [mode.oscillation for mode in modes] == ["torsional", "longitudinal"]
    for mode, truth in zip(modes, (SWAY, BOUNCE), strict=True):
        damped = truth.w0 * np.sqrt(1 - truth.ratio**2)
        assert mode.hz == pytest.approx(damped / (2 * np.pi), rel=1e-3)
        assert mode.ratio == pytest.approx(truth.ratio, rel=0.05)
        assert mode.interval90[0] < truth.ratio < mode.interval90[1]
        assert mode.viscous is True
        assert "viscous: no trend" in str(mode)
    low, high = modes[0].amplitudes
    assert low < 0.003 < 0.02 < high < 0.03


def test_false_trends_are_rare() -> None:
    found = [
        damping([released(pull=pull, seed=100 * draw + k) for k, pull in enumerate(PULLS[::2])])[0]
        for draw in range(15)
    ]
    assert sum(mode.viscous is False for mode in found) <= 1


def test_swings_that_rub_are_not_viscous_and_fall_with_amplitude() -> None:
    mode = damping([released(pull=p, seed=k, friction=2e-5) for k, p in enumerate(PULLS)])[0]
    assert mode.viscous is False
    assert mode.trend < 0
    assert "as friction does" in str(mode)
    smallest = min(mode.points, key=lambda point: point.amplitude)
    told = SWAY.ratio + 2e-5 / smallest.amplitude
    assert smallest.ratio == pytest.approx(told, rel=0.15)


def test_too_few_windows_tell_no_trend() -> None:
    mode = damping([released(5.0)])[0]
    assert mode.viscous is None
    assert "too few windows" in str(mode)
    assert mode.as_json()["viscous"] is None


def test_runs_without_a_ring_down_or_a_swing_are_refused() -> None:
    with pytest.raises(InputError, match="no ring-down is given"):
        damping([driven(14.0, 4.0)])
    with pytest.raises(InputError, match=r"T swings by less than 0\.5 mm after the releases of"):
        damping([released(pull=1e-4, noise=1e-5)])
