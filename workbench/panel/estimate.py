"""How long an experiment has taken and will take, by its plan; prompts are not counted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["remaining_s"]

Item = Mapping[
    str, Any
]  # of a session file: a run with `number` or a pause with `why`, and its `seconds`


def remaining_s(
    items: Sequence[Item], number: int | None, run_s: float, phase: str, phase_s: float
) -> float:
    """Return the bench time that is left by the plan [s].

    Args:
        items: of the session file, in order.
        number: of the run that was begun last, None before the first.
        run_s: its time so far [s]; infinite when it has ended.
        phase: what is done now, in words.
        phase_s: since when [s].
    """
    numbers = [item.get("number") for item in items]
    at = numbers.index(number) if number is not None and number in numbers else -1
    remaining = [item["seconds"] for item in items[at + 1 :]]
    if at >= 0:
        remaining.append(max(items[at]["seconds"] - run_s, 0.0))
    for item in items[at + 1 : at + 2]:
        if phase == f"{item.get('why')}: {item['seconds']:g} s":
            remaining.append(-min(phase_s, item["seconds"]))
    return sum(remaining)
