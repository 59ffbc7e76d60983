"""What can be asked of the catalogue, and how a person writes it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, NamedTuple

from workbench.errors import InputError

__all__ = ["SORTS", "NumberRange", "Query", "conditions", "period", "window"]

SORTS = {
    "created": "name",
    "speed": "fastest",
    "real": "distance",
    "twin": "twin_distance",
    "error": "error",
    "title": "title",
    "status": "status",
    "verdict": "verdict",
}
"""What a list can be sorted by -> column of the index."""

_NUMBER = r"\d+(?:\.\d+)?"
_WINDOW = re.compile(rf"({_NUMBER})?\s*(\.\.)?\s*({_NUMBER})?\s*(?:rad/s)?")
_PERIOD = re.compile(r"\d{4}(-\d\d(-\d\d(T\d\d(:\d\d)?)?)?)?")


class NumberRange(NamedTuple):
    """From a lowest to a highest number, both included."""

    low: float
    high: float


@dataclass(frozen=True)
class Query:
    """Which runs are wanted; what is left out does not matter.

    Args:
        words: each must be in the name, title, notes, tags or operator; case does not count.
        speed: asked for [rad/s]; a staircase fits where it runs through the window.
        mode: what the robot was put through.
        status: how the run ended.
        verdict: `good`, `bad` or `none`.
        shape: part of the beam's name.
        model: part of the model's name.
        operator: part of the person's name.
        tags: all of them.
        since: first local time, a beginning of ISO 8601: `2026`, `2026-03`, `2026-03-12`.
        until: last one, whole: `2026-03` ends with March.
        sort: key of `SORTS`; the greatest comes last.
        limit: how many at most, those that come last; None is all.
    """

    words: tuple[str, ...] = ()
    speed: NumberRange | None = None
    mode: str | None = None
    status: str | None = None
    verdict: str | None = None
    shape: str | None = None
    model: str | None = None
    operator: str | None = None
    tags: tuple[str, ...] = ()
    since: str | None = None
    until: str | None = None
    sort: str = "created"
    limit: int | None = None


def window(text: str) -> NumberRange:
    """Return the window that is meant by `17`, `17.0`, `16..18`, `16..` or `..18` [rad/s].

    A single number means all that round to it, so `17` finds a run asked for 16.99 rad/s.

    Raises:
        InputError: when it is none of these.
    """
    found = _WINDOW.fullmatch(text.strip())
    low, dots, high = found.groups() if found else (None, None, None)
    if dots and (low or high):
        return NumberRange(float(low or 0.0), float(high or "inf"))
    if dots or low is None or high is not None:
        raise InputError(f"speed {text!r}: write 17, 16..18, 16.. or ..18, in rad/s")
    half = 0.5 * 10.0 ** -len(low.partition(".")[2])
    return NumberRange(float(low) - half, float(low) + half)


def period(text: str) -> str:
    """Return a date as it was typed.

    Raises:
        InputError: when it is no beginning of a date.
    """
    if not _PERIOD.fullmatch(text):
        raise InputError(f"date {text!r}: write 2026, 2026-03, 2026-03-12 or 2026-03-12T10:15")
    return text


def conditions(query: Query) -> tuple[str, list[Any]]:
    """Return the condition of a query in SQL, and its values."""
    parts: list[tuple[str, list[Any]]] = []
    for column in ("mode", "status", "verdict"):
        if (exact := getattr(query, column)) is not None:
            parts.append((f"{column} = ?", [exact]))
    for column in ("shape", "model", "operator"):
        if (part := getattr(query, column)) is not None:
            parts.append((_like(column), [_pattern(part)]))
    everything = "name || ' ' || title || ' ' || notes || ' ' || tags || ' ' || operator"
    parts += [(_like(everything), [_pattern(word)]) for word in query.words]
    parts += [("instr(tags, ?)", [f" {tag} "]) for tag in query.tags]
    if query.speed is not None:
        parts.append(("slowest <= ? AND fastest >= ?", [query.speed.high, query.speed.low]))
    if query.since is not None:
        parts.append(("created >= ?", [query.since]))
    if query.until is not None:
        parts.append(("substr(created, 1, ?) <= ?", [len(query.until), query.until]))
    if not parts:
        return "1", []
    return " AND ".join(text for text, _ in parts), [one for _, values in parts for one in values]


def _like(text: str) -> str:
    return f"({text}) LIKE ? ESCAPE '\\'"


def _pattern(part: str) -> str:
    return "%" + re.sub(r"([%_\\])", r"\\\1", part) + "%"
