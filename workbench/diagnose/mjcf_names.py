"""Whether the names in a rig file are in its model, told at line and column."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import mujoco

from workbench.diagnose.mjcf_numbers import (
    CHANNEL_EFFECTS,
    INPUT_EFFECTS,
    JOINT_EFFECTS,
    field_unit,
)
from workbench.errors import FileFault, FileFaults, did_you_mean
from workbench.protocol import Document, RigFile, RigStart
from workbench.protocol.files import Location

__all__ = ["checked", "index_of"]

Kind = Literal["joint", "body", "site", "actuator"]

_OBJECTS: dict[Kind, mujoco.mjtObj] = {
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR,
}
_EFFECTS = {
    "joints": JOINT_EFFECTS, "bodies": ("mass",), "actuators": (), "channels": CHANNEL_EFFECTS,
    "inputs": INPUT_EFFECTS,
}  # fmt: skip
_ONE_NUMBER = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


def index_of(model: mujoco.MjModel, kind: Kind, name: str) -> int:
    """Return the index of what has this name, -1 when there is nothing."""
    return mujoco.mj_name2id(model, _OBJECTS[kind], name)


def checked(file: Document[RigFile], model: mujoco.MjModel) -> None:
    """Look up every name of a rig file.

    Raises:
        FileFaults: with all that are not there, and the names that are.
    """
    faults = list(_beyond(file)) or list(_faults(file, model))
    if faults:
        raise FileFaults(faults)


def _beyond(file: Document[RigFile]) -> Iterator[FileFault]:
    """Yield what a rig file may state and only `mechanism` knows."""
    content, found = file.content, list[Location]()
    found += [("parameters", k, "actuator") for k, p in enumerate(content.parameters) if p.actuator]
    for section, known in _EFFECTS.items():
        for owner, given in getattr(content.effects, section).items():
            found += [("effects", section, owner, one) for one in given if one not in known]
    found += [("effects", "gravity", tilt) for tilt in content.effects.gravity]
    for k, run in enumerate(content.runs):
        found += [("runs", k, key) for key in ("inputs", "late") if getattr(run, key) is not None]
        found += [("runs", k, "start", j) for j, s in run.start.items() if isinstance(s, RigStart)]
    for place in found:
        words = f"{place[-1]}: `diagnose --rig` does not know it yet; take it out"
        yield file.fault(place, words)


def _faults(file: Document[RigFile], model: mujoco.MjModel) -> Iterator[FileFault]:
    content = file.content
    for kind, name, location in _named(content):
        fault = _fault(model, kind, name)
        if fault is not None:
            yield file.fault(location, fault)
    for k, parameter in enumerate(content.parameters):
        kind: Kind = "body" if parameter.joint is None else "joint"
        owner = index_of(model, kind, parameter.owner)
        if owner < 0:
            continue
        unit = field_unit(model, parameter.field, owner)
        if parameter.unit != unit:
            words = f"unit: {parameter.field} of {parameter.owner} is in {unit!r}, not "
            yield file.fault(("parameters", k, "unit"), f"{words}{parameter.unit!r}")
    followed = {c.joint for c in content.channels.values() if c.quantity == "position"}
    for k, run in enumerate(content.runs):
        for joint, start in run.start.items():
            if isinstance(start, str) and joint not in followed:
                words = (
                    f"start: {joint} begins {start!r}, but no channel measures its position; "
                    "give the place as a number"
                )
                yield file.fault(("runs", k, "start", joint), words)
    for section, known in (("channels", content.channels), ("inputs", content.inputs)):
        for name in getattr(content.effects, section):
            if name not in known:
                words = f"no {section[:-1]} {name!r}{did_you_mean(name, known)}"
                yield file.fault(("effects", section, name), words)


def _named(content: RigFile) -> Iterator[tuple[Kind, str, Location]]:
    """Yield every name of the model that a file uses, and where."""
    for k, parameter in enumerate(content.parameters):
        kind: Kind = "body" if parameter.joint is None else "joint"
        yield kind, parameter.owner, ("parameters", k, kind)
    for name, channel in content.channels.items():
        if channel.joint is not None:
            yield "joint", channel.joint, ("channels", name, "joint")
        if channel.site is not None:
            yield "site", channel.site, ("channels", name, "site")
    for name, given in content.inputs.items():
        yield "actuator", given.actuator, ("inputs", name, "actuator")
    for k, run in enumerate(content.runs):
        for joint in run.start:
            yield "joint", joint, ("runs", k, "start", joint)
    for joint in content.effects.joints:
        yield "joint", joint, ("effects", "joints", joint)
    for body in content.effects.bodies:
        yield "body", body, ("effects", "bodies", body)


def _fault(model: mujoco.MjModel, kind: Kind, name: str) -> str | None:
    """Return what is wrong with a name, or None."""
    index = index_of(model, kind, name)
    if index < 0:
        count = int(getattr(model, {"joint": "njnt", "actuator": "nu"}.get(kind, f"n{kind}")))
        names = [mujoco.mj_id2name(model, _OBJECTS[kind], i) for i in range(count)]
        known = [n for n in names if n]
        there = f"it has {', '.join(known)}" if known else f"none of its {count} has a name"
        return f"the model has no {kind} {name!r}{did_you_mean(name, known)}; {there}"
    if kind == "joint" and int(model.jnt_type[index]) not in _ONE_NUMBER:
        return f"joint {name!r} is neither hinge nor slide; only those have one place"
    return None
