"""What a compiled mechanism is asked: its joints, its names, its linearisation."""

from __future__ import annotations

import copy
from typing import Literal, get_args

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError

__all__ = ["KINDS", "Kind", "is_hinge", "linearised", "names_of", "require_hinges_and_slides"]

Array = NDArray[np.float64]
Kind = Literal["joint", "body", "site", "actuator"]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""Of elements that are named."""

_OBJECTS = {
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR,
}
_STEP = 1e-6  # of a difference [rad], [m], and per second


def names_of(model: mujoco.MjModel, kind: Kind) -> list[str]:
    """Return the names of the elements of a kind; those without one are left out."""
    counts = {"joint": model.njnt, "body": model.nbody, "site": model.nsite, "actuator": model.nu}
    found = [mujoco.mj_id2name(model, _OBJECTS[kind], i) for i in range(counts[kind])]
    return [name for name in found if name]


def is_hinge(model: mujoco.MjModel, joint: int) -> bool:
    """Tell whether a joint turns."""
    return bool(model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE)


def require_hinges_and_slides(model: mujoco.MjModel) -> None:
    """Refuse a model with joints of more than one number.

    Raises:
        InputError: with the joint and the body that it moves.
    """
    slide = mujoco.mjtJoint.mjJNT_SLIDE
    for joint in range(model.njnt):
        if is_hinge(model, joint) or model.jnt_type[joint] == slide:
            continue
        kind = "free" if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE else "ball"
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"number {joint}"
        body = model.body(int(model.jnt_bodyid[joint])).name
        raise InputError(
            f"joint {name!r} of body {body!r} is a {kind} joint; the observer knows hinges and "
            "slides only: write three slides and three hinges instead, if it turns little"
        )
    if not model.nv:
        raise InputError("the model has no joint: nothing in it can move")


def linearised(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array, Array]:
    """Return mass, stiffness and damping about a state, (nv, nv) each.

    Central differences of qacc: M q'' + D q' + K q = 0 for small changes q. Dry friction, contacts
    and limits are left out; they have no derivative.

    Args:
        model: with hinges and slides only.
        data: at the state; not changed.
    """
    model = copy.copy(model)
    model.dof_frictionloss[:] = 0.0
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    at = mujoco.MjData(model)
    at.act[:], at.ctrl[:] = data.act, data.ctrl
    at.qpos[:], at.qvel[:] = data.qpos, data.qvel
    derivatives = []
    for moved in (at.qpos, at.qvel):
        columns = []
        for d in range(model.nv):
            here, ends = float(moved[d]), []
            for side in (1, -1):
                moved[d] = here + side * _STEP
                mujoco.mj_forward(model, at)
                ends.append(at.qacc.copy())
            moved[d] = here
            columns.append((ends[0] - ends[1]) / (2 * _STEP))
        derivatives.append(np.column_stack(columns))
    mujoco.mj_forward(model, at)
    mass = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, at, mass)
    return mass, -mass @ derivatives[0], -mass @ derivatives[1]
