"""The twin and its ground against closed form: rest, flight, parabola, slope, bounce."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.optimize import root_scalar

from workbench.motion import FOOT
from workbench.sim import (
    Condition,
    Robot,
    Stick,
    compile_model,
    install_force_laws,
    settle,
    simulate,
)
from workbench.sim.ground import add_ground

MASS = 0.2574  # [kg] of the whole robot
G = 9.81
DOWN = np.pi / 2
IMPLICITFAST, RK4 = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, mujoco.mjtIntegrator.mjINT_RK4
State = tuple[mujoco.MjModel, mujoco.MjData]


def changed(robot: Robot, **values: float) -> Robot:
    return replace(robot, values=dict(robot.values) | values)


# --- rest


def test_dropped_it_comes_to_rest_4_51_mm_deep(robot: Robot) -> None:
    calm = changed(robot, hinge_damping=0.5, root_damping=0.5)
    result = simulate(calm, Condition("drop", np.zeros(720), height=0.005))
    assert -result.motion[FOOT[2]][-1] - 0.005 == pytest.approx(4.51e-3, rel=0.01)
    assert result.motion["ground_z_N"][-1] == pytest.approx(MASS * G, rel=0.001)


# --- flight


def thrown(robot: Robot) -> State:
    """The robot in the air, bent as it stands, moving, turning, the rotor free and spinning."""
    model = compile_model(robot, "free")
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data = mujoco.MjData(model)
    data.qpos[:] = settle(robot, "free", DOWN)[1].qpos
    data.qpos[2] = 1.0
    data.qvel[:6] = [0.3, 0.1, 0.5, 0.2, 1.0, 0.4]
    data.joint("rotor").qvel[:] = 17.0
    return model, data


def conserved(state: State) -> tuple[np.ndarray, np.ndarray, float]:
    """Return momentum less gravity's impulse, spin about the centre of mass, energy."""
    model, data = state
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    momentum = MASS * (data.subtree_linvel[0] - model.opt.gravity * data.time)
    return momentum, data.subtree_angmom[0].copy(), float(data.energy.sum())


def losses(robot: Robot, integrator: int, steps: int, seconds: float = 0.2) -> np.ndarray:
    """Return what a flight loses of momentum, spin and energy.

    The first two relative to their start, the third to the kinetic energy at the end, because
    the zero of the potential energy is anywhere.
    """
    free = changed(robot, hinge_damping=0.0, root_damping=0.0)
    model, data = thrown(replace(free, steps_per_sample=steps))
    model.opt.integrator = integrator
    before = conserved((model, data))
    mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))
    after = conserved((model, data))
    assert not data.userdata.any()  # no corner has touched the ground
    scale = (np.linalg.norm(before[0]), np.linalg.norm(before[1]), data.energy[1])
    change = [np.linalg.norm(np.subtract(a, b)) for a, b in zip(after, before, strict=True)]
    return np.array(change) / scale


def test_in_flight_momentum_spin_and_energy_stay(robot: Robot) -> None:
    """The equations of motion at the engine's step, by Runge-Kutta."""
    lost = losses(robot, RK4, 34)
    print(f"Runge-Kutta, 34 steps a sample: momentum, spin, energy {lost}")
    assert lost.max() < 1e-6


def test_what_the_integrator_in_use_loses_goes_with_the_step(robot: Robot) -> None:
    """It is of first order; extrapolated to no step at all, nothing is lost.

    Without the hinges' damping, 34 steps a sample would be unstable: they are 68 and more here.
    """
    lost = np.array([losses(robot, IMPLICITFAST, steps) for steps in (68, 136, 272)])
    print(f"implicitfast, 68, 136, 272 steps a sample:\n{lost}")
    assert lost[:-1] / lost[1:] == pytest.approx(2.0, rel=0.02)
    assert np.abs(2 * lost[2] - lost[1]).max() < 1e-6


def test_the_centre_of_mass_flies_a_parabola(robot: Robot) -> None:
    model, data = thrown(robot)
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    start, speed = data.subtree_com[0].copy(), data.subtree_linvel[0].copy()
    mujoco.mj_step(model, data, nstep=round(0.2 / model.opt.timestep))
    mujoco.mj_forward(model, data)
    path = data.subtree_com[0] - start
    assert path[:2] == pytest.approx(speed[:2] * data.time, rel=0.01)
    assert speed[2] * data.time - path[2] == pytest.approx(G * data.time**2 / 2, rel=0.01)


# --- a block with the robot's mass, foot and ground


def block(values: Mapping[str, float], *, slope: float = 0.0, steps: int = 34) -> State:
    """A block at its static sink on a floor that rises forward."""
    install_force_laws()
    spec = mujoco.MjSpec()
    spec.option.timestep = 1 / (120 * steps)
    spec.option.integrator = IMPLICITFAST
    spec.option.gravity = [-G * np.sin(slope), 0, -G * np.cos(slope)]
    foot = spec.worldbody.add_body(name="foot", mass=MASS, explicitinertial=True)
    foot.inertia = [1e-3, 1e-3, 2e-3]
    foot.add_freejoint()
    add_ground(spec, values, planar=False, stick=Stick())
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] = -MASS * G * np.cos(slope) / (4 * values["ground_stiffness"])
    return model, data


