"""Hops in windows: what no stance makes up for shows, what one does make up for does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose.hidden import DOCUMENT, NOISE_M, SHAPE, Asked, runs_of, truth
from workbench.diagnose import HopperRig
from workbench.diagnose.layout import Layout
from workbench.diagnose.noise import Noise, noise_of
from workbench.diagnose.problem import Problem
from workbench.diagnose.rig import Forgetful, Windowed
from workbench.diagnose.windows import Windows, windows_in
from workbench.fit import MeasuredRun
from workbench.timeseries import TimeSeries

pytestmark = pytest.mark.long  # hops are simulated and fitted many times

LENGTHS = [4.0, pytest.param(8.0, marks=pytest.mark.long)]  # [s]
SLOPE = {"ground_slope": {"slope": 0.02}}


def hop(effects: dict[str, dict[str, float]], seconds: float) -> HopperRig:
    asked = [Asked("hop", 18.0, seconds)]
    return HopperRig(runs_of(truth(1, effects, off=0.0), 1, asked), DOCUMENT, SHAPE)


def problem_of(rig: HopperRig) -> Problem:
    return Problem(rig, Layout(rig), noise_of(rig.runs), (0,))


def windows_of(problem: Problem, at: np.ndarray | None = None) -> Problem:
    found = problem.in_windows(np.zeros(len(problem.layout)) if at is None else at)
    assert found is not None
    return found


@pytest.fixture(scope="module", params=LENGTHS)
def plain(request: pytest.FixtureRequest) -> Problem:
    return windows_of(problem_of(hop({}, request.param)))


def left(problem: Problem, z: np.ndarray) -> np.ndarray:
    """Return the sums of squares of each window over those that noise leaves."""
    rig = problem.rig
    assert isinstance(rig, HopperRig)
    white = problem.residuals(z)[0].reshape(-1, 5)
    later = rig.runs[0].times > 1.0
    seen = problem.seen[0][later].reshape(-1, windows(problem).count * 5)
    rows = white[later].reshape(len(seen), -1)
    return np.sum(rows**2, axis=1) / np.maximum(seen.sum(axis=1) - 10, 1)


def windows(problem: Problem) -> Windows:
    assert isinstance(problem.rig, HopperRig)
    return problem.rig.windows[0]


def test_a_rig_of_hops_forgets_and_can_be_taken_up_again(plain: Problem) -> None:
    assert isinstance(plain.rig, Forgetful)
    assert isinstance(plain.rig, Windowed)


def test_windows_follow_the_seconds_from_rest(plain: Problem) -> None:
    times = plain.rig.runs[0].times
    first = int((times <= 1.0).sum())
    assert first in (119, 120, 121)
    assert times[first] >= 2.0
    assert np.all(np.diff(times) > 0)
    least, most = (4, 8) if times[-1] > 5 else (3, 4)
    assert least <= len(windows(plain)) <= most
    assert not plain.seen[0][first :: windows(plain).count].any()  # nobody saw the sample before


def test_the_true_model_leaves_noise_of_each_window(plain: Problem) -> None:
    assert left(plain, np.zeros(len(plain.layout))).max() < 1.5


def test_what_a_run_keeps_to_itself_is_over_when_a_window_begins(plain: Problem) -> None:
    layout = plain.layout
    z = np.zeros(len(layout))
    for i in layout.own(0):
        if layout.unknowns[i].name in ("delay", "lag", "start angle"):
            z[i] = 2.0
    before, after = (plain.predictions(one)[0] for one in (np.zeros(len(layout)), z))
    later = plain.rig.runs[0].times > 1.0
    assert np.abs(after - before)[~later].max() > 10 * NOISE_M
    np.testing.assert_array_equal(after[later], before[later])


@pytest.mark.parametrize("seconds", LENGTHS)
def test_a_slope_that_the_model_lacks_shows_in_windows(seconds: float) -> None:
    sloped = windows_of(problem_of(hop(SLOPE, seconds)))
    layout = sloped.layout
    z = np.zeros(len(layout))
    bare = left(sloped, z)
    at = layout.of_cause["ground_slope"][0]
    z[at] = SLOPE["ground_slope"]["slope"] / layout.unknowns[at].tolerance
    true = left(sloped, z)
    print("of the noise:", bare.round(2), "with the slope:", true.round(2))
    assert true.max() < 1.5
    assert bare.max() > 1.5 * true.max()


def test_derivatives_are_those_of_what_no_stance_makes_up_for(plain: Problem) -> None:
    layout, origin = plain.layout, np.zeros(len(plain.layout))
    names = ("hinge_stiffness", "ground_stiffness", "foot_mass")
    columns = np.array([i for i in layout.base if layout.unknowns[i].name in names])
    linear = plain.linear(origin, columns)
    later = np.repeat(plain.rig.runs[0].times > 1.0, 5)
    for i in columns:
        z = origin.copy()
        z[i] = 0.3
        change = (plain.residuals(origin)[0] - plain.residuals(z)[0])[later]
        told = 0.3 * linear.jacobians[0][later, i]
        assert told @ change > 0.8 * np.linalg.norm(told) * np.linalg.norm(change)


def test_a_marker_that_sits_elsewhere_counts_no_turns_of_the_rotor(plain: Problem) -> None:
    """Cameras tell the rotor's angle within a turn; a window is dozens of turns from rest."""
    layout, z = plain.layout, np.zeros(len(plain.layout))
    z[layout.of_cause["marker_offset"]] = 0.5
    later = plain.rig.runs[0].times > 1.0
    before, after = (plain.predictions(one)[0][later, 4] for one in (0 * z, z))
    assert before.min() > 10 * np.pi
    assert np.abs(after - before).max() < 0.2


