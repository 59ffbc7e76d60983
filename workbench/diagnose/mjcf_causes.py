"""The causes that a rig file names, with the units of its joints and channels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import mujoco

from workbench.diagnose.mjcf_names import index_of
from workbench.diagnose.mjcf_numbers import (
    CHANNEL_EFFECTS,
    INPUT_EFFECTS,
    JOINT_EFFECTS,
    MASS,
    cause_of,
    joint_unit,
    read_field,
)
from workbench.diagnose.rig import Cause
from workbench.protocol import RigFile

__all__ = ["causes_of"]


def causes_of(
    content: RigFile, model: mujoco.MjModel, base: set[str], units: Sequence[str]
) -> Iterator[Cause]:
    """Yield the causes of a rig file whose names have been checked.

    Args:
        content: of the rig file.
        model: with the stated numbers.
        base: names of the numbers that are refitted within tolerances.
        units: of the channels, in their order.
    """
    yield from _of_joints(content, model, base)
    for body, given in content.effects.bodies.items():
        for effect, tolerance in given.items():
            stated = read_field(model, "mass", index_of(model, "body", body))
            replaces = tuple({f"{body}_mass"} & base)
            yield cause_of(MASS, body, effect, tolerance, "kg", stated, given, replaces)
    of_channel = dict(zip(content.channels, units, strict=True))
    for channel, given in content.effects.channels.items():
        for effect, tolerance in given.items():
            generic = CHANNEL_EFFECTS[effect]
            unit = of_channel[channel] if effect == "offset" else generic.unit
            yield cause_of(generic, channel, effect, tolerance, unit, present=given)
    for name, given in content.effects.inputs.items():
        for effect, tolerance in given.items():
            generic = INPUT_EFFECTS[effect]
            yield cause_of(generic, name, effect, tolerance, generic.unit, present=given)


def _of_joints(content: RigFile, model: mujoco.MjModel, base: set[str]) -> Iterator[Cause]:
    for joint, given in content.effects.joints.items():
        index = index_of(model, "joint", joint)
        for effect, tolerance in given.items():
            generic = JOINT_EFFECTS[effect]
            stated, replaces = None, ()
            if generic.releases is not None:
                stated = read_field(model, generic.releases, index)
                replaces = tuple({f"{joint}_{generic.releases}"} & base)
            unit = joint_unit(generic.unit, model, index)
            yield cause_of(generic, joint, effect, tolerance, unit, stated, given, replaces)
