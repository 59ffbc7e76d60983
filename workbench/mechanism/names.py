"""Whether what a rig file names is in its model, each fault with line and column."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import mujoco

from workbench.errors import FileFault, FileFaults, InputError, did_you_mean
from workbench.fit import FIELDS, Kind, elements_of, names_of, units_of
from workbench.mechanism.causes import RigEffect, Section, rig_effects
from workbench.schemas import Document, Location, RigFile

__all__ = ["require_names"]

_KINDS: dict[Section, Kind] = {"joints": "joint", "bodies": "body", "actuators": "actuator"}
_COUNTS: dict[Kind, str] = {"joint": "njnt", "body": "nbody", "site": "nsite", "actuator": "nu"}
_OFF = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT) | int(mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS)


def require_names(file: Document[RigFile], model: mujoco.MjModel) -> None:
    """Look up every name of a rig file, and what only the model says of it.

    Raises:
        FileFaults: with all that is not there, and the names that are.
    """
    unknown = list(_unknown(file, model))
    if unknown:
        raise FileFaults(unknown)
    faults = [*_units(file, model), *_starts(file), *_effects(file, model)]
    if faults:
        raise FileFaults(faults)


def _unknown(file: Document[RigFile], model: mujoco.MjModel) -> Iterator[FileFault]:
    """Yield the names that the model, the channels or the inputs do not have."""
    content = file.content
    for kind, name, location in _named(content):
        known = names_of(model, kind)
        if name not in known:
            there = f"it has {', '.join(known)}"
            if not known:
                there = f"none of its {getattr(model, _COUNTS[kind])} has a name"
            hint = did_you_mean(name, known)
            yield file.fault(location, f"the model has no {kind} {name!r}{hint}; {there}")
    for section, known in (("channels", content.channels), ("inputs", content.inputs)):
        for owner in getattr(content.effects, section):
            for name in elements_of(owner):
                if name not in known:
                    words = f"no {section[:-1]} {name!r}{did_you_mean(name, known)}"
                    yield file.fault(("effects", section, owner), words)


def _named(content: RigFile) -> Iterator[tuple[Kind, str, Location]]:
    """Yield every name of the model that a file uses, and where."""
    for k, parameter in enumerate(content.parameters):
        yield parameter.kind, parameter.owner, ("parameters", k, parameter.kind)
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
    for section, kind in _KINDS.items():
        for owner in getattr(content.effects, section):
            for name in elements_of(owner):
                yield kind, name, ("effects", section, owner)


def _units(file: Document[RigFile], model: mujoco.MjModel) -> Iterator[FileFault]:
    """Yield the units that are not those of the model's joints."""
    for k, parameter in enumerate(file.content.parameters):
        unit = FIELDS[parameter.field].unit
        for symbol, name in units_of(model, (), (), parameter.kind, parameter.owner).items():
            unit = unit.replace(symbol, name)
        if parameter.unit != unit:
            words = f"unit: {parameter.field} of {parameter.owner} is in {unit!r}, not "
            yield file.fault(("parameters", k, "unit"), f"{words}{parameter.unit!r}")


def _starts(file: Document[RigFile]) -> Iterator[FileFault]:
    """Yield the starts that no channel shows."""
    channels = file.content.channels.values()
    followed = {one.joint for one in channels if one.quantity == "position"}
    for k, run in enumerate(file.content.runs):
        for joint, start in run.start.items():
            if isinstance(start, str) and joint not in followed:
                words = (
                    f"start: {joint} begins {start!r}, but no channel measures its position; "
                    "give the place as a number, or as {position, tolerance, speed, "
                    "speed_tolerance}"
                )
                yield file.fault(("runs", k, "start", joint), words)


def _effects(file: Document[RigFile], model: mujoco.MjModel) -> Iterator[FileFault]:
    """Yield the effects that the model or the channels do not allow."""
    content, every = file.content, list(rig_effects(file.content))
    often = Counter(one.name for one in every)
    for one in every:
        place: Location = ("effects", one.section, one.owner, one.effect)
        place = ("effects", one.section, one.effect) if one.section == "gravity" else place
        words = _refusal(one, content, model)
        if words is None and often[one.name] > 1:
            words = f"two causes are called {one.name}; rename the channel or the input"
        if words is not None:
            yield file.fault(place, words)


def _refusal(one: RigEffect, content: RigFile, model: mujoco.MjModel) -> str | None:
    if one.kind.field == "frictionloss" and int(model.opt.disableflags) & _OFF:
        return (
            "coulomb_friction: the model's options disable constraints or frictionloss, and "
            "MuJoCo's dry friction is a constraint; enable them in the MJCF file"
        )
    if len(set(one.edit.owners)) < len(one.edit.owners):
        return f"{one.owner}: one of them stands twice"
    if one.effect == "compliance":
        return _no_gear(one, model)
    if one.section in ("joints", "actuators"):
        try:
            units_of(model, (), (), _KINDS[one.section], one.owner)
        except InputError as error:
            return str(error)
    if one.section != "channels":
        return None
    every = [content.channels[owner] for owner in one.edit.owners]
    if one.effect == "offset" and any(one.quantity == "acceleration" for one in every):
        return "offset: an acceleration is compared as the speed that it adds up to; only its gain"
    if one.effect == "delay" and any(channel.quantity != "position" for channel in every):
        return (
            "delay: only a channel of a place can have one; a delay that all channels share "
            "is the opposite of an input's"
        )
    return None


def _no_gear(one: RigEffect, model: mujoco.MjModel) -> str | None:
    """Return why no gear may give at some joints."""
    for owner in one.edit.owners:
        joint = model.joint(owner)
        if not model.dof_armature[int(joint.dofadr[0])] > 0:
            return (
                f"compliance: {owner} has no armature, and a gear that gives has an inertia on its "
                "motor's side; state it in the MJCF file"
            )
        if model.body_jntnum[int(model.jnt_bodyid[joint.id])] > 1:
            return f"compliance: {owner} is not the only joint of its body; give it one of its own"
    return None
