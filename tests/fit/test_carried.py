"""Derivatives carried to another process noise, beside those that are taken there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.bank.courses import Course
from tests.fit.filmed import ROBOT, measured, ramp, twin_motion
from workbench.fit import (
    Channel,
    Estimator,
    Free,
    Hopper,
    JointStart,
    MjcfRun,
    MjcfSystem,
    ParameterVector,
    free_parameters,
    weaker,
)
from workbench.fit.carried import Transitions, transitions_of
from workbench.fit.noise import Coloured
from workbench.motion import TOP
from workbench.schemas import Mode, load_model

Array = NDArray[np.float64]

CART = """
  <mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody><body name="cart">
  <joint name="rail" type="slide" axis="1 0 0" stiffness="40" damping="0.4"/>
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""


def cart() -> Estimator:
    """Return a mass on a spring: a linear machine, of which A is exact."""
    times = np.arange(0, 4, 0.02)
    x = 0.1 * np.exp(-0.2 * times) * np.cos(np.sqrt(40 - 0.04) * times)
    x += np.random.default_rng(0).normal(0, 1e-4, len(times))
    start = JointStart.seen(times, x, 1e-4)
    seen = x[:, None].copy()
    seen[50:55] = np.nan
    run = MjcfRun("release", times, seen, {"rail": start})
    free = [Free("mass", "cart", 0.3, flat=True), Free("damping", "rail", 0.1, flat=True)]
    spec = mujoco.MjSpec.from_string(CART)
    system = MjcfSystem(spec, [Channel("x", "position", "rail", sigma=1e-4)], [run], (), free)
    system.difference = 1e-3
    return Estimator.of(system, ParameterVector(system.parameters), system.strong, threads=1)


@cache
def beam(mode: Mode, memory: float = 0.0, seconds: float = 2.0) -> Estimator:
    """Return the estimator of one run of the robot."""
    driven = Course(mode, seconds, ramp(13.0))
    course = Course("decay", seconds, pull=0.4) if mode == "decay" else driven
    run = measured(twin_motion(course), course, 0)
    free = free_parameters(
        load_model("thesis", Path()).content, ["hinge_stiffness", "hinge_damping", "top_mass"]
    )
    noise = {c: Coloured(2e-4, memory) for c in (TOP[0], TOP[2])} if memory else None
    system = Hopper(ROBOT, [run], free, coloured=noise)
    vector = ParameterVector(system.parameters)
    return Estimator.of(system, vector, system.strong, threads=1)


def off(one: Estimator, steps: int) -> tuple[float, float]:
    """Return how far what is carried is from what is taken, and how far it went [of its norm]."""
    other, x = one, np.full(len(one.vector), 0.05)
    for _ in range(steps):
        for group in filter(one.depends_on, one.system.groups):
            other = weaker(other, group)
    before = one.jacobian(x)
    found, known = Transitions().carried(before, x, one, other)
    assert known
    taken, rows = other.jacobian(x), one.edges[-2]
    np.testing.assert_array_equal(found[rows:], taken[rows:])
    norm = np.linalg.norm(taken[:rows])
    return (
        float(np.linalg.norm((found - taken)[:rows]) / norm),
        float(np.linalg.norm((before - taken)[:rows]) / norm),
    )


def test_on_a_linear_machine_they_are_those_taken_there() -> None:
    error, change = off(cart(), 2)
    assert change > 0.3
    assert error < 2e-3


@pytest.mark.parametrize("mode", ["decay", "clamped"])
@pytest.mark.budget(20)
def test_on_the_robot_they_are_near_those_taken_there(mode: Mode) -> None:
    error, change = off(beam(mode), 1)
    assert change > 0.1
    assert error < 0.1 * change


@pytest.mark.budget(20)
def test_noise_with_a_memory_is_carried_on() -> None:
    one = beam("decay", 0.6)
    assert one.gains[0].memory.any()
    error, change = off(one, 1)
    assert error < 0.1 * change


def test_a_turning_rotor_makes_each_sample_another() -> None:
    one = beam("clamped")
    (along,) = transitions_of(one, np.zeros(len(one.vector)))
    rest = one.modes[0].transition(one.system.sample_s)
    assert along.shape == (len(one.system.seen(0)), *rest.shape)
    apart = np.abs(along - rest).max(axis=(1, 2)) / np.abs(rest).max()
    assert apart[0] < 0.05
    assert np.ptp(along[:, 3:, :3], axis=0).max() > 0.1


def test_where_a_foot_lands_they_stay_what_they_were() -> None:
    one = beam("hop")
    x = np.zeros(len(one.vector))
    before = np.ones((one.edges[-1], len(x)))
    found, known = Transitions().carried(before, x, one, one.with_noise(one.noise))
    assert not known
    assert found is before


def test_what_leads_out_of_all_bounds_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    one, transitions = beam("decay"), Transitions()
    other, x = weaker(one, one.system.groups[0]), np.zeros(len(one.vector))
    before = one.jacobian(x)
    assert transitions.carried(before, x, one, other)[1]
    wild = (np.full((len(one.system.seen(0)), 6, 6), 1e9),)
    monkeypatch.setattr(transitions, "_along", dict.fromkeys(transitions._along, wild))
    found, known = transitions.carried(before, x, one, other)
    assert not known
    assert found is before


def test_where_nothing_lands_slopes_are_those_of_short_steps() -> None:
    one = beam("clamped")
    x, rows = np.full(len(one.vector), 0.3), one.edges[-2]
    long = np.full(len(x), 0.5)
    found = one.jacobian(x, steps=long)[:rows]
    number = 0  # the stiffness of the hinges
    sides = [one.coarse(np.where(np.arange(len(x)) == number, x + s, x))[:rows] for s in (-1, 1)]
    near = [
        one.coarse(np.where(np.arange(len(x)) == number, x + s, x))[:rows] for s in (-1e-3, 1e-3)
    ]
    slope, secant = (near[1] - near[0]) / 2e-3, (sides[1] - sides[0]) / 2
    assert np.linalg.norm(found[:, number] - slope) < 1e-3 * np.linalg.norm(slope)
    assert np.linalg.norm(secant - slope) > 1e-2 * np.linalg.norm(slope)


def test_coarse_steps_of_another_window_are_observed_anew() -> None:
    systems = [beam("decay", seconds=1.0).system, beam("clamped").system]
    short, long = (one for one in systems if isinstance(one, Hopper))
    system = Hopper(ROBOT, [*short.runs, *long.runs], long.free)
    one = Estimator.of(system, ParameterVector(system.parameters), system.strong, threads=1)
    x = np.zeros(len(one.vector))
    cut = replace(one, window=1.5)  # all of the first run, not of the second
    assert len(one.coarse(x)) == one.edges[-1]
    assert len(cut.coarse(x)) == cut.edges[-1]
