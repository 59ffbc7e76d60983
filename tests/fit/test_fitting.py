"""The fit: from a far start to intervals, its null space, and the process noise it finds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.bank.courses import Course
from tests.fit.filmed import ROBOT, measured, ramp, twin_motion
from tests.fit.test_mjcf_system import ANGLE_NOISE, PENDULUM, PIVOT, TRUTH, swung
from workbench.errors import InputError
from workbench.fit import (
    ROBUST,
    Channel,
    Estimator,
    Fit,
    Free,
    Hopper,
    Job,
    JointStart,
    MjcfRun,
    MjcfSystem,
    ParameterVector,
    Start,
    covariance,
    fit_system,
    free_parameters,
    intervals,
    minimised,
    undetermined,
)
from workbench.schemas import load_model

Array = NDArray[np.float64]


def decay(seed: int, seconds: float = 3.0) -> MjcfRun:
    times = np.arange(0, seconds, 0.02)
    angles = swung(times, lambda t: 0.0 * t, (0.9, 0.5))
    angles = angles + np.random.default_rng(seed).normal(0, ANGLE_NOISE, len(times))
    start = JointStart.seen(times, angles, ANGLE_NOISE)
    return MjcfRun(f"decay {seed}", times, angles[:, None], {"pivot": start})


def undriven(**off: float) -> MjcfSystem:
    values = {name: value * off.get(name, 1.0) for name, value in TRUTH.items()}
    # dry friction as hard as that of the data: a softer one is seen, 0.7 mrad off
    text = PENDULUM.format(**values).replace('timestep="0.001"', 'timestep="0.00025"')
    spec = mujoco.MjSpec.from_string(text.replace('"0.002 1"', '"0.0005 1"'))
    channel = Channel("angle", "position", "pivot", sigma=ANGLE_NOISE)
    return MjcfSystem(spec, [channel], [decay(1), decay(2)], (), PIVOT)


def landing(monkeypatch: pytest.MonkeyPatch) -> MjcfSystem:
    """Return a system whose differences are as long as where a foot lands."""
    system = undriven()
    monkeypatch.setattr(system, "lands", lambda run: True)
    return system


@cache
def fitted() -> Fit:
    system = undriven(damping=1.3, friction=0.7, stiffness=1.3)
    return fit_system(system, ParameterVector(system.parameters), threads=1)


@pytest.mark.budget(25)  # the whole fit that two tests share
def test_a_far_start_ends_at_the_truth_within_its_intervals() -> None:
    fit = fitted()
    found = {p.name: one for p, one in intervals(fit, covariance(fit)).items()}
    for name, key in (
        ("pivot damping", "damping"),
        ("pivot frictionloss", "friction"),
        ("pivot stiffness", "stiffness"),
    ):
        one = found[name]
        assert one.value == pytest.approx(TRUTH[key], rel=0.05)
        assert one.low < TRUTH[key] < one.high
        assert one.high - one.low < 0.15 * TRUTH[key]


@pytest.mark.budget(25)  # the same
def test_the_process_noise_falls_where_the_model_lacks_nothing() -> None:
    fit = fitted()
    strong = fit.estimator.system.strong["hinges"]
    assert fit.estimator.noise["hinges"] < strong / 100
    assert np.mean(list(fit.ratios.values())) == pytest.approx(1.0, abs=0.12)


def test_a_derivative_at_a_bound_is_taken_to_the_side_that_is_left() -> None:
    system = undriven()
    vector = ParameterVector(system.parameters)
    estimator = Estimator.of(system, vector, system.strong, threads=1)
    for bound in vector.bounds:
        x = np.where(np.isfinite(bound), bound, 0.0)
        found = estimator.jacobian(x, central=True)
        inside = estimator.jacobian(np.clip(x, vector.bounds[0] + 0.1, vector.bounds[1] - 0.1))
        assert np.isfinite(found).all()
        moved = np.flatnonzero(np.isfinite(bound))
        norms = np.linalg.norm(found[:, moved], axis=0) / np.linalg.norm(inside[:, moved], axis=0)
        assert np.all((norms > 0.3) & (norms < 3)), norms


class Kinked:
    """One number; coarse steps promise that it lowers the cost, full ones that it does not."""

    vector = SimpleNamespace(bounds=(np.array([-5.0]), np.array([5.0])))
    robust, edges = np.array([3.0]), (0, 1, 1)

    def __init__(self, full: bool = True) -> None:
        self.full = full

    def near(self, x: np.ndarray) -> Kinked:
        return Kinked(full=False)

    def residuals(self, x: np.ndarray) -> np.ndarray:
        return np.array([1.0 + 5.0 * (x[0] != 0)]) if self.full else 1.0 - x

    def jacobian(self, x: np.ndarray, *given: object) -> np.ndarray:
        return np.array([[-1.0]])


def test_a_way_that_full_steps_do_not_take_is_not_taken() -> None:
    found = minimised(cast("Estimator", Kinked()), np.zeros(1))
    assert found.x.tolist() == [0.0]
    assert found.residuals.tolist() == [1.0]
    assert not found.converged
    coarse = minimised(cast("Estimator", Kinked(full=False)), np.zeros(1))
    assert coarse.x[0] > 0.4


def test_data_are_robust_and_priors_are_squares() -> None:
    system = undriven()
    vector = ParameterVector(system.parameters)
    estimator = Estimator.of(system, vector, system.strong, threads=1)
    rows = len(estimator.residuals(np.zeros(len(vector))))
    assert estimator.robust.shape == (rows,)
    priors = np.isinf(estimator.robust)
    assert priors.sum() == vector.weighted.sum() > 0
    assert not priors[: estimator.edges[-2]].any()
    assert set(estimator.robust[~priors]) == {ROBUST}


class Limited(Estimator):
    """Cannot simulate what has its first number beyond 0.02."""

    def job(self, run: int, x: NDArray[np.float64], coarse: bool = False) -> Job:
        if x[0] > 0.02:
            raise InputError("not in steps of this length")
        return super().job(run, x, coarse)


def test_a_difference_is_as_long_as_can_be_simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    system = landing(monkeypatch)
    vector = ParameterVector(system.parameters)
    free, limited = (of(system, vector, system.strong, 1) for of in (Estimator.of, Limited.of))
    x = np.zeros(len(vector))
    short, steps = np.full(len(x), 0.01), np.full(len(x), 0.1)
    np.testing.assert_allclose(
        limited.jacobian(x, steps=steps)[:, 0], free.jacobian(x, steps=short)[:, 0], atol=1e-9
    )
    np.testing.assert_allclose(
        limited.jacobian(x, steps=steps)[:, 1:], free.jacobian(x, steps=steps)[:, 1:], atol=1e-9
    )
    with pytest.raises(InputError, match="not in steps of this length"):
        limited.jacobian(np.full(len(x), 0.03))


def test_secants_go_as_far_as_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    system = landing(monkeypatch)
    vector = ParameterVector(system.parameters)
    estimator = Estimator.of(system, vector, system.strong, threads=1)
    x, rows = np.zeros(len(vector)), estimator.edges[-2]
    one = [p.name for p in vector.parameters].index("pivot damping")
    for reach in (-0.5, 2.0):
        moved = x.copy()
        moved[one] = reach
        change = (estimator.coarse(moved) - estimator.coarse(x)) / reach
        found = estimator.jacobian(x, [one], np.full(len(x), reach))
        np.testing.assert_allclose(found[:rows, one], change[:rows], atol=1e-9)
        assert np.abs(found[:rows, one]).max() > 0.01


def test_coarse_steps_are_asked_for_once_and_anew_for_another_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    system = undriven()
    vector = ParameterVector(system.parameters)
    estimator = Estimator.of(system, vector, system.strong, threads=1)
    x, rows, asked = np.full(len(vector), 0.01), estimator.edges[-2], list[bool]()
    start = type(system).start

    def counting(*given: Any) -> Start:
        asked.append(bool(given[-1]))
        return start(*given)

    monkeypatch.setattr(type(system), "start", counting)
    near = estimator.near(x)
    assert sum(asked) == len(system.names)
    np.testing.assert_array_equal(near.residuals(x)[:rows], estimator.residuals(x)[:rows])
    estimator.jacobian(x, [])
    assert sum(asked) == len(system.names)
    other = estimator.with_noise({group: q / 10 for group, q in system.strong.items()})
    short = replace(estimator, window=0.1)
    for one in (other, short):
        asked.clear()
        one.coarse(x)
        assert sum(asked) == len(system.names)
    assert np.abs(other.coarse(x)[:rows] - estimator.coarse(x)[:rows]).max() > 0.01
    assert np.array_equal(near.coarse(x), estimator.coarse(x))


def test_two_numbers_that_act_together_are_said_to() -> None:
    spec = mujoco.MjSpec.from_string("""
      <mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody><body name="cart">
      <joint name="rail" type="slide" axis="1 0 0" stiffness="40" damping="0.4"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>""")
    times = np.arange(0, 4, 0.02)
    x = 0.1 * np.exp(-0.2 * times) * np.cos(np.sqrt(40 - 0.04) * times)
    x += np.random.default_rng(0).normal(0, 1e-4, len(times))
    start = JointStart.seen(times, x, 1e-4)
    run = MjcfRun("release", times, x[:, None], {"rail": start})
    channel = Channel("x", "position", "rail", sigma=1e-4)
    free = [
        Free("mass", "cart", 0.3, flat=True),
        Free("stiffness", "rail", 10.0, flat=True),
        Free("damping", "rail", 0.1, flat=True),
    ]
    system = MjcfSystem(spec, [channel], [run], (), free)
    fit = fit_system(system, ParameterVector(system.parameters), threads=1)
    (open_,) = undetermined(fit.vector, covariance(fit).information)
    assert set(open_.names) == {"cart mass", "rail stiffness", "rail damping"}


@pytest.mark.budget(25)  # a whole fit of the robot
def test_the_beam_is_found_from_a_driven_run_and_a_ring_down() -> None:
    courses = [Course("clamped", 2.0, ramp(13.0)), Course("decay", 2.0, pull=0.4)]
    runs = [measured(twin_motion(course), course, k) for k, course in enumerate(courses)]
    model = load_model("thesis", Path()).content
    free = free_parameters(model, ["hinge_stiffness", "root_stiffness"])
    system = Hopper(ROBOT, runs, free)
    start = np.zeros(len(system.parameters))
    start[:2] = [2.0, -2.0]  # tolerances of a tenth: 22 % and -18 %
    fit = fit_system(system, ParameterVector(system.parameters), start=start)
    found = fit.vector.values(fit.x)
    assert found[free[0]] == pytest.approx(9.5, rel=0.01)
    assert found[free[1]] == pytest.approx(12.0, rel=0.01)


def test_an_unknown_parameter_is_named_with_those_that_exist() -> None:
    model = load_model("thesis", Path()).content
    with pytest.raises(InputError, match=r"'hinge_stifness' is unknown.*hinge_stiffness"):
        free_parameters(model, ["hinge_stifness"])
