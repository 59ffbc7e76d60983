"""What the catalogue knows of a run: read from its manifest and its remarks alone."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from workbench.bundle import Bundle, Manifest, judgements, passed, read_remarks

__all__ = ["COLUMNS", "UNFINISHED", "UNREADABLE", "Entry", "describe", "read_entry"]

UNFINISHED, UNREADABLE = "unfinished", "damaged"
"""Status of a run that goes on or was cut off; of one whose manifest cannot be read."""


@dataclass(frozen=True)
class Entry:
    """A run in the catalogue. What is not known of a run is empty, or None for a number.

    Args:
        name: of its folder.
        created: local time as ISO 8601.
        status: of the manifest, or `unfinished`, or `damaged`.
        title: of its protocol or take; of a damaged one what is wrong.
        mode: what the robot was put through.
        model: name of the robot's model.
        shape: name of the beam's shape.
        operator: who was at the bench.
        slowest: lowest speed that was asked for [rad/s].
        fastest: highest speed that was asked for [rad/s].
        distance: that the robot travelled [m].
        twin_distance: that its twin travelled [m].
        error: between the two [mm].
        protocol: name of its file.
        rotor: mean speed of the rotor as measured [rad/s].
        noise: white noise of T along x [mm].
        verdict: `good`, `bad` or `none`.
        passed: `pass` or `FAIL` where the protocol says what it expects.
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
    protocol: str
    rotor: float | None
    noise: float | None
    verdict: str
    passed: str
    tags: str
    notes: str
    facts: str

    def as_json(self, root: Path, number: int) -> dict[str, Any]:
        """Return its object: as `describe`, and what the list shows beside that."""
        listed = {
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
        return {"bundle": str(root / self.name)} | json.loads(self.facts) | listed


COLUMNS = tuple(field.name for field in fields(Entry))


def describe(bundle: Bundle) -> dict[str, Any]:
    """Return a bundle's JSON object: path, status, mode, role, real, twin, errors, warnings."""
    head = {"bundle": str(bundle.path), "status": bundle.manifest.status}
    return head | _described(bundle.manifest)


def read_entry(folder: Path, closed: bool) -> Entry:
    """Return the entry of a bundle; one that is damaged says so.

    Args:
        folder: the bundle.
        closed: whether it has checksums.
    """
    said = read_remarks(folder)
    bundle, lost = Bundle.recover(folder)
    manifest, asked, compared = bundle.manifest, bundle.manifest.asked, bundle.manifest.compared
    status = manifest.status if closed else UNFINISHED
    speeds = () if asked is None else asked.speeds
    return Entry(
        name=folder.name,
        created=manifest.created,
        status=UNREADABLE if lost else status,
        title=lost or ("" if asked is None else asked.title),
        mode="" if asked is None else asked.mode,
        model="" if asked is None else asked.model,
        shape="" if asked is None else asked.shape,
        operator=_operator(manifest),
        slowest=min(speeds, default=None),
        fastest=max(speeds, default=None),
        distance=None if compared is None else compared.real.travel_m,
        twin_distance=None if compared is None else compared.twin.travel_m,
        error=None if compared is None else compared.error_mm,
        protocol=(asked and asked.protocol) or "",
        rotor=_rotor(manifest),
        noise=_noise(manifest),
        verdict=said.verdict,
        passed={True: "pass", False: "FAIL", None: ""}[passed(judgements(manifest))],
        tags="".join(f" {tag} " for tag in said.tags),
        notes="\n".join(" ".join(note.text.split()) for note in said.notes),
        facts=json.dumps(_described(manifest), default=str),
    )


def as_row(entry: Entry) -> tuple[Any, ...]:
    """Return the entry as a row of the index, in the order of `COLUMNS`."""
    return tuple(asdict(entry).values())


def _described(manifest: Manifest) -> dict[str, Any]:
    asked, compared = manifest.asked, manifest.compared
    judged = judgements(manifest)
    verdict = {"expected": [one.as_json() for one in judged], "passed": passed(judged)}
    found = {
        "mode": asked and asked.mode,
        "role": asked and asked.role,
        "real": compared and compared.real.as_json(),
        "twin": compared and compared.twin.as_json(),
        "error_mm": compared and compared.error_mm,
        "error_foot_mm": compared and compared.error_foot_mm,
        "error_top_mm": compared and compared.error_top_mm,
        "warnings": compared and compared.warnings,
    }
    return found | (verdict if judged else {})


def _rotor(manifest: Manifest) -> float | None:
    """Return the mean speed that was measured, else the one of the comparison [rad/s]."""
    signals, compared = manifest.signals, manifest.compared
    if signals is not None and signals.rotor_speed_rad_s is not None:
        return signals.rotor_speed_rad_s.value
    return getattr(compared and compared.real, "speed_rad_s", None)


def _noise(manifest: Manifest) -> float | None:
    found = manifest.signals and manifest.signals.noise_mm.get("top_x_m")
    return found.white if found else None


def _operator(manifest: Manifest) -> str:
    """Return who was typed in where the protocol asks for it, else whose account it was."""
    typed = manifest.measured.answers.get("operator")
    account = manifest.asked and manifest.asked.operator
    return str((typed and typed.value) or account or "")
