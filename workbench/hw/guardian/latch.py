"""The latch: after a trip nothing is driven until a person has looked and left a name."""

from __future__ import annotations

import json
import os
import re
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path

from workbench.errors import InputError

__all__ = ["Latch", "Trip"]


@dataclass(frozen=True)
class Trip:
    """Why a supply is latched.

    Args:
        wall: local time, ISO 8601.
        reason: what happened and whether the output is off.
        told_by: `guardian` or `run`.
    """

    wall: str
    reason: str
    told_by: str


class Latch:
    """One supply's trips and acknowledgements, in a file that only grows.

    It is set when the last line is a trip, or cannot be read: whoever crashed while writing had a
    reason.

    Args:
        path: its file; there is none before the first trip.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @classmethod
    def beside(cls, runs: Path, address: str) -> Latch:
        """Return the latch of a supply, kept beside the folder of all bundles.

        Args:
            runs: folder of all bundles.
            address: the supply's port or address; two bench files may share one supply.
        """
        runs = runs.resolve()
        name = re.sub(r"[^A-Za-z0-9.-]+", "_", address).strip("_")
        return cls(runs.with_name(f"{runs.name}.latch") / f"{name}.jsonl")

    def trip(self, reason: str, told_by: str) -> None:
        """Set it; on disk before this returns.

        Raises:
            OSError: when it cannot be written.
        """
        self._append({"trip": asdict(Trip(_now(), reason, told_by))})

    def standing(self) -> Trip | None:
        """Return the trip that nobody has acknowledged yet."""
        try:
            lines = self.path.read_text(encoding="utf-8").splitlines()
        except FileNotFoundError:
            return None
        try:
            last = json.loads(lines[-1]) if lines else {"acknowledged": {}}
            return Trip(**last["trip"]) if "acknowledged" not in last else None
        except (ValueError, TypeError, KeyError):
            return Trip("", f"{self.path}: its last line cannot be read", "latch")

    def acknowledge(self, name: str) -> Trip:
        """Release it and return the trip that was standing.

        Raises:
            InputError: when the name is empty, or nothing is to be acknowledged.
        """
        if not name.strip():
            raise InputError("an acknowledgement needs the name of a person: --name NAME")
        standing = self.standing()
        if standing is None:
            raise InputError(f"{self.path}: no trip is waiting for an acknowledgement")
        self._append({"acknowledged": {"wall": _now(), "name": name.strip()}})
        return standing

    def _append(self, line: dict[str, dict[str, str]]) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        cut = self.path.exists() and not self.path.read_bytes().endswith(b"\n")
        with self.path.open("a", encoding="utf-8") as file:
            file.write("\n" * cut + json.dumps(line, ensure_ascii=False) + "\n")
            file.flush()
            os.fsync(file.fileno())


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")
