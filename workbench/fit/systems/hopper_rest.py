"""The hopping robot at rest, where its runs start; the last ones are kept.

A fit asks for the same robot many times: in every run, at the numbers from which it takes
differences, and for parameters that do not change it, such as the instant of a release. So a robot
is compiled once for all its runs, whose own share of stiffness only the chain has, and a start is
found in the data of the compiled one.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from functools import lru_cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.fit.observation import Pose
from workbench.fit.systems.hopper_model import coarsen
from workbench.fit.systems.hopper_view import View
from workbench.motion import Mode
from workbench.sim import (
    Condition,
    Foot,
    PlanarChain,
    Robot,
    chain_of,
    come_to_rest,
    compile_model,
    hold_top,
    lift,
    read_chain,
    require_stable,
    require_valid,
    unloaded,
)

__all__ = ["Rest", "held", "rest_of"]

Array = NDArray[np.float64]

_KEPT = 64  # states, some kB each
_COMPILED = 128  # 1 MB each with its data: a Jacobian of all candidates asks for each run by run
_HELD_ROUNDS = 3  # each turns T by less, and the point taken for it with it
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_ALONE = threading.RLock()
"""Locked while the data of a compiled robot is used."""


@dataclass(frozen=True, eq=False)
class _Compiled:
    """A robot compiled for the starts of its runs.

    Args:
        robot: with the angles of the free strip.
        near: (nq,) where it rests with its rotor hanging, not far from where runs start [m, rad].
        model: compiled, for coarse steps where they were asked for.
        data: of the model, for whoever has `_ALONE`.
        static: its planar chain before steps became coarse, None where it has none.
        chain: of the model.
        steps: of the engine from one sample to the next.
    """

    robot: Robot
    near: Array
    model: mujoco.MjModel
    data: mujoco.MjData
    static: PlanarChain | None
    chain: PlanarChain | None
    steps: int


@dataclass(frozen=True, eq=False)
class Rest:
    """A robot at rest; nobody may change it.

    Args:
        compiled: the robot, whose chain has not the run's own share of stiffness.
        static: the chain by which the robot rests, None where the engine steps the model.
        chain: by which it is stepped.
        state: (s,) mjSTATE_INTEGRATION [SI].
        pose: of that state.
    """

    compiled: _Compiled
    static: PlanarChain | None
    chain: PlanarChain | None
    state: Array
    pose: Pose


@lru_cache(_KEPT)
def rest_of(robot: Robot, mode: Mode, start_angle: float, height: float, coarse: bool) -> Rest:
    """Return a robot at rest.

    Args:
        robot: with its effects applied.
        mode: of the run.
        start_angle: of the rotor [rad].
        height: of a fall [m].
        coarse: whether its steps may be coarser than its own.

    Raises:
        InputError: when it cannot be simulated.
    """
    still = Condition(mode, np.zeros(2), start_angle, height=height)
    with _ALONE:
        compiled = _compiled(replace(robot, stiffer=0.0), still.foot, coarse)
        if robot.stiffer and compiled.chain is None:  # its model has to be stiffer
            compiled = _compiled(robot, still.foot, coarse)
        static, chain = (
            one and one.stiffer(robot.stiffer) for one in (compiled.static, compiled.chain)
        )
        model, data = compiled.model, compiled.data
        mujoco.mj_resetData(model, data)
        if mode == "drop":
            hand = rest_of(robot, "clamped", start_angle, 0.0, coarse)
            lift(model, data, _there(hand), height)
        else:
            come_to_rest(
                model, data, compiled.robot, still.foot, start_angle, chain=static,
                near=compiled.near,
            )  # fmt: skip
        pose = Pose(*(each.copy() for each in (data.qpos, data.xpos, data.xmat)))
        return Rest(compiled, static, chain, _state(model, data), pose)


@lru_cache(_COMPILED)
def _compiled(robot: Robot, foot: Foot, coarse: bool) -> _Compiled:
    """Compile a robot and refuse what cannot be simulated."""
    still = Condition("clamped", np.zeros(2))  # the rotor hangs
    require_valid(robot, still)
    free = unloaded(robot)
    model, static = compile_model(free, foot), chain_of(free, foot)
    data, steps = mujoco.MjData(model), robot.steps_per_sample
    come_to_rest(model, data, free, foot, still.start_angle, chain=static)
    require_stable(model, data)
    near = data.qpos.copy()
    if coarse:
        steps = coarsen(model, data, steps)
    return _Compiled(free, near, model, data, static, read_chain(model), steps)


@lru_cache(_KEPT)
def held(
    rest: Rest, view: View, body: int, offset: tuple[float, ...], place: tuple[float, float]
) -> Array:
    """Return the state, (s,) [SI], of a robot held where a point of it is seen at a place.

    Args:
        rest: of the robot, its foot fixed.
        view: of the cameras.
        body: of the point.
        offset: of the point in the body's frame, three numbers [m].
        place: forward and up [m].
    """
    model, aim = rest.compiled.model, np.linalg.solve(view.matrix, place)
    with _ALONE:
        data = _there(rest)
        for _ in range(_HELD_ROUNDS if view.point.any() else 1):
            point = data.xmat[body].reshape(3, 3) @ offset
            x, z = (aim - point[[0, 2]]).tolist()
            hold_top(model, data, x, z, rest.static)
        return _state(model, data)


def _there(rest: Rest) -> mujoco.MjData:
    """Return the data of a compiled robot where it rests."""
    model, data = rest.compiled.model, rest.compiled.data
    mujoco.mj_setState(model, data, rest.state, _STATE)
    mujoco.mj_forward(model, data)
    return data


def _state(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the state of a robot that does not move, (s,) [SI]."""
    data.qacc_warmstart[:] = 0
    state = np.empty(mujoco.mj_stateSize(model, _STATE))
    mujoco.mj_getState(model, data, state, _STATE)
    state.flags.writeable = False
    return state
