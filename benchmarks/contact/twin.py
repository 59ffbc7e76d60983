"""The twin from any state of its planar robot, and its state as the references take it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.contact.chain import Chain, chain_of, state_of
from benchmarks.contact.events import AIR, BELOW, FAST, SLOW, STICK, TOUCH, Start
from workbench.schemas import load_model, load_shape
from workbench.sim import (
    CORNER_FIELDS,
    SAMPLE_RATE_HZ,
    Condition,
    Robot,
    at_rest,
    make_robot,
    sample_times,
)
from workbench.sim.drive import SERVO_DAMPING, SERVO_STIFFNESS
from workbench.sim.ground import LOCKED, LOOSE, WAIT, corner_records

__all__ = ["DOWN", "State", "begin", "dropped", "hop", "reference", "thesis_chain", "thesis_robot"]

Array = NDArray[np.float64]

DOWN = np.pi / 2
"""Where the rotor starts, straight below T [rad]."""
_FRONT_REAR = [0, 2]  # one corner of each edge


class State(NamedTuple):
    """A state of the twin: qpos, qvel, act and userdata."""

    qpos: Array
    qvel: Array
    act: Array
    user: Array


@cache
def thesis_robot(static_below: float = 0.0) -> Robot:
    """Return the thesis' robot in the plane, with a share of static friction on slow corners."""
    values = load_model("thesis", Path()).content.values()
    robot = make_robot(values, load_shape("thesis-initial", Path()).content)
    effects = {"friction_wait": {"share": static_below}} if static_below else {}
    return replace(robot, planar=True, effects=effects)


def thesis_chain() -> Chain:
    """Return the same robot for the references."""
    return chain_of(thesis_robot(), (SERVO_STIFFNESS, SERVO_DAMPING))


@cache
def _model(angle: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    standing = Condition("hop", np.zeros(2), start_angle=angle)
    return at_rest(thesis_robot(), standing)


def begin(angle: float = DOWN) -> State:
    """Return the robot at rest on the ground, its rotor at an angle."""
    data = _model(angle)[1]
    return State(*(a.copy() for a in (data.qpos, data.qvel, data.act, data.userdata)))


def dropped(height: float, forward: float, pitch: float) -> State:
    """Return the standing robot lifted [m], thrown forward [m/s] and tilted [rad]."""
    state = begin()
    state.qpos[1] += height
    state.qpos[2] += pitch
    state.qvel[0] = forward
    state.user[:] = 0.0
    return state


def hop(
    state: State, omega: float, seconds: float, keep: Sequence[int] = ()
) -> tuple[Array, list[State]]:
    """Step the twin at a constant speed; return the foot at 120 Hz, (n, 3), and some states.

    Args:
        state: to start from.
        omega: [rad/s].
        seconds: how long.
        keep: samples whose state is returned.
    """
    model = _model(DOWN)[0]
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.act[:], data.userdata[:] = state
    data.ctrl[:] = omega
    steps = round(1 / SAMPLE_RATE_HZ / model.opt.timestep)
    foot, kept = [data.qpos[:3].copy()], []
    for k in range(1, len(sample_times(seconds))):
        mujoco.mj_step(model, data, nstep=steps)
        foot.append(data.qpos[:3].copy())
        if k in keep:
            kept.append(State(*(a.copy() for a in (data.qpos, data.qvel, data.act, data.userdata))))
    return np.array(foot), kept


def reference(c: Chain, state: State) -> Start:
    """Return a state of the twin as the references take it."""
    model = _model(DOWN)[0]
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = state.qpos, state.qvel
    q, v = state_of(data)
    corners = corner_records(state.user)[_FRONT_REAR]
    touch, grip, sign = np.zeros(2), np.full(2, float(FAST)), np.ones(2)
    for e, (corner, side) in enumerate(zip(corners, (c.half, -c.half), strict=True)):
        low = -np.sin(q[2]) * side
        vx = v[0] + v[2] * low
        pushes = corner[CORNER_FIELDS.index("force_z_N")] > 0.0
        touch[e] = TOUCH if pushes else (BELOW if q[1] + low < 0.0 else AIR)
        sign[e] = 1.0 if vx >= 0 else -1.0
        if corner[0] in (LOCKED, WAIT):
            grip[e] = STICK
        elif corner[0] == LOOSE:
            grip[e] = SLOW
            anchor = corner[CORNER_FIELDS.index("anchor_m")]
            sign[e] = np.sign(q[0] + np.cos(q[2]) * side - anchor) or sign[e]
        elif abs(vx) < c.friction[2]:
            grip[e] = SLOW
    return Start(q, v, float(state.act[0]), touch, grip, sign)
