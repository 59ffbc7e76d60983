"""The hopping robot at rest, where its runs start; the last ones are kept.

A fit asks for the same robot many times: at the numbers from which it takes differences, and for
parameters that do not change it, such as the instant of a release or what the cameras make of a
place. Three in ten starts of a diagnosis are of a robot that is kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.fit.observation import Pose
from workbench.fit.systems.hopper_model import coarsen
from workbench.fit.systems.hopper_view import View
from workbench.motion import Mode
from workbench.sim import Condition, Robot, at_rest, hold_top

__all__ = ["Rest", "held", "rest_of"]

Array = NDArray[np.float64]

_KEPT = 64  # some 100 kB each
_HELD_ROUNDS = 3  # each turns T by less, and the point taken for it with it
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


@dataclass(frozen=True, eq=False)
class Rest:
    """A robot at rest; nobody may change it.

    Args:
        model: compiled, for coarse steps where they were asked for.
        state: (s,) mjSTATE_INTEGRATION [SI].
        pose: of that state.
        steps: of the engine from one sample to the next.
    """

    model: mujoco.MjModel
    state: Array
    pose: Pose
    steps: int


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
    model, data = at_rest(robot, Condition(mode, np.zeros(2), start_angle, height=height))
    pose = Pose(*(each.copy() for each in (data.qpos, data.xpos, data.xmat)))
    state, steps = _state(model, data), robot.steps_per_sample
    return Rest(model, state, pose, coarsen(model, data, steps) if coarse else steps)


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
    model, data = rest.model, mujoco.MjData(rest.model)
    mujoco.mj_setState(model, data, rest.state, _STATE)
    mujoco.mj_forward(model, data)
    aim = np.linalg.solve(view.matrix, place)
    for _ in range(_HELD_ROUNDS if view.point.any() else 1):
        point = data.xmat[body].reshape(3, 3) @ offset
        hold_top(model, data, *(aim - point[[0, 2]]))
    return _state(model, data)


def _state(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    state = np.empty(mujoco.mj_stateSize(model, _STATE))
    mujoco.mj_getState(model, data, state, _STATE)
    state.flags.writeable = False
    return state
