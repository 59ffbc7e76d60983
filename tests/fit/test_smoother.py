"""The smoother against dense conditioning, the other engine's beam, and forces that are hidden."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bank.cases_rod import _series
from benchmarks.bank.courses import Course
from benchmarks.bank.rod import Motion, Rod, _engine, swing
from benchmarks.bank.rod_equations import conserved
from tests.fit.filmed import ROBOT, SHAPE, VALUES, hopper, measured, ramp, twin_motion
from workbench.errors import InputError
from workbench.fit import WINDOW, Hopper, Innovations, Modes, at_points, estimated_state, smoothed
from workbench.fit.gain import stationary
from workbench.fit.smoother import Smoothed
from workbench.motion import FOOT, TOP
from workbench.report import Figure
from workbench.report.geometry import beam_points
from workbench.timeseries import TimeSeries

DT = 1 / 120
CLAMPED = Course("clamped", 4.0, ramp(8.5))
DRIVEN_AND_RELEASED = (CLAMPED, Course("hop", 4.0, ramp(17.0)), Course("decay", 3.0, pull=0.8))
FIGURE = Figure(VALUES["foot_length"], 0.1, SHAPE.length, VALUES["beam_root"], 0.03)


class Linear:
    """Two modes seen in two channels, observed with the stationary gain."""

    def __init__(self, count: int, seed: int = 0, memory: float = 0.0) -> None:
        rng = np.random.default_rng(seed)
        slopes = np.array([[2.0, 0.5], [-0.7, 1.5]])
        self.modes = Modes(np.eye(2), np.diag([90.0, 900.0]), 0.4 * np.eye(2), slopes)
        self.process, self.sigma = np.array([0.02, 0.05]), np.array([2e-4, 3e-4])
        both = np.array([memory, memory])
        self.gain = stationary(self.modes, self.process, self.sigma, DT, both)
        self.step, self.kicks, self.seen_by = self.gain.with_noises(
            self.modes.transition(DT),
            self.modes.kicks(self.process, DT),
            np.hstack([slopes, np.zeros((2, 2))]),
        )
        size, kick = len(self.step), np.linalg.cholesky(self.kicks)
        self.white = np.sqrt(self.gain.noise)
        self.truth = np.empty((count, size))
        self.truth[0] = np.linalg.cholesky(self.gain.covariance) @ rng.standard_normal(size)
        self.kicked = (kick @ rng.standard_normal((size, count))).T
        for k in range(count - 1):
            self.truth[k + 1] = self.step @ self.truth[k] + self.kicked[k]
        self.seen = self.truth @ self.seen_by.T + self.white * rng.standard_normal((count, 2))
        self.run, self.predicted = self.observe()

    def observe(self) -> tuple[Innovations, np.ndarray]:
        before, wide = self.gain.covariance, self.seen_by
        spread = wide @ before @ wide.T + np.diag(self.white**2)
        gain = before @ wide.T @ np.linalg.inv(spread)
        predicted, error = np.zeros_like(self.truth), np.zeros_like(self.seen)
        for k in range(len(self.seen)):
            error[k] = self.seen[k] - wide @ predicted[k]
            if k + 1 < len(self.seen):
                predicted[k + 1] = self.step @ (predicted[k] + gain @ error[k])
        count = len(self.seen)
        slopes = np.tile(self.modes.slopes, (count, 1, 1))
        empty = np.zeros((count, 2))
        found = Innovations(error, empty, empty[:, 0], slopes, 0 * self.modes.slopes,
                            predicted[:, :2], predicted[:, 2:4], count)  # fmt: skip
        return found, predicted

    def smoothed(self) -> Smoothed:
        return smoothed(self.run, self.gain, self.modes, self.process, DT)

    def dense(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mean and covariance of first state and kicks given all samples; the map to states."""
        count, n = len(self.seen), len(self.step)
        prior = np.zeros((n * count, n * count))
        prior[:n, :n] = self.gain.covariance
        for k in range(1, count):
            prior[n * k : n * k + n, n * k : n * k + n] = self.kicks
        states = np.zeros((n * count, n * count))
        for k in range(count):
            for j in range(k + 1):
                power = np.linalg.matrix_power(self.step, k - j)
                states[n * k : n * k + n, n * j : n * j + n] = power
        seen = np.kron(np.eye(count), self.seen_by) @ states
        spread = seen @ prior @ seen.T + np.diag(np.tile(self.white**2, count))
        gain = prior @ seen.T @ np.linalg.inv(spread)
        return gain @ self.seen.ravel(), prior - gain @ seen @ prior, states


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_smoothed_states_and_forces_are_those_of_dense_conditioning(memory: float) -> None:
    linear = Linear(40, memory=memory)
    found = linear.smoothed()
    mean, covariance, states = linear.dense()
    n = len(linear.step)
    dense = (states @ mean).reshape(40, n)[:, :4]
    np.testing.assert_allclose(linear.predicted[:, :4] + found.change, dense, atol=1e-10)
    whole = states @ covariance @ states.T
    for k in (0, 17, 39):
        block = whole[n * k : n * k + 4, n * k : n * k + 4]
        np.testing.assert_allclose(found.covariance[k], block, atol=1e-6 * np.abs(block).max())
    for k in (5, 20, 30):
        pick = np.zeros((2, len(mean)))
        for sample in range(k - WINDOW // 2 + 1, k + WINDOW // 2 + 1):
            pick[:, n * sample + 2 : n * sample + 4] = np.eye(2) / (WINDOW * DT)
        np.testing.assert_allclose(found.force[k], pick @ mean, rtol=1e-6, atol=1e-9)
        spread = pick @ covariance @ pick.T
        np.testing.assert_allclose(found.force_covariance[k], spread, rtol=1e-5)


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_the_truth_lies_within_the_stated_deviations(memory: float) -> None:
    linear = Linear(1200, seed=3, memory=memory)
    found = linear.smoothed()
    wrong = (linear.predicted - linear.truth)[:, :4] + found.change
    share = wrong / np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    assert np.sqrt(np.mean(share**2)) == pytest.approx(1.0, abs=0.1)


def test_a_gap_leaves_more_uncertain() -> None:
    linear = Linear(120)
    linear.run.error[50:60] = np.nan
    sigma = np.sqrt(linear.smoothed().covariance[:, 0, 0])
    assert sigma[54] > 1.5 * sigma[30]


def test_1200_samples_of_six_modes_take_less_than_a_tenth_of_a_second() -> None:
    rng = np.random.default_rng(0)
    basis = np.linalg.qr(rng.standard_normal((20, 6)))[0]
    modes = Modes(basis, np.diag(np.geomspace(1, 1e4, 6)), np.eye(6), rng.standard_normal((4, 6)))
    process, sigma = np.full(20, 1e-3), np.full(4, 2e-4)
    gain = stationary(modes, process, sigma, DT)
    run = Innovations(1e-4 * rng.standard_normal((1200, 4)), np.zeros((1200, 4)), np.zeros(1200),
                      np.tile(modes.slopes, (1200, 1, 1)), 0 * modes.slopes,
                      np.zeros((1200, 20)), np.zeros((1200, 20)), 1200)  # fmt: skip
    spent = []
    for _ in range(3):
        begin = time.process_time()
        smoothed(run, gain, modes, process, DT)
        spent.append(time.process_time() - begin)
    assert min(spent) < 0.1


def test_a_force_at_a_point_is_found_again_from_its_modal_forces() -> None:
    rng = np.random.default_rng(1)
    slopes, force = rng.standard_normal((5, 2, 3)), rng.standard_normal((5, 2))
    modal = np.einsum("krm,kr->km", slopes, force)
    root = rng.standard_normal((5, 3, 3))
    found, covariance = at_points(modal, root @ root.swapaxes(1, 2) + np.eye(3), slopes)
    np.testing.assert_allclose(found, force)
    assert (np.linalg.eigvalsh(covariance) > 0).all()


def middle_of(rod: Rod, motion: Motion) -> np.ndarray:
    """x and z of the middle of the other engine's strip, (n, 2) [m]: the ninth element's middle."""
    engine = _engine(rod, "fixed")
    point, found = 3 * 8 + 1, []
    for state in motion.states:
        conserved(engine.mesh, engine.constants, state, engine.work, 0)
        found.append((engine.work.place_x[point], engine.work.place_z[point]))
    return np.array(found)


@pytest.mark.budget(45)  # compiles the other engine where it is the first to use it
@pytest.mark.parametrize("course", DRIVEN_AND_RELEASED, ids=lambda c: c.mode)
def test_the_middle_of_the_beam_is_where_the_other_engine_has_it(course: Course) -> None:
    rod = Rod(VALUES, SHAPE.angles, SHAPE.length)
    motion = swing(rod, course)
    sink = motion.states[0, 1] if course.mode == "hop" else 0.0
    truth = middle_of(rod, motion) - [0.0, sink]
    state = estimated_state(hopper(_series(motion), course))
    beam = beam_points(state, FIGURE)[:, 8][:, [0, 2]]
    at = np.round(state.times * 120).astype(int)
    after = at >= 0
    apart = 1000 * np.linalg.norm(beam[after] - truth[at[after]], axis=1)
    assert np.sqrt(np.mean(apart**2)) < 0.5  # the bar is 1.0 mm; the beam moves by 20 mm and more
    assert np.ptp(truth[:, 0]) > 0.01


def ratios(state: TimeSeries, name: str) -> np.ndarray:
    unit = "_N_per_sqrt_kg" if name.endswith("kg") else "_N"
    return state[name] / state[f"{name.removesuffix(unit)}_sigma{unit}"]


MISSING = ("missing_top_x_N", "missing_top_z_N", "missing_mode_0_N_per_sqrt_kg")


def test_with_nothing_hidden_nothing_is_missing() -> None:
    motion = twin_motion(CLAMPED)
    state = estimated_state(hopper(motion, CLAMPED))
    for name in MISSING:
        assert np.mean(np.abs(ratios(state, name)) < 2) > 0.98, name
    at = np.round(state.times * 120).astype(int)
    for place in (TOP[0], TOP[2]):
        wrong = (state[place] - motion[place][np.maximum(at, 0)])[at >= 0]
        sigma = state[place.replace("_m", "_sigma_m")][at >= 0]
        assert 0.5 < np.sqrt(np.mean((wrong / sigma) ** 2)) < 1.5


def test_a_cable_that_the_model_lacks_shows_as_a_force_on_t() -> None:
    motion = twin_motion(CLAMPED, {"tether": {"stiffness": 0.7}})
    state = estimated_state(hopper(motion, CLAMPED))
    assert np.mean(np.abs(ratios(state, "missing_top_x_N")) < 2) < 0.5
    way = state[TOP[0]] - state[TOP[0]][0]
    late = state.times > 1.0
    force, pull = state["missing_top_x_N"][late], -0.7 * way[late]
    assert np.corrcoef(force, pull)[0, 1] > 0.9
    assert 0.4 < np.polyfit(pull, force, 1)[0] < 1.1


def test_a_beam_that_stiffens_shows_in_the_first_mode() -> None:
    motion = twin_motion(CLAMPED, {"hinge_cubic_stiffness": {"k3": 1500.0}})
    state = estimated_state(hopper(motion, CLAMPED))
    assert np.sqrt(np.mean(ratios(state, "missing_mode_0_N_per_sqrt_kg") ** 2)) > 2


def test_a_run_without_rest_or_with_a_lost_robot_is_refused() -> None:
    run = measured(twin_motion(CLAMPED), CLAMPED)
    late = replace(run, motion=run.motion.between(0.1, np.inf))
    with pytest.raises(InputError, match="needs some rest"):
        Hopper(ROBOT, [late])
    blind = run.motion.valid.copy()
    blind[run.motion.times > 1.0] = False
    lost = replace(run, motion=replace(run.motion, valid=blind))
    with pytest.raises(InputError, match="seen in only 2"):
        estimated_state(Hopper(ROBOT, [lost]))


def test_samples_far_from_any_that_was_seen_are_not_valid() -> None:
    run = measured(twin_motion(CLAMPED), CLAMPED)
    gone = (run.motion.times > 2.0) & (run.motion.times < 2.5)
    seen = run.motion.valid & ~gone[:, None]
    state = estimated_state(Hopper(ROBOT, [replace(run, motion=replace(run.motion, valid=seen))]))
    inside = (state.times > 2.15) & (state.times < 2.35)
    assert not state.validity(FOOT[0])[inside].any()
    assert state.validity(TOP[0])[state.times < 2.0].all()
