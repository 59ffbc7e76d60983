"""What may be other than a model says: its own numbers within their tolerance, and candidates.

A candidate is one named cause that may explain a misfit: quantities that extend the model from
zero, or a number of the model that is freed from its tolerance.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from workbench.fit import Parameter, Scope
from workbench.sim import EFFECTS, Effect

__all__ = ["Candidate", "Candidates", "hopper_candidates"]

_FREES = {
    "hinge_stiffness": ("hinge_stiffness",),
    "root_stiffness": ("root_stiffness",),
    "hinge_damping": ("hinge_damping",),
    "root_damping": ("root_damping",),
    "top_mass": ("top_mass",),
    "foot_mass": ("foot_mass",),
    "rotor_unbalance": ("rotor_radius",),
    "ground_stiffness": ("ground_stiffness",),
    "ground_damping": ("ground_damping",),
    "friction_level": ("friction_slide", "friction_stick"),
}
"""Effect -> the model's own numbers that it frees from their tolerance."""
_UNLIKE = ("root_play",)
"""A base without play softens so far to follow it that from there the gap does nothing."""

_ELSEWHERE = ("drive", "numerics")
"""Groups that the observer does not judge: the rotor's angle is an input, and finer steps or
increments are tried by themselves."""
_UNSEEN = ("time_offset",)  # every run finds its own time zero


@dataclass(frozen=True)
class Candidate:
    """One named cause.

    Args:
        name: canonical.
        group: kind of cause.
        quantities: name of each quantity -> its parameter; zero is absent. Empty where the cause
            frees numbers of the model.
        frees: names of those numbers.
        freed: name and unit of the quantity that is reported of them: a share of what is stated, or
            what comes on top of it.
        sentence: what a technician reads, as `sim.effects.effect` has it.
        shows_in: modes of runs.
        confused_with: names of candidates that look alike.
        separated_by: what separates it from those, in words.
        instead_of: names of candidates that it replaces, so that none of them is beside it.
        unlike: whether the base's numbers say nothing of those beside it: it is another machine.
    """

    name: str
    group: str
    quantities: dict[str, Parameter]
    frees: tuple[str, ...] = ()
    freed: tuple[str, str] = ("share", "1")
    sentence: str = ""
    shows_in: tuple[str, ...] = ()
    confused_with: tuple[str, ...] = ()
    separated_by: str = ""
    instead_of: tuple[str, ...] = ()
    unlike: bool = False

    @property
    def absent(self) -> tuple[Parameter, ...]:
        """Return the quantities that are zero at least, and zero as stated."""
        return tuple(p for p in self.quantities.values() if p.low == p.nominal == 0)


class Candidates(dict[str, Candidate]):
    """Candidates by name."""

    @classmethod
    def of(cls, every: Iterable[Candidate]) -> Candidates:
        """Return some candidates by name."""
        return cls((one.name, one) for one in every)

    def frees(self, name: str) -> bool:
        """Return whether a candidate frees numbers of the model, and adds none."""
        return name in self and bool(self[name].frees)

    def parameters(self, names: Iterable[str]) -> list[Parameter]:
        """Return the quantities of some candidates, in their order."""
        return [p for name in names for p in self[name].quantities.values()]

    def numbers(self, names: Collection[str]) -> int:
        """Return how many numbers some candidates release."""
        return sum(len(self[name].quantities) + len(self[name].frees) for name in names)

    def parts(self, name: str) -> tuple[Candidate, ...]:
        """Return the candidates that have a number for each element of one that they share."""
        every = [self[one] for one in self[name].instead_of]
        return tuple(one for one in every if not one.instead_of and not one.frees)

    def shared(self, names: Collection[str]) -> frozenset[str]:
        """Return the candidates that are cases of some others, which have all of their parts."""
        found = {name: {one.name for one in self.parts(name)} for name in self}
        return frozenset(name for name, parts in found.items() if parts and parts <= {*names})


def hopper_candidates(
    modes: Collection[str], base: Collection[Parameter], present: Collection[str] = ()
) -> tuple[Candidate, ...]:
    """Return the candidates that runs of some modes feel.

    Args:
        modes: of the runs.
        base: numbers of the model that are fitted; a candidate that frees others is none.
        present: effects that the model has already.
    """
    own = {one.name for one in base}
    return tuple(
        _candidate(effect)
        for effect in EFFECTS.values()
        if set(modes) & set(effect.excited_by)
        and effect.group not in _ELSEWHERE
        and effect.name not in (*_UNSEEN, *present)
        and set(_FREES.get(effect.name, ())) <= own
    )


def _candidate(effect: Effect) -> Candidate:
    frees = _FREES.get(effect.name, ())
    quantities = {
        q.name: Parameter(f"{effect.name} {q.name}", q.unit, 0.0, q.tolerance, q.low, q.high,
                          scope=Scope.CANDIDATE)
        for q in effect.quantities if not frees
    }  # fmt: skip
    return Candidate(
        effect.name, effect.group, quantities, frees,
        (effect.quantities[0].name, effect.quantities[0].unit), effect.sentence,
        tuple(effect.excited_by), effect.confused_with, effect.separated_by,
        unlike=effect.name in _UNLIKE,
    )  # fmt: skip
