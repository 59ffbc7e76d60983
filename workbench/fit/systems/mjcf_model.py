"""What a compiled mechanism is asked: its joints, names, channels and linearisation."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import Literal, get_args

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.observation import Observation
from workbench.fit.systems.mjcf_parameters import elements_of
from workbench.fit.systems.mjcf_runs import Channel, Input

__all__ = [
    "KINDS",
    "Kind",
    "is_hinge",
    "linearised",
    "names_of",
    "observation_of",
    "require_hinges_and_slides",
    "units_of",
]

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
    """Return whether a joint turns."""
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
    """Return mass, stiffness and damping about a state, (nv, nv) each [SI].

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


def observation_of(
    model: mujoco.MjModel, channels: Sequence[Channel], number: Callable[[str, str], float]
) -> Observation:
    """Return what channels see.

    Args:
        model: with hinges and slides only.
        channels: whose owners it has.
        number: value of a field, `offset`, `scale` or `delay`, of a channel by its name.
    """
    count, places = len(channels), [c for c in channels if c.of in ("site", "body")]
    points = list(dict.fromkeys((c.of, c.owner) for c in places))
    bodies, offsets = np.zeros(len(points), dtype=np.int64), np.zeros((len(points), 3))
    for p, (of, owner) in enumerate(points):
        if of == "body":
            bodies[p] = model.body(owner).id
        else:
            site = model.site(owner)
            bodies[p], offsets[p] = site.bodyid[0], site.pos
    mix, pick = np.zeros((count, 3 * len(points))), np.zeros((count, model.nq))
    rate, bias, delay = np.zeros((count, model.nv)), np.zeros(count), np.zeros(count)
    for c, channel in enumerate(channels):
        scale = 1 + number("scale", channel.name)
        bias[c], delay[c] = number("offset", channel.name), number("delay", channel.name)
        if channel.of in ("site", "body"):
            p = points.index((channel.of, channel.owner))
            mix[c, 3 * p : 3 * p + 3] = scale * np.array(channel.axis)
            continue
        dof = int(model.joint(channel.owner).dofadr[0])
        (pick if channel.of == "position" else rate)[c, dof] = scale
    return Observation(bodies, offsets, mix, pick, bias, rate, delay)


def units_of(
    model: mujoco.MjModel,
    channels: Sequence[Channel],
    inputs: Sequence[Input],
    kind: str,
    owner: str,
) -> dict[str, str]:
    """Return the units of force `F`, place `L`, inertia `I` and `control` of an element.

    Those that share a number must have the same.

    Args:
        model: that has it.
        channels: of the runs.
        inputs: of the runs.
        kind: of the element: a joint, an actuator, a channel, an input or another.
        owner: its name, or those that share a number.

    Raises:
        InputError: where some turn and others slide.
    """
    first, *others = (_units_of(model, channels, inputs, kind, one) for one in elements_of(owner))
    if any(one != first for one in others):
        raise InputError(f"{owner}: some turn and others slide; what they share has one unit")
    return first


def _units_of(
    model: mujoco.MjModel,
    channels: Sequence[Channel],
    inputs: Sequence[Input],
    kind: str,
    owner: str,
) -> dict[str, str]:
    rate = ""
    if kind == "channel":
        channel = next(one for one in channels if one.name == owner)
        kind = "joint" if channel.of in ("position", "speed") else channel.of
        owner, rate = channel.owner, "/s" if channel.of == "speed" else ""
    control = "control"
    if kind == "input":
        kind, owner = "actuator", next(one.actuator for one in inputs if one.name == owner)
        control = _control(model, model.actuator(owner).id)
    turns = False
    if kind == "actuator":
        turns = is_hinge(model, int(model.actuator(owner).trnid[0]))
    elif kind == "joint":
        turns = is_hinge(model, model.joint(owner).id)
    names = ("N m", f"rad{rate}", "kg m^2") if turns else ("N", f"m{rate}", "kg")
    units = dict(zip("FLI", names, strict=True))
    return {**units, "control": units.get(control, control)}


def _control(model: mujoco.MjModel, actuator: int) -> str:
    """Return what an actuator's control is: a force, a place, or of no unit that is known."""
    gain, bias = model.actuator_gainprm[actuator, 0], model.actuator_biasprm[actuator]
    if model.actuator_gaintype[actuator] != mujoco.mjtGain.mjGAIN_FIXED:
        return "control"
    if model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE:
        return "F" if gain == 1 and model.actuator_gear[actuator, 0] == 1 else "control"
    return "L" if gain and bias[1] == -gain else "control"
