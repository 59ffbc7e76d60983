"""The numbers that can change an answer, all of them; every answer prints them."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["RULES", "Rules"]


@dataclass(frozen=True)
class Rules:
    """Thresholds of a diagnosis.

    Args:
        shortlist: candidates that are fitted in full.
        promising: share of the greatest promised gain that a candidate must promise.
    """

    shortlist: int = 5
    promising: float = 0.1


RULES = Rules()
