"""What the results owe to the step and to the way that sticking is regularised."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from workbench.motion import TOP, position, summarize
from workbench.schemas import Mode
from workbench.sim import Condition, Robot, Stick, at_rest, sample_times, simulate, simulate_all

STIFFNESS, DAMPING = Stick()
STICKS = {
    "a third of the stiffness": Stick(STIFFNESS / 3, DAMPING),
    "three times the stiffness": Stick(STIFFNESS * 3, DAMPING),
    "a third of the damping": Stick(STIFFNESS, DAMPING / 3),
    "three times the damping": Stick(STIFFNESS, DAMPING * 3),
}


def at(omega: float, mode: Mode) -> Condition:
    return Condition(mode, np.full(len(sample_times(10.0)), omega), rest=0.5)


def halved(robot: Robot) -> Robot:
    return replace(robot, steps_per_sample=2 * robot.steps_per_sample)


@pytest.fixture(scope="module")
def distances(robot: Robot) -> dict[str, float]:
    """Distances after 10 s at 17 rad/s [m]."""
    robots = {"as it is": robot, "half the step": halved(robot)}
    robots |= {name: replace(robot, stick=stick) for name, stick in STICKS.items()}
    results = simulate_all([(r, at(17.0, "hop")) for r in robots.values()])
    return {
        name: summarize(result.motion, 10.0).distance_m
        for name, result in zip(robots, results, strict=True)
    }


def test_half_the_step_moves_t_by_less_than_0_15_mm(robot: Robot) -> None:
    jobs = [(r, at(14.0, "clamped")) for r in (robot, halved(robot))]
    here, there = (position(result.motion, TOP)[-1] for result in simulate_all(jobs))
    apart = float(np.linalg.norm(there - here))
    print(f"half the step: T {1000 * apart:.4f} mm away")
    assert apart < 0.15e-3


def test_t_goes_where_runge_kutta_takes_it_near_the_resonance(robot: Robot) -> None:
    """With centrifugal forces at the speeds of the step before it is 1.3 mm off."""
    condition = Condition("clamped", np.full(961, 10.0))
    ours = position(simulate(robot, condition).motion, TOP)[1:]
    model, data = at_rest(replace(robot, steps_per_sample=272), condition)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    data.ctrl[:] = 10.0
    exact = np.empty_like(ours)
    for place in exact:
        mujoco.mj_step(model, data, nstep=272)
        mujoco.mj_kinematics(model, data)
        place[:] = data.body("top").xpos
    off = np.sqrt(np.mean(np.sum((ours - exact) ** 2, axis=1)))
    print(f"T {1000 * off:.4f} mm off in 8 s, of {1000 * np.ptp(exact[:, 0]):.0f} mm")
    assert off < 0.03e-3


def test_half_the_step_changes_the_distance_by_less_than_2_percent(
    distances: dict[str, float],
) -> None:
    change = distances["half the step"] / distances["as it is"] - 1
    print(f"half the step: {change:+.2%}")
    assert abs(change) < 0.02


@pytest.mark.parametrize("name", STICKS)
def test_a_factor_of_three_in_sticking_changes_it_by_less_than_3_percent(
    distances: dict[str, float], name: str
) -> None:
    change = distances[name] / distances["as it is"] - 1
    print(f"{name}: {change:+.2%}")
    assert abs(change) < 0.03
