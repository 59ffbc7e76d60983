"""What people say of a run afterwards: tags, notes, good or bad. Appended, never rewritten.

Each line is a JSON object with who, when, one remark, and the sha256 of the line without it.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

from workbench.bundle.inside import foreign
from workbench.bundle.names import REMARKS
from workbench.bundle.writing import record_errors
from workbench.errors import RecordError

__all__ = [
    "Kind",
    "Remark",
    "Remarks",
    "Verdict",
    "add_remark",
    "faults_of_remarks",
    "read_remarks",
]

Verdict = Literal["good", "bad", "none"]
Kind = Literal["tag", "untag", "note", "verdict"]

_VERDICTS: dict[str, Verdict] = {"good": "good", "bad": "bad"}
_KEYS = ("at", "who", "kind", "text")
_SUM = "sha256"


@dataclass(frozen=True)
class Remark:
    """One remark.

    Args:
        at: local time as ISO 8601.
        who: the person's name.
        kind: what it is; `untag` takes a tag back.
        text: the tag, the note, or the verdict.
    """

    at: str
    who: str
    kind: Kind
    text: str


@dataclass(frozen=True)
class Remarks:
    """What all remarks of a run come to.

    Args:
        verdict: the last one; `none` where nobody judged, or one took it back.
        tags: in the order in which they came.
        notes: oldest first.
    """

    verdict: Verdict = "none"
    tags: tuple[str, ...] = ()
    notes: tuple[Remark, ...] = ()

    def after(self, one: Remark) -> Remarks:
        """Return what it comes to with one remark more."""
        match one.kind:
            case "tag":
                return Remarks(self.verdict, (*self._without(one.text), one.text), self.notes)
            case "untag":
                return Remarks(self.verdict, self._without(one.text), self.notes)
            case "note":
                return Remarks(self.verdict, self.tags, (*self.notes, one))
            case "verdict":
                return Remarks(_VERDICTS.get(one.text, "none"), self.tags, self.notes)
            case _:  # of a later version of the workbench
                return self

    def _without(self, tag: str) -> tuple[str, ...]:
        return tuple(one for one in self.tags if one != tag)


def add_remark(folder: Path, kind: Kind, text: str, who: str, now: datetime) -> None:
    """Append one remark and wait until the disk has it; several programs may do so at once.

    Args:
        folder: the bundle.
        kind: as in `Remark`.
        text: as in `Remark`.
        who: the person's name.
        now: local time.

    Raises:
        RecordError: when it cannot be written.
    """
    facts = {"at": now.isoformat(timespec="seconds"), "who": who, "kind": kind, "text": text}
    line = _written(facts) + "\n"
    path = folder / REMARKS
    if (what := foreign(path)) is not None:
        raise RecordError(f"{path}: is {what}, and no file of the run; remove it")
    with record_errors(path), path.open("ab") as file:
        # a line that a crash cut short is closed first, so that only that one is lost
        torn = file.tell() > 0 and not _ends_a_line(path)
        file.write((b"\n" if torn else b"") + line.encode())
        file.flush()
        os.fsync(file.fileno())


def read_remarks(folder: Path) -> Remarks:
    """Return what was said of a run; a line that cannot be read or was changed does not count."""
    found = Remarks()
    for line in _lines(folder):
        one = _read(line)
        if one is not None:
            found = found.after(one)
    return found


def faults_of_remarks(folder: Path) -> list[str]:
    """Return what is wrong with the remarks of a bundle, one sentence each."""
    return [
        f"{REMARKS}: line {number} was changed or cut short since it was written"
        for number, line in enumerate(_lines(folder), start=1)
        if line.strip() and _read(line) is None
    ]


def _read(line: str) -> Remark | None:
    """Return the remark of a line, None where it is not byte for byte what was written."""
    try:
        facts = json.loads(line)
    except (json.JSONDecodeError, RecursionError):
        return None
    if not isinstance(facts, dict) or facts.keys() != {*_KEYS, _SUM}:
        return None
    facts.pop(_SUM)
    return Remark(**facts) if line == _written(facts) else None


def _written(facts: Mapping[str, str]) -> str:
    """Return the line of a remark, without its end."""
    text = json.dumps(facts, ensure_ascii=False)
    digest = hashlib.sha256(text.encode()).hexdigest()
    return json.dumps({**facts, _SUM: digest}, ensure_ascii=False)


def _lines(folder: Path) -> list[str]:
    if foreign(folder / REMARKS) is not None:
        return []
    try:
        text = (folder / REMARKS).read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return []
    return text.split("\n")


def _ends_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"
