"""Small systems and measures that the tests of the effects share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.sim import (
    Condition,
    Robot,
    Stick,
    applied,
    install_force_laws,
    settle,
    simulate,
    unloaded,
)
from workbench.sim.beam_laws import Law, add_law
from workbench.sim.ground import add_ground

MASS = 0.2574  # [kg] of the thesis' robot
G = 9.81
DOWN = np.pi / 2
State = tuple[mujoco.MjModel, mujoco.MjData]


def with_effect(robot: Robot, name: str, **quantities: float) -> Robot:
    return replace(robot, effects={**robot.effects, name: quantities})


def resting(robot: Robot, pull: float = 0.0, angle: float = DOWN) -> State:
    """Return the clamped robot at rest, its effects in."""
    return settle(unloaded(applied(robot)), "fixed", angle, (pull, 0.0))


def moments(state: State, pull: float = 0.0) -> NDArray[np.float64]:
    """Return what hinges 0 to 15 carry: weights and a pull on T times their levers, (16,) [N m]."""
    model, data = state
    first = model.body("increment_0").id
    top = data.body("top").xpos
    carried = np.empty(model.nv - 1)
    for k in range(model.nv - 1):
        place = data.xanchor[k]
        beyond = slice(first + k, model.nbody)
        levers = data.xipos[beyond, 0] - place[0]
        carried[k] = G * (model.body_mass[beyond] * levers).sum() + pull * (top[2] - place[2])
    return carried


def bends(state: State, robot: Robot) -> NDArray[np.float64]:
    """Return how far each hinge is from the angle that the robot lists, (16,) [rad]."""
    return state[1].qpos[: len(robot.angles)] - np.array(robot.angles)


def ringing(robot: Robot, pull: float, seconds: float = 1.5) -> float:
    """Return the logarithm of the energy that a released robot loses, over that at first."""
    condition = Condition("decay", np.zeros(round(120 * seconds)), pull=pull, energy=True)
    motions = [simulate(robot, replace(condition, pull=p)).motion for p in (pull, 0.0)]
    rung, rest = (m["potential_energy_J"] + m["kinetic_energy_J"] for m in motions)
    return float(np.log((rung[0] - rest[0]) / (rung[-1] - rest[0])))


def block(values: Mapping[str, float], slope: float = 0.0, step: float = 1 / 4080) -> mujoco.MjSpec:
    """Return a block with the robot's mass on its foot and ground; floor rising forward."""
    install_force_laws()
    spec = mujoco.MjSpec()
    spec.option.timestep = step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = [-G * np.sin(slope), 0, -G * np.cos(slope)]
    foot = spec.worldbody.add_body(name="foot", mass=MASS, explicitinertial=True)
    foot.inertia = [1e-3, 1e-3, 2e-3]
    foot.add_freejoint()
    add_ground(spec, values, planar=False, stick=Stick())
    return spec


PENDULUM_STIFFNESS, PENDULUM_ARM, PENDULUM_MASS = 2.0, 0.3, 0.1
PENDULUM_RATE = np.sqrt(PENDULUM_STIFFNESS / PENDULUM_MASS) / PENDULUM_ARM


def pendulum(law: dict[Law, float], amplitude: float, seconds: float) -> NDArray[np.float64]:
    """Return a point mass on the foot joint, without gravity, let go at an angle: (n,) [rad].

    Steps of 0.1 ms, fourth order.
    """
    install_force_laws()
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.timestep, spec.option.gravity = 1e-4, [0, 0, 0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    foot = spec.worldbody.add_body(name="foot")
    arm = [0.0, 0.0, PENDULUM_ARM]
    top = foot.add_body(name="top", pos=arm, mass=PENDULUM_MASS, explicitinertial=True)
    top.inertia, top.ipos = [1e-9] * 3, [0, 0, 0]
    spring = [PENDULUM_STIFFNESS, 0, 0]
    top.add_joint(name="hinge_0", axis=[0, 1, 0], pos=[0, 0, -PENDULUM_ARM], stiffness=spring)
    rotor = top.add_body(name="rotor", mass=1e-9, explicitinertial=True)
    rotor.inertia, rotor.ipos = [1e-9] * 3, [0, 0, 0]
    rotor.add_joint(name="rotor", axis=[0, 1, 0])
    add_law(spec, law)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[0] = amplitude
    angles = np.empty(round(seconds / 1e-4))
    for k in range(len(angles)):
        angles[k] = data.qpos[0]
        mujoco.mj_step(model, data)
    return angles
