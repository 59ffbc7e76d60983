"""Noise that remembers, residuals freed from it, and the size of what hides in it."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.diagnose.noise import Noise, coloured, whitened

SHAPES = [(400, 2), (400, 2, 3)]


def noise(*memory: float) -> Noise:
    return Noise(np.array([3e-4, 0.02]), np.array(memory))


@pytest.mark.parametrize("shape", SHAPES)
def test_coloured_is_what_whitened_was_made_of(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    known, valid = noise(0.8, 0.3), rng.random((400, 2)) > 0.05
    extra = (None,) * (len(shape) - 2)
    sigma = known.sigma[(slice(None), *extra)]
    apart = sigma * rng.standard_normal(shape)
    found = coloured(whitened(apart, valid, known), valid, known)
    wanted = np.where(valid[(..., *extra)], apart / sigma, 0.0)
    assert found == pytest.approx(wanted, abs=1e-12)


def test_what_lasts_weighs_less_than_it_is_large() -> None:
    """A constant of one deviation is (1 - m)^2 / (1 - m^2) of that, in squares."""
    valid = np.ones((400, 2), dtype=bool)
    for memory in (0.0, 0.8):
        known = noise(memory, memory)
        white = whitened(np.ones((400, 2)) * known.sigma, valid, known)
        weight = (1 - memory) / (1 + memory)
        assert np.mean(white[1:] ** 2) == pytest.approx(weight)
        assert coloured(white, valid, known) == pytest.approx(1.0)


def test_what_was_not_seen_has_no_size() -> None:
    valid = np.ones((400, 2), dtype=bool)
    valid[100:200, 1] = False
    known = noise(0.8, 0.8)
    found = coloured(whitened(np.ones((400, 2)), valid, known), valid, known)
    assert not found[100:200, 1].any()
    assert found[100:200, 0].all()
