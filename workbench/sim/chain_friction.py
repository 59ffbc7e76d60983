"""Dry friction in the hinges of planar chains, compiled: the engine's friction loss, exactly.

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
from workbench.sim.chain_acceleration import accelerate_hinges, accelerate_root, sum_inertias
from workbench.sim.chain_links import (
    ACCELERATION,
    LANES,
    LOSS,
    ROW,
    RX,
    SOLVER,
    TORQUE,
    V,
    compile_part,
)

__all__ = ["begin_to_rub", "rub"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_FRICTION, _GRIP, _CREEP = (LANES * int(k) for k in (
    LinkColumn.FRICTION, LinkColumn.GRIP, LinkColumn.CREEP,
))  # fmt: skip
# which way a hinge slides, 0 where it holds; its acceleration and what M a - f is there; the same
# of Newton's step
_WAY, _AT, _LEFT, _STEP, _STEP_LEFT = (SOLVER + LANES * k for k in range(5))
_ROUNDS = 400  # nine of ten steps need one, some need 40
_HALVINGS = 50


@compile_part
def begin_to_rub(block: Array, scratch: Array, lanes: int) -> bool:
    """Write which hinges slide by their speed; return whether there is any friction.

    Args:
        block: (n + 1, ROW) with the speeds of the hinges, written [SI].
        scratch: (n + 1, ROW) of `rub`, its links' numbers written.
        lanes: chains of the block.
    """
    rubs = False
    for k in range(1, len(block)):
        for i in range(lanes):
            block[k, _WAY + i] = _way(block, k, i, block[k, _CREEP + i] * block[k, V + i])
            rubs = rubs or block[k, _FRICTION + i] > 0.0
    if rubs:
        _copy(block, scratch, 0, ROW)
    return rubs


@compile_part
def rub(
    block: Array, scratch: Array, gravity: Array, free: bool, ground: Array, broken: Flags,
    lanes: int,
) -> None:  # fmt: skip
    """Add the torque of friction to that of each hinge.

    Args:
        block: (n + 1, ROW) of the links, and which way hinges slid before; that and `TORQUE` are
            changed [SI].
        scratch: (n + 1, ROW) of the same links.
        gravity: (LANES, 2) [m/s^2].
        free: whether the root moves.
        ground: (LANES, 3) force forward, up and torque of the ground [N, N m].
        broken: (LANES,) chains that are left out.
        lanes: chains of the block.
    """
    settled = np.empty(LANES, dtype=np.bool_)
    for i in range(lanes):
        settled[i] = broken[i]
    for trial in range(_ROUNDS):
        _accelerate(block, scratch, gravity, free, ground, lanes)
        left = 0
        for i in range(lanes):
            if not settled[i]:
                settled[i] = _take_step(block, i, trial == 0)
                left += not settled[i]
        if left == 0:
            break
    for k in range(1, len(block)):
        for i in range(lanes):
            creep = block[k, _AT + i] + block[k, _CREEP + i] * block[k, V + i]
            block[k, TORQUE + i] -= _torque(block, k, i, creep)


@compile_part
def _accelerate(
    block: Array, scratch: Array, gravity: Array, free: bool, ground: Array, lanes: int
) -> None:
    """Write the acceleration of each hinge by Newton's step, hinges that hold being springs."""
    whole = np.ones(LANES)
    _copy(block, scratch, RX, LOSS + LANES)
    for k in range(len(block)):
        for i in range(lanes):
            grip, way = block[k, _GRIP + i], block[k, _WAY + i]
            holds = grip * (1 - way * way)
            held = holds * block[k, _CREEP + i] * block[k, V + i]
            scratch[k, LOSS + i] = holds
            scratch[k, TORQUE + i] -= held + way * block[k, _FRICTION + i]
    sum_inertias(scratch, whole, lanes)
    accelerate_root(scratch, gravity, free, ground, lanes)
    accelerate_hinges(scratch, lanes)
    for k in range(1, len(block)):
        for i in range(lanes):
            block[k, _STEP + i] = scratch[k, ACCELERATION + i]


@compile_part
def _copy(block: Array, scratch: Array, begin: int, end: int) -> None:
    """Copy some columns."""
    for k in range(len(block)):
        for i in range(begin, end):
            scratch[k, i] = block[k, i]


@compile_part
def _take_step(block: Array, lane: int, first: bool) -> bool:
    """Take Newton's step of one chain, or the best part of it; return whether it is the last."""
    settled = True
    for k in range(1, len(block)):
        way = block[k, _WAY + lane]
        creep = block[k, _STEP + lane] + block[k, _CREEP + lane] * block[k, V + lane]
        torque = block[k, _GRIP + lane] * creep if way == 0.0 else way * block[k, _FRICTION + lane]
        block[k, _STEP_LEFT + lane] = -torque
        settled = settled and _way(block, k, lane, creep) == way
    share = 1.0 if settled or first else _share(block, lane)
    for k in range(1, len(block)):
        if share == 1.0:
            block[k, _AT + lane], block[k, _LEFT + lane] = (
                block[k, _STEP + lane],
                block[k, _STEP_LEFT + lane],
            )
        else:
            block[k, _AT + lane] += share * (block[k, _STEP + lane] - block[k, _AT + lane])
            block[k, _LEFT + lane] += share * (block[k, _STEP_LEFT + lane] - block[k, _LEFT + lane])
        creep = block[k, _AT + lane] + block[k, _CREEP + lane] * block[k, V + lane]
        block[k, _WAY + lane] = _way(block, k, lane, creep)
    return settled


@compile_part
def _way(block: Array, k: int, lane: int, creep: float) -> float:
    """Return which way a hinge slides, 0 where it holds or has no friction."""
    if abs(block[k, _GRIP + lane] * creep) <= block[k, _FRICTION + lane]:
        return 0.0
    return 1.0 if creep > 0.0 else -1.0


@compile_part
def _torque(block: Array, k: int, lane: int, creep: float) -> float:
    """Return the torque against a hinge's creep."""
    most = block[k, _FRICTION + lane]
    return min(max(block[k, _GRIP + lane] * creep, -most), most)


@compile_part
def _share(block: Array, lane: int) -> float:
    """Return the share of Newton's step at which the cost is least, at most 1."""
    if _slope(block, lane, 1.0) <= 0.0:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if _slope(block, lane, middle) > 0.0:
            high = middle
        else:
            low = middle
    return (low + high) / 2


@compile_part
def _slope(block: Array, lane: int, share: float) -> float:
    """Return the derivative of the cost along Newton's step."""
    total = 0.0
    for k in range(1, len(block)):
        change = block[k, _STEP + lane] - block[k, _AT + lane]
        at = block[k, _AT + lane] + share * change
        left = block[k, _LEFT + lane] + share * (
            block[k, _STEP_LEFT + lane] - block[k, _LEFT + lane]
        )
        creep = at + block[k, _CREEP + lane] * block[k, V + lane]
        total += change * (left + _torque(block, k, lane, creep))
    return total