def slid(values: Mapping[str, float], slope: float, seconds: float) -> np.ndarray:
    """Return the block's speed along the floor at every step, (n,) [m/s]."""
    model, data = block(values, slope=slope)
    speed = np.empty(round(seconds / model.opt.timestep))
    for k in range(len(speed)):
        mujoco.mj_step(model, data)
        speed[k] = data.qvel[0]
    return speed


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("share", [0.5, 0.98])
def test_below_the_angle_of_static_friction_a_block_stays(
    robot: Robot, side: int, share: float
) -> None:
    speed = slid(robot.values, side * np.arctan(share * 0.5), 3.0)
    drift = abs(speed[-4080:].mean())
    assert drift < 1e-4  # [m/s]
    assert abs(speed.sum() / 4080) < 1e-5  # [m] in all


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("share", [1.02, 1.2, 2.0])
def test_above_it_a_block_slides_at_the_rate_of_kinetic_friction(
    robot: Robot, side: int, share: float
) -> None:
    slope = np.arctan(share * 0.5)
    speed = -side * slid(robot.values, side * slope, 1.0)
    loose = np.flatnonzero(speed > 0.02)
    assert loose[0] < 3000
    rate = (speed[-1] - speed[loose[0]]) / ((len(speed) - 1 - loose[0]) / 4080)
    assert rate == pytest.approx(G * (np.sin(slope) - 0.4 * np.cos(slope)), rel=0.01)


def test_the_robot_itself_stays_on_a_slope_at_half_its_breakaway(robot: Robot) -> None:
    result = simulate(replace(robot, slope=np.arctan(0.25)), Condition("hop", np.zeros(600)))
    x = result.motion[FOOT[0]]
    assert result.outcome == "completed"
    assert abs(x[-1] - x[0]) / 5.0 < 1e-4


# --- a mass on eq. 3.1


def fallen(values: Mapping[str, float], speed: float, seconds: float, steps: int) -> np.ndarray:
    """Return time, height, vertical speed and force of a block from touching, (n, 4)."""
    model, data = block(values, steps=steps)
    data.qpos[2], data.qvel[2] = 0.0, -speed
    rows = []
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_forward(model, data)
        rows.append([data.time, data.qpos[2], data.qvel[2], data.qfrc_passive[2]])
        mujoco.mj_step(model, data)
    return np.array(rows)


def oscillator(damping: float, speed: float, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return height and force over the floor of eq. 3.1, four corners: z(0) = 0, z'(0) = -speed."""
    k, d = 4 * 140.0, 4 * damping
    rest = -MASS * G / k
    roots = np.roots([MASS, d, k]).astype(complex)
    parts = np.linalg.solve(np.array([[1, 1], roots]), np.array([-rest, -speed], dtype=complex))
    waves = np.exp(np.multiply.outer(times, roots)) * parts
    z, velocity = rest + waves.sum(axis=-1).real, (waves * roots).sum(axis=-1).real
    return z, -k * z - d * velocity


@pytest.mark.parametrize("damping", [0.0, 0.3, 1.0])
def test_a_mass_bounces_as_a_damped_oscillator(robot: Robot, damping: float) -> None:
    values = dict(robot.values) | {"ground_damping": damping}
    times, z, velocity, force = fallen(values, 0.6, 0.15, 34).T

    def left(t: float) -> float:
        return float(oscillator(damping, 0.6, np.array(t))[1])

    leaves = root_scalar(left, bracket=(0.03, 0.1)).root
    end = int(np.flatnonzero((force[1:] <= 0) & (velocity[1:] > 0))[0]) + 1
    exact = oscillator(damping, 0.6, times[:end])[0]
    step = 1e-6
    rebound = np.diff(oscillator(damping, 0.6, leaves + np.array([-step, step]))[0])[0] / (2 * step)
    off = np.array([times[end] / leaves, velocity[end] / rebound, z.min() / exact.min()]) - 1
    print(f"damping {damping}: contact time, rebound, depth off by {off}")
    assert np.abs(off).max() < 0.01


def test_the_thesis_ground_swallows_a_bounce(robot: Robot) -> None:
    """Its damping is 2.5 times the critical: within 5 ms the speed is gone."""
    apart = []
    for steps in (34, 68, 136):
        times, z, _, force = fallen(robot.values, 0.6, 0.3, steps).T
        exact = oscillator(15.0, 0.6, times)[0]
        assert (force[1:] > 0).all()
        assert z.min() == pytest.approx(exact.min(), rel=0.01)
        apart.append(np.abs(z - exact).max() / -exact.min())
    print(f"greatest distance over depth at 34, 68, 136 steps a sample: {apart}")
    assert apart[0] / apart[1] == pytest.approx(2.0, rel=0.02)
    assert apart[2] < 0.01
