"""Runs that should be made next, what they cost and what they are expected to show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

__all__ = [
    "FURTHEST",
    "LEAST_CHANCE",
    "TIMES",
    "Proposal",
    "ProposedRun",
    "Separation",
    "minutes_of",
]

HANDLING_S = {"clamped": 60.0, "decay": 90.0, "hop": 90.0, "drop": 90.0}
"""Mode -> time that a run costs besides itself: export, weight or start line, until all is still.
Assumed, not measured; a mode that is not named takes the first."""
SET_UP_S = {"clamped": 180.0, "decay": 180.0}
"""Mode -> time to clamp the foot, once for all runs of a protocol."""

TIMES = 2
"""How often a proposed run is to be made: what one run alone shows is not named."""

LEAST_CHANCE = 0.1
"""Of rejecting an alternative: a proposal below it is none."""
FURTHEST = 100.0
"""Sigmas: farther than that no linearisation predicts how far."""


@dataclass(frozen=True)
class ProposedRun:
    """A run that nobody has made yet.

    Args:
        mode: what would be done.
        amount: how much of it: a speed [rad/s], a pull [N] or a height [m], by the mode.
        duration: how long the system would move [s].
        rest: still time before [s].
    """

    mode: str
    amount: float
    duration: float
    rest: float


@dataclass(frozen=True)
class Separation:
    """What a proposal is expected to show if one hypothesis is true.

    Args:
        truth: what is taken as true.
        alternative: what is refitted to it.
        distance: that remains between the two predictions, in sigma of all samples; 100
            means that or more, for a linearisation predicts no farther.
        chance: that the next diagnosis rejects the alternative.
    """

    truth: str
    alternative: str
    distance: float
    chance: float


@dataclass(frozen=True)
class Proposal:
    """Runs that should be made next.

    Args:
        trials: the runs; each is to be made `TIMES` times.
        minutes: that all of it takes on a bench.
        separations: of each pair that they could separate, the hardest first.
        chance: that they reject an alternative of what is true.
    """

    trials: tuple[ProposedRun, ...]
    minutes: float
    separations: tuple[Separation, ...]
    chance: float

    def as_json(self) -> dict[str, Any]:
        """Return runs, minutes and what is expected of them."""
        return {
            "runs": [{"mode": one.mode, "amount": one.amount} for one in self.trials],
            "minutes": self.minutes,
            "chance": round(self.chance, 4),
            "separations": [
                {"truth": one.truth, "rival": one.alternative, "distance": round(one.distance, 3),
                 "chance": round(one.chance, 4)}
                for one in self.separations
            ],
        }  # fmt: skip


def minutes_of(trials: Sequence[ProposedRun]) -> float:
    """Return how long runs take on a bench, with the handling that each needs [min]."""
    usual = next(iter(HANDLING_S.values()))
    runs = sum(one.rest + one.duration + HANDLING_S.get(one.mode, usual) for one in trials)
    set_up = max((SET_UP_S.get(one.mode, 0.0) for one in trials), default=0.0)
    return (runs + set_up) / 60
