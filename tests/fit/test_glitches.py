"""Glitches are found in what was seen alone, and landings are not taken for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.bank.cases import Run
from benchmarks.bank.courses import Course
from benchmarks.bank.observe import film
from benchmarks.bank.write import measured_run
from tests.fit.filmed import ROBOT, measured, ramp, twin_motion
from workbench.fit import Estimator, Hopper, ParameterVector, refined
from workbench.fit.glitches import glitches
from workbench.motion import FOOT, TOP

Array = NDArray[np.float64]

HOP = Course("hop", 6.0, ramp(17.0))
PLACES = (FOOT[0], FOOT[2], TOP[0], TOP[2])


@pytest.fixture(scope="module")
def places() -> Array:
    """Where foot and T of a hop are, (n, 4) [m]."""
    return twin_motion(HOP).select(PLACES).values


@pytest.mark.parametrize("sigma", [5e-5, 3e-4])
def test_no_landing_is_taken_for_a_glitch(places: Array, sigma: float) -> None:
    seen = places + np.random.default_rng(1).normal(0.0, sigma, places.shape)
    assert np.abs(np.diff(seen[:, 1], 2)).max() > 2e-3  # the foot's speed jumps
    assert not glitches(seen, np.full(4, sigma)).any()


@pytest.mark.parametrize("length", [1, 2, 3])
@pytest.mark.parametrize("sigma", [5e-5, 3e-4])
def test_a_glitch_is_found_wherever_it_is(places: Array, sigma: float, length: int) -> None:
    rng, count = np.random.default_rng(length), len(places)
    seen = places + rng.normal(0.0, sigma, places.shape)
    wrong = np.zeros(seen.shape, dtype=np.bool_)
    for channel in range(4):
        for begin in range(40 + 7 * channel, count - 40, 40):
            wrong[begin : begin + length, channel] = True
    seen[wrong] += rng.choice([-0.012, 0.012], wrong.sum() // length).repeat(length)
    found = glitches(seen, np.full(4, sigma))
    assert not (found & ~wrong).any()
    assert (found & wrong).sum() >= 0.97 * wrong.sum()


def test_of_a_marker_that_slips_few_samples_are_left_out(places: Array) -> None:
    seen = places + np.random.default_rng(2).normal(0.0, 3e-4, places.shape)
    seen[300:, 2] += 0.012
    (left_out,) = np.nonzero(glitches(seen, np.full(4, 3e-4)).any(axis=1))
    assert len(left_out) <= 4
    assert np.abs(left_out - 300).max() <= 4


def test_gaps_and_what_was_not_seen_at_all_are_no_glitches(places: Array) -> None:
    seen = places + np.random.default_rng(3).normal(0.0, 3e-4, places.shape)
    seen[100:130, 0], seen[::2, 1], seen[:, 2] = np.nan, np.nan, np.nan
    assert not glitches(seen, np.full(4, 3e-4)).any()
    assert glitches(seen[:3], np.full(4, 3e-4)).shape == (3, 4)


def test_coarse_counts_of_an_encoder_are_no_glitches() -> None:
    step = 1e-3
    angle = step * np.round(np.sin(np.linspace(0.0, 20.0, 2000)) / step)
    assert not glitches(angle[:, None], np.array([step / np.sqrt(12)])).any()


@pytest.mark.parametrize("seed", [2, 27])
def test_a_hop_with_glitches_is_observed_to_its_end(seed: int) -> None:
    """Each would kick a strongly corrected state, and the hop be lost."""
    course = Course("hop", 3.0, ramp(18.27))
    seen = film(twin_motion(course), "B", np.random.default_rng(seed))
    system = Hopper(ROBOT, [measured_run(Run("hop run", "train", course, seen))])
    vector = ParameterVector(system.parameters)
    x = np.zeros(len(vector))
    white = refined(Estimator.of(system, vector, system.strong), x).innovations(x)[0].white
    assert np.sqrt(np.nanmean(white**2)) < 1.1


def test_a_run_is_observed_without_its_glitches() -> None:
    course = Course("clamped", 6.0, ramp(8.5))
    run = measured(twin_motion(course), course)
    rng = np.random.default_rng(5)
    at = np.sort(rng.choice(np.arange(200, len(run.motion) - 20, 20), 8, replace=False))
    values = run.motion.values.copy()
    columns = [run.motion.names.index(name) for name in run.places]
    values[at[:, None], columns] += rng.choice([-0.012, 0.012], (len(at), 2))
    system = Hopper(ROBOT, [replace(run, motion=replace(run.motion, values=values))])
    unseen = np.isnan(system.seen(0)) & np.isfinite(Hopper(ROBOT, [run]).seen(0))
    assert (np.flatnonzero(unseen.all(axis=1)) + system.first(0)).tolist() == at.tolist()
    assert unseen.sum() == 2 * len(at)
