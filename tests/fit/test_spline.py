"""Splines of many strengths by the compiled solver are those of LAPACK's."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from workbench.fit.spline import left_of, rests_of

COUNT, STRENGTHS = 50, np.geomspace(1e-2, 1e6, 5)


@pytest.fixture(scope="module")
def given() -> tuple[np.ndarray, ...]:
    """Return bands of D'D, W'W of a noise with a memory and a gap, columns and their goal."""
    rng = np.random.default_rng(1)
    difference = np.diff(np.eye(COUNT), n=2, axis=0)
    whitening = np.eye(COUNT) - 0.3 * np.eye(COUNT, k=-1)
    whitening[20:25] = 0.0
    whitening[25, 24] = 0.0
    penalty, normal = difference.T @ difference, whitening.T @ whitening
    bands = np.array([np.r_[np.zeros(d), np.diag(penalty, d)] for d in range(3)])
    every = rng.standard_normal((COUNT, 3))
    beside = np.r_[0.0, np.diag(normal, 1)]
    return bands, np.diag(normal).copy(), beside, every, normal @ every


@pytest.mark.parametrize("strength", STRENGTHS)
def test_what_is_left_is_that_of_lapack(given: tuple[np.ndarray, ...], strength: float) -> None:
    bands, square, beside, every, goal = given
    whole = strength * bands[::-1]
    whole[2] += square
    whole[1] += beside
    smooth = scipy.linalg.solveh_banded(whole, goal)
    assert np.abs(left_of(strength, *given) - (every - smooth)).max() < 1e-9
    assert np.abs(every - smooth).max() > 0.1


def test_rests_are_products_with_what_is_left(given: tuple[np.ndarray, ...]) -> None:
    rests = rests_of(STRENGTHS, *given)
    for strength, rest in zip(STRENGTHS, rests, strict=True):
        assert np.allclose(rest, given[-1].T @ left_of(strength, *given), rtol=1e-12)
    assert (np.diff(rests[:, 0, 0]) > 0).all()
