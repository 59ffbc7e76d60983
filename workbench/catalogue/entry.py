"""What the catalogue knows of a run: read from its manifest and its remarks alone."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from workbench.bundle import Bundle, read_remarks

__all__ = ["COLUMNS", "UNFINISHED", "UNREADABLE", "Entry", "describe", "read_entry"]

UNFINISHED, UNREADABLE = "unfinished", "damaged"
"""Status of a run that goes on or was cut off; of one whose manifest cannot be read."""

_DESCRIBED = (
    "mode", "role", "real", "twin", "error_mm", "error_foot_mm", "error_top_mm", "warnings",
)  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """A run in the catalogue. What a run does not tell is empty, or None for a number.

    Args:
        name: of its folder.
        created: local time as ISO 8601.
        status: of the manifest, or `unfinished`, or `damaged`.
        title: of its protocol or take; of a damaged one what is wrong.
        mode: what the robot was put through.
        model: name of the robot's model.
        shape: name of the beam's shape.
        operator: who stood at the bench.
        slowest: lowest speed that was asked for [rad/s].
        fastest: highest speed that was asked for [rad/s].
        distance: that the robot travelled [m].
        twin_distance: that its twin travelled [m].
        error: between the two [mm].
        verdict: `good`, `bad` or `none`.
        tags: with a space before and behind each.
        notes: what people wrote, a line each.
        facts: what `--json` prints of the manifest, as JSON.
    """

    name: str
    created: str
    status: str
    title: str
    mode: str
    model: str
    shape: str
    operator: str
    slowest: float | None
    fastest: float | None
    distance: float | None
    twin_distance: float | None
    error: float | None
    verdict: str
    tags: str
    notes: str
    facts: str

    def as_json(self, root: Path, number: int) -> dict[str, Any]:
        """Return its object: as `describe`, and what the list shows beside that."""
        own = {
            "number": number,
            "status": self.status,
            "created": self.created,
            "title": self.title,
            "model": self.model or None,
            "shape": self.shape or None,
            "operator": self.operator or None,
            "speed_rad_s": self.fastest,
            "verdict": self.verdict,
            "tags": self.tags.split(),
            "notes": self.notes.splitlines(),
        }
        return {"bundle": str(root / self.name)} | json.loads(self.facts) | own


COLUMNS = tuple(field.name for field in fields(Entry))


def describe(bundle: Bundle) -> dict[str, Any]:
    """Return a bundle's JSON object: path, status, mode, role, real, twin, errors, warnings."""
    head = {"bundle": str(bundle.path), "status": bundle.manifest.get("status")}
    return head | _described(bundle.manifest)


def read_entry(folder: Path, closed: bool) -> Entry:
    """Return the entry of a bundle; one that is damaged says so.

    Args:
        folder: the bundle.
        closed: whether it has checksums.
    """
    said = read_remarks(folder)
    bundle, lost = Bundle.recover(folder)
    facts = bundle.manifest
    status = _text(facts.get("status")) if closed else UNFINISHED
    speeds = _speeds(facts)
    return Entry(
        name=folder.name,
        created=_text(facts.get("created")),
        status=UNREADABLE if lost else status,
        title=lost or _text(facts.get("title")),
        mode=_text(facts.get("mode")),
        model=_text(facts.get("model")),
        shape=_text(facts.get("shape")),
        operator=_operator(facts),
        slowest=min(speeds, default=None),
        fastest=max(speeds, default=None),
        distance=_number(_inside(facts, "real").get("distance_m")),
        twin_distance=_number(_inside(facts, "twin").get("distance_m")),
        error=_number(facts.get("error_mm")),
        verdict=said.verdict,
        tags="".join(f" {tag} " for tag in said.tags),
        notes="\n".join(" ".join(note.text.split()) for note in said.notes),
        facts=json.dumps(_described(facts), default=str),
    )


def as_row(entry: Entry) -> tuple[Any, ...]:
    """Return the entry as a row of the index, in the order of `COLUMNS`."""
    return tuple(asdict(entry).values())


def _described(facts: Mapping[str, Any]) -> dict[str, Any]:
    return {key: facts.get(key) for key in _DESCRIBED}


def _speeds(facts: Mapping[str, Any]) -> list[float]:
    """Return the speeds that were asked for [rad/s]: one, or those of a staircase."""
    levels = facts.get("levels")
    several = [level[-1] for level in levels if level] if isinstance(levels, list) else []
    found = map(_number, several or [facts.get("speed_rad_s")])
    return [speed for speed in found if speed is not None]


def _operator(facts: Mapping[str, Any]) -> str:
    """Return who was typed in where the protocol asks for it, else whose account it was."""
    return _text(_inside(facts, "answers").get("operator")) or _text(facts.get("operator"))


def _inside(facts: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = facts.get(key)
    return found if isinstance(found, dict) else {}


def _text(value: object) -> str:
    return "" if value is None else str(value)


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, (int, float)) else None
