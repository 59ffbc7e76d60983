"""Dry friction in the hinges of a planar chain, compiled: the engine's friction loss, exactly.

With a the accelerations of the hinges, M a = f without friction and r = a + c v the creep of a
hinge (`LinkColumn`), friction is the force that makes

    1/2 (a - M^-1 f)' M (a - M^-1 f) + sum of s(r)

least, where s is g r^2 / 2 as long as the force g r is within the friction, and goes on straight
from there. That is the engine's convex problem (Todorov, ICRA 2014, 6054). Newton's method solves
it: hinges that hold are springs of the acceleration, those that slide have a constant torque, and
each step is one articulated-body recursion, the springs beside the armatures. Steps are shortened
to the least cost on their way, so that it always ends; mostly the hinges of the step before are
right already.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.sim.chain import LinkColumn
from workbench.sim.chain_acceleration import hinge_gains, root_gains, sum_inertias
from workbench.sim.chain_links import LOSS, TORQUE, WORK, compile_part

__all__ = ["FRICTION_WORK", "begin_to_rub", "rub"]

Array = NDArray[np.float64]

_FRICTION, _GRIP, _CREEP = int(LinkColumn.FRICTION), int(LinkColumn.GRIP), int(LinkColumn.CREEP)

# which way a hinge slides, 0 where it holds; its acceleration and what M a - f is there; the same
# of Newton's step
_WAY, _AT, _LEFT, _STEP, _STEP_LEFT = range(5)
_SCRATCH = 5
FRICTION_WORK = _SCRATCH + WORK
"""How many columns the solver needs for each link."""
_ROUNDS = 400  # nine of ten steps need one, some need 40
_HALVINGS = 50


@compile_part
def begin_to_rub(links: Array, v: Array, friction: Array) -> bool:
    """Write which hinges slide by their speed; return whether there is any friction.

    Args:
        links: (n + 1, 18) of `PlanarChain` [SI].
        v: (n + 3,) rates of the coordinates [m/s, rad/s].
        friction: (n + 1, FRICTION_WORK) written.
    """
    rubs = False
    for k in range(1, links.shape[0]):
        friction[k, _WAY] = _way(links, k, links[k, _CREEP] * v[2 + k])
        rubs = rubs or links[k, _FRICTION] > 0.0
    return rubs


@compile_part
def rub(
    links: Array, gravity: Array, free: bool, v: Array, foot: Array, work: Array, friction: Array
) -> None:
    """Add the torque of friction to that of each hinge.

    Args:
        links: (n + 1, 18) of `PlanarChain` [SI].
        gravity: (2,) [m/s^2].
        free: whether the root moves.
        v: (n + 3,) rates of the coordinates [m/s, rad/s].
        foot: (3,) force forward, up and torque of the ground [N, N m].
        work: (n + 1, WORK) of the links; `TORQUE` is changed [SI].
        friction: (n + 1, FRICTION_WORK) which way hinges slid before, changed.
    """
    count = links.shape[0]
    scratch = friction[:, _SCRATCH:]
    for trial in range(_ROUNDS):
        for k in range(count):
            for i in range(WORK):
                scratch[k, i] = work[k, i]
            scratch[k, LOSS] = 0.0
            if k > 0 and links[k, _FRICTION] > 0.0:
                if friction[k, _WAY] == 0.0:
                    scratch[k, LOSS] = links[k, _GRIP]
                    scratch[k, TORQUE] -= links[k, _GRIP] * links[k, _CREEP] * v[2 + k]
                else:
                    scratch[k, TORQUE] -= friction[k, _WAY] * links[k, _FRICTION]
        _accelerate(links, gravity, free, foot, scratch, friction)
        settled = True
        for k in range(1, count):
            creep = friction[k, _STEP] + links[k, _CREEP] * v[2 + k]
            way = friction[k, _WAY]
            torque = links[k, _GRIP] * creep if way == 0.0 else way * links[k, _FRICTION]
            friction[k, _STEP_LEFT] = -torque
            settled = settled and _way(links, k, creep) == way
        share = 1.0 if settled or trial == 0 else _share(links, v, friction)
        for k in range(1, count):
            if share == 1.0:
                friction[k, _AT], friction[k, _LEFT] = friction[k, _STEP], friction[k, _STEP_LEFT]
            else:
                friction[k, _AT] += share * (friction[k, _STEP] - friction[k, _AT])
                friction[k, _LEFT] += share * (friction[k, _STEP_LEFT] - friction[k, _LEFT])
            friction[k, _WAY] = _way(links, k, friction[k, _AT] + links[k, _CREEP] * v[2 + k])
        if settled:
            break
    for k in range(1, count):
        work[k, TORQUE] -= _torque(links, k, friction[k, _AT] + links[k, _CREEP] * v[2 + k])


@compile_part
def _accelerate(
    links: Array, gravity: Array, free: bool, foot: Array, scratch: Array, friction: Array
) -> None:
    """Write the acceleration of each hinge, `LOSS` of it being added to its inertia."""
    sum_inertias(links, 1.0, scratch)
    turn, forward, up = root_gains(scratch, foot) if free else (0.0, -gravity[0], -gravity[1])
    for k in range(1, links.shape[0]):
        friction[k, _STEP], forward, up = hinge_gains(scratch, k, turn, forward, up)
        turn += friction[k, _STEP]


@compile_part
def _way(links: Array, k: int, creep: float) -> float:
    """Return which way a hinge slides, 0 where it holds."""
    if abs(links[k, _GRIP] * creep) <= links[k, _FRICTION]:
        return 0.0
    return 1.0 if creep > 0.0 else -1.0


@compile_part
def _torque(links: Array, k: int, creep: float) -> float:
    """Return the torque against a hinge's creep."""
    return min(max(links[k, _GRIP] * creep, -links[k, _FRICTION]), links[k, _FRICTION])


@compile_part
def _share(links: Array, v: Array, friction: Array) -> float:
    """Return the share of Newton's step at which the cost is least, at most 1."""
    if _slope(links, v, friction, 1.0) <= 0.0:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if _slope(links, v, friction, middle) > 0.0:
            high = middle
        else:
            low = middle
    return (low + high) / 2


@compile_part
def _slope(links: Array, v: Array, friction: Array, share: float) -> float:
    """Return the derivative of the cost along Newton's step."""
    total = 0.0
    for k in range(1, links.shape[0]):
        change = friction[k, _STEP] - friction[k, _AT]
        at = friction[k, _AT] + share * change
        left = friction[k, _LEFT] + share * (friction[k, _STEP_LEFT] - friction[k, _LEFT])
        total += change * (left + _torque(links, k, at + links[k, _CREEP] * v[2 + k]))
    return total
