"""One bundle: written while a run goes on, read ever after."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from workbench.bundle.finding import find_folder, is_run, no_bundle
from workbench.bundle.inside import foreign
from workbench.bundle.names import CHECKSUMS, GUARDIAN, JOURNAL, MANIFEST, TAKE, WIRE
from workbench.bundle.recovery import recovered_manifest
from workbench.bundle.sealing import seal
from workbench.bundle.writing import replaced, told
from workbench.errors import InputError, RecordError, what_to_do
from workbench.output import OutputState, fold

if TYPE_CHECKING:
    from workbench.timeseries import TimeSeries

__all__ = ["Bundle", "Document", "Series", "Status", "View"]

Status = Literal["failed", "complete", "interrupted", "safety-stop"]
Document = Literal["protocol", "bench", "model", "shape", "sheet", "calibration"]
Series = Literal["supply", "raw", "track", "twin", "state"]
View = Literal["recording", "report"]

_VIEWS: dict[View, str] = {"recording": "compare.rrd", "report": "report.html"}
_SCHEMA = "workbench/bundle-1"


@dataclass
class Bundle:
    """An open bundle.

    Args:
        path: the folder.
        manifest: content of `manifest.json`; change it with `note`.
    """

    path: Path
    manifest: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def create(cls, root: Path, name: str, now: datetime, facts: Mapping[str, Any]) -> Bundle:
        """Make a new folder under `root`; its manifest says `failed` until `finish`.

        Args:
            root: folder of all bundles.
            name: short name of the run, part of the folder's name.
            now: local time, part of the folder's name.
            facts: first content of the manifest.
        """
        stem = f"{now:%Y-%m-%d_%H%M%S}_{name}"
        path = root / stem
        for k in range(2, 1000):
            try:
                path.mkdir(parents=True)
                break
            except FileExistsError:
                path = root / f"{stem}_{k}"
        bundle = cls(path)
        head = {"schema": _SCHEMA, "id": path.name, "status": "failed"}
        bundle.note(head | {"created": now.isoformat(timespec="seconds")} | dict(facts))
        return bundle

    @classmethod
    def open(cls, path: Path) -> Bundle:
        """Open an existing bundle.

        Raises:
            InputError: when the folder is no bundle.
        """
        manifest_file = _own(path / MANIFEST)
        try:
            manifest = json.loads(manifest_file.read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(f"{path}: {no_bundle(path)}") from None
        except OSError as error:
            raise InputError(f"{path / MANIFEST}: cannot be read: {what_to_do(error)}") from None
        except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
            raise InputError(f"{path / MANIFEST}: damaged: {error}") from None
        if not isinstance(manifest, dict) or manifest.get("schema") != _SCHEMA:
            raise InputError(f"{path / MANIFEST}: not a manifest of schema {_SCHEMA}")
        return cls(path, manifest)

    @classmethod
    def recover(cls, path: Path) -> tuple[Bundle, str]:
        """Open a bundle however damaged its manifest is, and say what is wrong with that.

        Returns:
            the bundle, with what can still be read, and a sentence, empty where all can.

        Raises:
            InputError: when the folder is no bundle, neither by its manifest nor by its name.
        """
        try:
            return cls.open(path), ""
        except InputError as error:
            if not is_run(path):
                raise
            lost = str(error).removeprefix(f"{path}: ").removeprefix(f"{path / MANIFEST}: ")
            return cls(path, recovered_manifest(path)), f"{MANIFEST}: {lost}"

    @classmethod
    def find(cls, run: Path, root: Path) -> Bundle:
        """Open the bundle that is meant: by path, name, number or a part of its name.

        Raises:
            InputError: when none fits, or several do.
        """
        return cls.open(find_folder(run, root))

    @classmethod
    def find_all(cls, runs: Iterable[Path], root: Path) -> list[Bundle]:
        """Open bundles by path or name; a folder that is none stands for those in it, by name.

        Raises:
            InputError: when one is neither.
        """
        found: list[Bundle] = []
        for run in runs:
            inside = sorted(run.glob(f"*/{MANIFEST}")) if run.is_dir() else []
            if inside and not (run / MANIFEST).exists():
                found += [cls.open(path.parent) for path in inside]
            else:
                found.append(cls.find(run, root))
        return found

    def note(self, facts: Mapping[str, Any]) -> None:
        """Add facts to the manifest, on disk at once and never half written.

        Raises:
            RecordError: when it cannot be written; `manifest` has the facts all the same.
        """
        self.manifest = self.manifest | dict(facts)
        text = json.dumps(self.manifest, indent=2, ensure_ascii=False, default=str) + "\n"
        with replaced(self.path / MANIFEST) as draft:
            draft.write_text(text, encoding="utf-8")

    def journal(self, event: str, time_s: float, **facts: Any) -> None:
        """Append one event and wait until the disk has it.

        Raises:
            RecordError: when it cannot be written.
        """
        line = {"time_s": round(time_s, 6), "event": event} | facts
        path = self.path / JOURNAL
        with told(path), path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line, ensure_ascii=False, default=str) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def read_journal(self) -> list[dict[str, Any]]:
        """Return the events; a line cut short by a crash, or damaged, is left out."""
        return _events(self.path / JOURNAL)

    def read_guardian(self) -> list[dict[str, Any]]:
        """Return what the supply's guardian did, its last verdict on the output among it."""
        return _events(self.path / GUARDIAN)

    @property
    def output(self) -> OutputState:
        """What is known of the supply's output, by all that was written about it.

        Its guardian tells, and where there was none the journal.
        """
        for path in (self.guardian_log, self.journal_log):
            known = fold(_events(path, damaged=True))
            if known.state != "untouched":
                return known
        return OutputState()

    @property
    def output_off(self) -> str | None:
        """How the run left the output: a verdict of `OutputState`.

        None where no file tells of a supply.
        """
        known = self.output
        if known.state == "untouched" and not self.read_guardian():
            return self.manifest.get("output_off")
        return known.verdict

    @property
    def wire_log(self) -> Path:
        """Where exchanges with devices are kept, for a process that writes them itself."""
        return self.path / WIRE

    @property
    def journal_log(self) -> Path:
        """Where the run keeps its events, one JSON object a line, for whoever follows it."""
        return self.path / JOURNAL

    @property
    def guardian_log(self) -> Path:
        """Where the supply's guardian keeps what it did."""
        return self.path / GUARDIAN

    def wire(self, line: str) -> None:
        """Append one exchange with a device.

        Raises:
            RecordError: when it cannot be written.
        """
        with told(self.wire_log), self.wire_log.open("a", encoding="utf-8") as file:
            file.write(line.rstrip("\n") + "\n")

    def read_wire(self) -> list[dict[str, Any]]:
        """Return the exchanges with the supply, as their log has them."""
        return _events(self.wire_log)

    def write_document(self, kind: Document, text: str) -> None:
        """Keep a YAML file as it was given.

        Raises:
            RecordError: when it cannot be written.
        """
        with replaced(self.document(kind)) as draft:
            draft.write_text(text, encoding="utf-8", newline="")

    def write_resolved(self, kind: Document, content: Mapping[str, Any]) -> None:
        """Keep what a file came to, with every default filled in.

        Raises:
            RecordError: when it cannot be written.
        """
        text = json.dumps(content, indent=2, ensure_ascii=False, default=str) + "\n"
        with replaced(self.resolved(kind)) as draft:
            draft.write_text(text, encoding="utf-8")

    def document(self, kind: Document) -> Path:
        """Return the path of a YAML file kept here.

        Raises:
            InputError: when something else stands there, such as a link.
        """
        return _own(self.path / f"{kind}.yaml")

    def resolved(self, kind: Document) -> Path:
        """Return the path of what a file came to; not every kind is kept so.

        Raises:
            InputError: as `document`.
        """
        return _own(self.path / f"{kind}.json")

    @property
    def take_folder(self) -> Path:
        """Return the folder of the raw export, made when missing."""
        folder = self.path / TAKE
        folder.mkdir(exist_ok=True)
        return folder

    def add_take(self, source: Path) -> Path:
        """Copy an export here, byte for byte, and return its new place.

        Raises:
            RecordError: when it cannot be written.
        """
        target = self.take_folder / source.name
        if source.resolve() != target.resolve():
            with replaced(target) as draft:
                shutil.copyfile(source, draft)
        return target

    def write_take(self, name: str, write: Callable[[Path], None]) -> Path:
        """Let somebody write an export that exists nowhere else, and return its place.

        Raises:
            RecordError: when it cannot be written; then nothing of it stays.
        """
        target = self.take_folder / name
        with replaced(target) as draft:
            write(draft)
        return target

    def has_take(self) -> bool:
        """Tell whether an export was added."""
        return bool(self._takes())

    def _takes(self) -> list[Path]:
        """Return the exports; a draft that was cut off is none."""
        folder = self.path / TAKE
        inside = folder.iterdir() if folder.is_dir() and foreign(folder) is None else ()
        found = (file for file in inside if foreign(file) is None)
        return sorted(file for file in found if not file.name.startswith("."))

    def take(self) -> Path:
        """Return the raw export.

        Raises:
            InputError: when there is none.
        """
        files = self._takes()
        if not files:
            raise InputError(
                f"{self.path}: holds no take (status {self.manifest.get('status')}); leave it out, "
                "or add its export with `workbench ingest TAKE --into RUN`"
            )
        return files[0]

    def write_series(self, kind: Series, series: TimeSeries, made_from: Mapping[str, str]) -> None:
        """Write a time series as Parquet with the hashes of what it was made from.

        Raises:
            RecordError: when it cannot be written; then nothing of it stays.
        """
        from workbench.bundle.series import write_parquet  # a list of runs needs no pyarrow

        write_parquet(self.path / f"{kind}.parquet", series, made_from)

    def read_series(self, kind: Series) -> TimeSeries:
        """Read a time series back.

        Raises:
            InputError: when it is missing or damaged.
        """
        from workbench.bundle.series import read_parquet

        return read_parquet(_own(self.path / f"{kind}.parquet"))

    def has(self, kind: Series) -> bool:
        """Tell whether a time series was written."""
        path = self.path / f"{kind}.parquet"
        return path.exists() and foreign(path) is None

    def view(self, kind: View) -> Path:
        """Return the path of a view."""
        return self.path / _VIEWS[kind]

    def write_view(self, kind: View, write: Callable[[Path], None]) -> None:
        """Let somebody draw a view; the one before stays until it is done.

        Raises:
            RecordError: when it cannot be written; then nothing of it stays.
        """
        path = self.view(kind)
        try:
            with replaced(path) as draft:
                write(draft)
        except RuntimeError as error:  # what rerun makes of a full disk
            raise RecordError(f"{path}: cannot be written ({error}); is the disk full?") from error

    def is_closed(self) -> bool:
        """Tell whether checksums were written; a run that was cut off has none."""
        return (self.path / CHECKSUMS).exists()

    def finish(self, status: Status, **facts: Any) -> None:
        """Write the last status and the checksums; the last thing done to a bundle."""
        self.note({"status": status, **facts})
        trying = self.guardian_log.exists() and self.output.live  # its guardian goes on
        seal(self.path, (GUARDIAN, WIRE) if trying else ())


def _own(path: Path) -> Path:
    """Return the path of a file of a run, or of none; refuse what only stands for one."""
    if (what := foreign(path)) is not None:
        raise InputError(f"{path}: is {what}, and no file of the run")
    return path


def _events(path: Path, *, damaged: bool = False) -> list[dict[str, Any]]:
    """Return the events of a file; a line that is none, cut short or damaged, is left out.

    Args:
        path: of the file.
        damaged: put an event `damaged` in the place of a line that is none, but for a last one
            that was cut short: what it was to tell was not yet done.
    """
    if foreign(path) is not None:
        return [{"event": "damaged", "cause": f"{path.name} is a link"}] if damaged else []
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return []
    events: list[dict[str, Any]] = []
    whole, _, _ = text.rpartition("\n")
    for line in (whole if damaged else text).splitlines():
        try:
            event = json.loads(line)
        except (ValueError, RecursionError):
            event = None
        if isinstance(event, dict):
            events.append(event)
        elif damaged:
            cause = f"a line of {path.name} cannot be read"
            events.append({"event": "damaged", "cause": cause})
    return events
