"""What of any mechanism may be a cause: rows of a table, and the candidates made of them.

A candidate is one number: of the MJCF file, of an input or of a channel. Its value and its
sentence are the whole number, as it is written into the file, whatever the file has now. A new
cause is a row here, its name in `protocol/rig.py` and, where `fit` does not know it, a field there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from workbench.diagnose import Candidate, digits
from workbench.fit import FIELDS, SHARED, Acts, Edit, Parameter
from workbench.schemas import RigFile
from workbench.sim import Group

__all__ = ["SECTIONS", "Kind", "RigEffect", "Section", "candidates_of", "rig_effects"]

Section = Literal["joints", "bodies", "actuators", "channels", "inputs", "gravity"]


@dataclass(frozen=True)
class Kind:
    """A cause that every element of a section may have.

    Args:
        field: of `fit.systems.mjcf_fields.FIELDS`.
        group: kind of cause.
        quantity: name of its one number.
        sentence: with `{owner}`; the quantity in double braces, as in `sim.effects.effect`.
        separated_by: what separates it from what it is confused with.
        confused_with: `effect` of the same owner, or `section.effect` of any.
        added: the quantity's name in older files, where it was added to the file's number.
    """

    field: str
    group: Group
    quantity: str
    sentence: str
    separated_by: str
    confused_with: tuple[str, ...] = ()
    added: str = ""


_AMPLITUDES = "releases from three heights: what depends on amplitude changes along a ring-down"
_ON_TOP = "added"  # quantity of a number that is freed
_SCALE = "a known force or mass: a free motion determines ratios only"

SECTIONS: dict[Section, dict[str, Kind]] = {
    "joints": {
        "stiffness": Kind(
            "stiffness", "structure", "stiffness",
            "spring of {owner}: stiffness = {{stiffness}}",
            "weighing, and the frequency of small swings", ("even_stiffness", "cubic_stiffness"),
            "k",
        ),
        "even_stiffness": Kind(
            "even_stiffness", "structure", "even_stiffness",
            "{owner} is stiffer to one side: the second number of stiffness = {{even_stiffness}}",
            "the mean place while it swings moves with the amplitude", ("rest_shift",), "k2",
        ),
        "cubic_stiffness": Kind(
            "cubic_stiffness", "structure", "cubic_stiffness",
            "the spring of {owner} {{cubic_stiffness:stiffens|softens}} as it moves: the third "
            "number of stiffness = {{cubic_stiffness}}",
            _AMPLITUDES, ("stiffness", "quadratic_damping"), "k3",
        ),
        "rest_shift": Kind(
            "springref", "structure", "springref",
            "the spring of {owner} rests elsewhere: springref = {{springref}}",
            "pictures at rest with and without load", ("even_stiffness", "channels.offset"),
            "shift",
        ),
        "damping": Kind(
            "damping", "dissipation", "damping", "{owner}: damping = {{damping}}",
            _AMPLITUDES, ("coulomb_friction", "quadratic_damping"), "d",
        ),
        "quadratic_damping": Kind(
            "quadratic_damping", "dissipation", "quadratic_damping",
            "{owner} is damped with the square of its speed: the second number of damping = "
            "{{quadratic_damping}}",
            _AMPLITUDES, ("damping", "cubic_damping", "coulomb_friction"), "d2",
        ),
        "cubic_damping": Kind(
            "cubic_damping", "dissipation", "cubic_damping",
            "{owner} is damped with the cube of its speed: the third number of damping = "
            "{{cubic_damping}}",
            _AMPLITUDES, ("quadratic_damping",), "d3",
        ),
        "coulomb_friction": Kind(
            "frictionloss", "dissipation", "frictionloss",
            "dry friction of {owner}: frictionloss = {{frictionloss}}",
            "a ring-down to its very end: dry friction stops it, a damper never does",
            ("damping", "quadratic_damping"), "friction",
        ),
        "armature": Kind(
            "armature", "mass", "armature",
            "inertia of what turns with {owner}: armature = {{armature}}",
            _SCALE, ("bodies.mass", "bodies.inertia", "inputs.gain", "actuators.gain"),
        ),
        "compliance": Kind(
            "compliance", "structure", "compliance",
            "the gear of {owner} gives between its motor and what it moves: compliance = "
            "{{compliance}}",
            "a sensor behind the gear, and a blow: it rings by itself",
            ("armature", "damping", "inputs.delay", "inputs.lag"),
        ),
    },
    "bodies": {
        "mass": Kind(
            "mass", "mass", "body_mass", "mass of {owner}: mass = {{body_mass}}", "weighing it",
            ("bodies.mass", "joints.armature", "inputs.gain", "actuators.gain"), "mass",
        ),
        "inertia": Kind(
            "inertia", "mass", "inertia",
            "moments of inertia of {owner}: {{inertia}} of those in the file",
            "weighing it, and its swings about another axis", ("mass", "joints.armature"),
        ),
    },
    "actuators": {
        "gain": Kind(
            "gain", "drive", "gain", "actuator {owner}: gain (kp of a servo) = {{gain}}",
            "a load cell", ("bias", "inputs.gain", "bodies.mass", "joints.armature"),
        ),
        "bias": Kind(
            "bias", "drive", "bias", "actuator {owner} acts without control: bias = {{bias}}",
            "the place at rest without input", ("inputs.offset",),
        ),
    },
    "channels": {
        "offset": Kind(
            "offset", "sensor", "offset",
            "channel {owner} reads {{offset:size}} too {{offset:much|little}}",
            "the reading at a known place", ("gain", "joints.rest_shift"),
        ),
        "gain": Kind(
            "scale", "sensor", "share",
            "channel {owner} reads too {{share:much|little}} by {{share:size}}",
            "a ruler or a protractor", ("offset",),
        ),
        "delay": Kind(
            "delay", "sensor", "delay",
            "channel {owner} shows everything {{delay:size}} {{delay:late|early}}",
            "several frequencies: its phase lag grows with the frequency", ("inputs.delay",),
        ),
    },
    "inputs": {
        "offset": Kind(
            "input_offset", "drive", "offset",
            "input {owner} acts with {{offset:size}} {{offset:more|less}} than recorded",
            "the place at rest without input", ("actuators.bias",),
        ),
        "gain": Kind(
            "input_scale", "drive", "share",
            "input {owner} acts {{share:more strongly|more weakly}} than recorded by "
            "{{share:size}}",
            "a load cell", ("delay", "actuators.gain", "bodies.mass", "joints.armature"),
        ),
        "delay": Kind(
            "input_delay", "drive", "delay",
            "input {owner} acts {{delay:size}} {{delay:later|earlier}} than recorded",
            "a step of the input, seen by all channels", ("lag", "gain", "channels.delay"),
        ),
        "lag": Kind(
            "input_lag", "drive", "lag",
            "input {owner} acts as a first-order lag makes it, time constant {{lag}}",
            "a step of the input: a delay waits, a lag begins at once", ("delay", "gain"),
        ),
    },
    "gravity": {
        f"tilt_{axis}": Kind(
            f"tilt_{axis}", "outside", "tilt",
            f"the vertical lies {{{{tilt}}}} off the model's, about {axis}", "a spirit level",
            ("joints.rest_shift", "channels.offset"),
        )
        for axis in "xy"
    },
}  # fmt: skip
"""Section of a rig file's `effects` -> effect -> what it is."""


