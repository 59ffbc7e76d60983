"""The closed loop: run, diagnose, propose, run, until one cause remains or the time is over."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from workbench.diagnose import Diagnosis

__all__ = ["Next", "Round", "investigate"]


class Next(Protocol):
    """What a diagnosis proposes to run."""

    @property
    def minutes(self) -> float:
        """Return how long it takes on the bench [min]."""
        ...


N = TypeVar("N", bound=Next)

Look = Callable[[int], tuple[Diagnosis, N | None]]
"""Diagnose all runs made so far, in the round of a number, and propose what to run next."""


@dataclass(frozen=True, eq=False)
class Round(Generic[N]):
    """One turn of the loop.

    Args:
        number: from 1.
        minutes: of bench time spent so far.
        found: of all runs so far.
        proposed: what was proposed next, run or not.
        ended: why the loop ends here; None while it goes on.
    """

    number: int
    minutes: float
    found: Diagnosis
    proposed: N | None
    ended: str | None

    def as_json(self) -> dict[str, Any]:
        """Return what the command line prints of it."""
        return {"round": self.number, "minutes": self.minutes, "ended": self.ended}


def investigate(
    first: N | None,
    run: Callable[[N], None],
    look: Look[N],
    budget: float,
    number: int = 1,
    spent: float = 0.0,
) -> Iterator[Round[N]]:
    """Run and diagnose in turns, and yield each turn when its diagnosis is there.

    Args:
        first: what to run before the first diagnosis; None where its runs exist already.
        run: makes the runs.
        look: diagnoses all of them, and proposes.
        budget: bench time that may be spent [min].
        number: of the first round.
        spent: bench time that existing runs took [min].
    """
    following = first
    while True:
        if following is not None:
            run(following)
            spent += following.minutes
        found, following = look(number)
        ended = _ended(found, following, budget - spent)
        yield Round(number, spent, found, following, ended)
        if ended is not None:
            return
        number += 1


def _ended(found: Diagnosis, following: Next | None, left: float) -> str | None:
    """Return why there is no further round, None where there is one."""
    if found.kind == "DATA_FAULT":
        return "the data are at fault: mend what the diagnosis names, before more runs are made"
    if found.kind == "NAMED":
        return "one cause remains" if len(found.causes) == 1 else "one pair of causes remains"
    if found.kind == "NONE":
        return "no known cause explains the residual; other runs do not change that"
    if following is None:
        return (
            "nothing remains to be found"
            if found.kind == "CLEAN"
            else "no run that this bench can make distinguishes the causes that remain"
        )
    if following.minutes > left:
        return (
            f"the next runs take about {following.minutes:.0f} min, and {max(left, 0.0):.0f} min "
            "of the budget are left"
        )
    return None
