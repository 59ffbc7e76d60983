"""What is written of a run while it goes on: its manifest, its journal and the supply's logs."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Literal, NamedTuple

from workbench.bundle.events import Event, Logged, parse_line
from workbench.bundle.inside import foreign
from workbench.bundle.manifest import Manifest, ManifestSection, Status
from workbench.bundle.names import GUARDIAN, JOURNAL, MANIFEST, WIRE
from workbench.bundle.writing import record_errors, replaced
from workbench.output import OutputState, fold

__all__ = ["Record", "WireMessage"]


class WireMessage(NamedTuple):
    """One message between the workbench and its supply."""

    time_s: float
    way: Literal["sent", "received", "discarded"]
    data: bytes


class Record:
    """The growing files of one bundle.

    Args:
        folder: of the bundle.
        manifest: as it is on disk; change it with `note`.
    """

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        self._folder = folder
        self.manifest = manifest

    def note(self, *sections: ManifestSection) -> None:
        """Add facts to the manifest, on disk at once and never half written.

        Raises:
            RecordError: when it cannot be written; `manifest` has the facts all the same.
        """
        self.manifest = self.manifest.noting(*sections)
        self._write()

    def end(self, status: Status, error: str | None) -> None:
        """Write how the run ended.

        Raises:
            RecordError: as `note`.
        """
        self.manifest = self.manifest.ended(status, error)
        self._write()

    def _write(self) -> None:
        text = json.dumps(self.manifest.flat(), indent=2, ensure_ascii=False, default=str) + "\n"
        with replaced(self._folder / MANIFEST) as draft:
            draft.write_text(text, encoding="utf-8")

    def journal(self, event: Event, time_s: float) -> None:
        """Append one event and wait until the disk has it.

        Raises:
            RecordError: when it cannot be written.
        """
        line = {"time_s": round(time_s, 6)} | event.as_json()
        path = self._folder / JOURNAL
        with record_errors(path), path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line, ensure_ascii=False, default=str) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def events(self) -> list[Logged]:
        """Return the journal; a line cut short by a crash, or damaged, is left out."""
        if foreign(self.journal_log) is not None or not self.journal_log.exists():
            return []
        text = self.journal_log.read_text(encoding="utf-8", errors="replace")
        return [one for line in text.splitlines() if (one := parse_line(line)) is not None]

    def guardian(self) -> list[dict[str, Any]]:
        """Return what the supply's guardian did, as `workbench.output` reads it."""
        return _lines(self.guardian_log)

    @property
    def trips(self) -> list[str] | None:
        """Why the supply's guardian switched off, in order; None where no guardian wrote at all."""
        written = self.guardian()
        if not written:
            return None
        return [str(one.get("reason")) for one in written if one.get("event") == "trip"]

    @property
    def output(self) -> OutputState:
        """What is known of the supply's output, by all that was written about it.

        By its guardian's log, and where there is none by the journal.
        """
        for path in (self.guardian_log, self.journal_log):
            known = fold(_lines(path, damaged=True))
            if known.state != "untouched":
                return known
        return OutputState()

    @property
    def output_off(self) -> str | None:
        """How the run left the output: a verdict of `OutputState`.

        None where no file mentions a supply.
        """
        known = self.output
        if known.state == "untouched" and not self.guardian():
            return self.manifest.measured.output_off
        return known.verdict

    def wire(self, line: str) -> None:
        """Append one exchange with a device.

        Raises:
            RecordError: when it cannot be written.
        """
        with record_errors(self.wire_log), self.wire_log.open("a", encoding="utf-8") as file:
            file.write(line.rstrip("\n") + "\n")

    def exchanges(self) -> list[WireMessage]:
        """Return the messages to and from the supply, as their log has them."""
        return [
            WireMessage(float(line["time_s"]), line["way"], bytes.fromhex(line["bytes"]))
            for line in _lines(self.wire_log)
            if {"time_s", "way", "bytes"} <= line.keys()
        ]

    @property
    def wire_log(self) -> Path:
        """Where exchanges with devices are kept, for a process that writes them itself."""
        return self._folder / WIRE

    @property
    def journal_log(self) -> Path:
        """Where the run keeps its events, one JSON object a line, for whoever follows it."""
        return self._folder / JOURNAL

    @property
    def guardian_log(self) -> Path:
        """Where the supply's guardian keeps what it did."""
        return self._folder / GUARDIAN


def _lines(path: Path, *, damaged: bool = False) -> list[dict[str, Any]]:
    """Return the JSON objects of a file; a line that is none, cut short or damaged, is left out.

    Args:
        path: of the file.
        damaged: put an event `damaged` in the place of a line that is none, but for a last one
            that was cut short: what it was to record was not yet done.
    """
    if foreign(path) is not None:
        return [{"event": "damaged", "cause": f"{path.name} is a link"}] if damaged else []
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return []
    whole, _, _ = text.rpartition("\n")
    lost = {"event": "damaged", "cause": f"a line of {path.name} cannot be read"}
    found = map(_object, (whole if damaged else text).splitlines())
    return [lost if one is None else one for one in found if one is not None or damaged]


def _object(line: str) -> dict[str, Any] | None:
    try:
        found = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None