@dataclass(frozen=True)
class RigEffect:
    """One effect that a rig file names.

    Args:
        section: of the file.
        owner: joint, body, actuator, channel or input, or those that share it; empty for gravity.
        effect: as the file has it.
        tolerance: how large it may well be [SI].
        kind: what it is.
    """

    section: Section
    owner: str
    effect: str
    tolerance: float
    kind: Kind

    @property
    def name(self) -> str:
        """Return the candidate's name."""
        return f"{self.owner.replace(SHARED, '+') or self.section}_{self.effect}"

    @property
    def sentence(self) -> str:
        """Return what a technician reads, with the quantity in braces."""
        if not self.edit.shared:
            return self.kind.sentence.format(owner=self.owner)
        *some, last = self.edit.owners
        owners, quantity = f"{', '.join(some)} and {last}", self.kind.quantity
        if FIELDS[self.kind.field].acts is not Acts.MODEL:
            return self.kind.sentence.format(owner=f"{owners} (each)")
        return (
            f"{owners} (each): {quantity} is {{{quantity}:size}} {{{quantity}:more|less}} than the "
            "file says"
        )

    @property
    def edit(self) -> Edit:
        """Return the number that it concerns."""
        return Edit(self.kind.field, self.owner)


def rig_effects(content: RigFile) -> Iterator[RigEffect]:
    """Yield the effects of a rig file."""
    for section, kinds in SECTIONS.items():
        given = getattr(content.effects, section)
        owners = {"": given} if section == "gravity" else given
        for owner, effects in owners.items():
            for effect, tolerance in effects.items():
                yield RigEffect(section, owner, effect, tolerance, kinds[effect])


def candidates_of(
    content: RigFile, base: Mapping[Edit, Parameter], more: Mapping[Edit, Parameter]
) -> tuple[Candidate, ...]:
    """Return the candidates of a rig file; what it says was found is none.

    Args:
        content: of the file.
        base: numbers that are refitted within their tolerance; a candidate for one frees it.
        more: parameters of the others.
    """
    found = {one.cause for one in content.found}
    every = [one for one in rig_effects(content) if one.name not in found]
    modes = tuple(dict.fromkeys(run.mode for run in content.runs))
    return tuple(
        Candidate(
            name=one.name,
            group=one.kind.group,
            quantities={} if one.edit in base else {one.kind.quantity: more[one.edit]},
            frees=(base[one.edit].name,) if one.edit in base else (),
            freed=(_ON_TOP, base[one.edit].unit) if one.edit in base else ("share", "1"),
            sentence=_freed(base[one.edit]) if one.edit in base else one.sentence,
            shows_in=modes,
            confused_with=tuple(
                other.name for other in every if other is not one and _alike(one, other)
            ),
            separated_by=one.kind.separated_by,
            instead_of=tuple(other.name for other in every if _part_of(other, one)),
            unlike=FIELDS[one.kind.field].adds,
        )
        for one in every
    )


def _freed(parameter: Parameter) -> str:
    """Return the sentence of a number that was freed: what comes on top of the file's."""
    return (
        f"{parameter.name} is {{{_ON_TOP}:size}} {{{_ON_TOP}:more|less}} than the "
        f"{digits(parameter.nominal)} {parameter.unit} of the file"
    )


def _alike(one: RigEffect, other: RigEffect) -> bool:
    """Return whether an effect is said to be confused with another."""
    same = one.section == other.section and bool({*one.edit.owners} & {*other.edit.owners})
    named = (*one.kind.confused_with, one.effect)  # the same of one and of some together
    return (same and other.effect in named) or f"{other.section}.{other.effect}" in named


def _part_of(one: RigEffect, other: RigEffect) -> bool:
    """Return whether an effect is that of one element, or fewer, of those that share another."""
    alike = (one.section, one.effect) == (other.section, other.effect)
    return alike and {*one.edit.owners} < {*other.edit.owners}