def test_only_windows_that_have_begun_are_told(plain: Problem) -> None:
    begins = windows(plain).begins
    until = begins[1] / 120 + 0.1
    told = plain.predictions(np.zeros(len(plain.layout)), until)[0]
    assert len(told) == (plain.rig.runs[0].times <= until).sum()
    whole = plain.predictions(np.zeros(len(plain.layout)))[0][: len(told)]
    np.testing.assert_allclose(told, whole, atol=NOISE_M / 100)


def test_a_hop_compared_for_a_shorter_time_has_no_windows(plain: Problem) -> None:
    assert isinstance(plain.rig, HopperRig)
    shorter = plain.rig.shortened({0: 1.0})
    assert not shorter.windows
    assert shorter.runs[0].times[-1] <= 1.0


def test_a_rig_without_hops_has_none() -> None:
    clamped = runs_of(truth(1, {}), 1, (Asked("clamped", 13.0, 4.0),))
    problem = problem_of(HopperRig(clamped, DOCUMENT, SHAPE))
    assert problem.in_windows(np.zeros(len(problem.layout))) is None


def test_a_robot_that_cannot_stand_is_far_off(plain: Problem) -> None:
    layout, z = plain.layout, np.zeros(len(plain.layout))
    z[layout.of_cause["hinge_stiffness"][0]] = (
        -0.99 / layout.unknowns[layout.of_cause["hinge_stiffness"][0]].tolerance
    )
    told = plain.predictions(z)[0]
    assert told.shape == plain.rig.runs[0].values.shape
    assert np.all(told == 10.0)


def walking(step: float) -> MeasuredRun:
    """Return a hop whose foot stands for 0.2 s and lifts for 0.16 s, again and again."""
    run = runs_of(truth(1, {}, off=0.0), 1, [Asked("hop", 18.0, 8.0)])[0]
    motion = run.motion
    values, turn = motion.values.copy(), np.mod(motion.times, 0.36)
    values[:, 0] = step * np.floor(np.maximum(motion.times, 0) / 0.36)
    values[:, 2] = np.where((turn < 0.2) | (motion.times < 0), 0.0, 0.01)
    return replace(run, motion=TimeSeries(motion.times, values, motion.names, motion.valid))


NOISE = Noise(np.array([NOISE_M] * 4 + [0.01]), np.zeros(5))


def test_stances_are_where_the_foot_neither_rises_nor_moves() -> None:
    found = windows_in(walking(0.01), NOISE)
    assert found is not None
    phase = np.mod(np.array(found.begins) / 120, 0.36)
    assert np.all((phase > 0.05) & (phase < 0.15))
    assert np.all(np.diff(found.begins) >= found.count)
    assert found.begins[0] >= 240
    np.testing.assert_allclose(
        found.expected[:, 0], 0.01 * np.floor(np.array(found.begins) / 120 / 0.36), atol=1e-9
    )


def test_a_foot_that_never_stands_has_no_window() -> None:
    run = walking(0.0)
    values = run.motion.values.copy()
    values[run.motion.times > 0, 0] += 0.5 * run.motion.times[run.motion.times > 0]
    moved = TimeSeries(run.motion.times, values, run.motion.names, run.motion.valid)
    assert windows_in(replace(run, motion=moved), NOISE) is None
