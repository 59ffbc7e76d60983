"""The bundle: the folder that holds one run. Only this module knows its file names.

    manifest.json     what the run was and how it ended; its status starts as `failed`
    protocol.yaml     as given            protocol.json   as resolved
    bench.yaml, model.yaml, shape.yaml    as used
    calibration.yaml  where the bench names one
    journal.jsonl     one event a line, on disk before the next step is taken
    wire.log          every exchange with the supply
    guardian.jsonl    what the supply's guardian did; it goes on where the run was killed
    take/             the export, byte for byte
    supply.parquet, raw.parquet, track.parquet, twin.parquet
    compare.rrd, report.html              views, made again from the rest at any time
    checksums.txt     sha256 of every file above

Nothing in it is overwritten once the run is finished, but for the views. A run whose take is
missing is not finished: the take can be added later.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from workbench.errors import InputError, RecordError, did_you_mean, what_to_do
from workbench.timeseries import TimeSeries

__all__ = ["Bundle", "Document", "Series", "Status", "View", "sha256", "verify"]

Status = Literal["failed", "complete", "interrupted", "safety-stop"]
Document = Literal["protocol", "bench", "model", "shape", "sheet", "calibration"]
Series = Literal["supply", "raw", "track", "twin"]
View = Literal["recording", "report"]

_VIEWS: dict[View, str] = {"recording": "compare.rrd", "report": "report.html"}
_MANIFEST, _JOURNAL, _WIRE = "manifest.json", "journal.jsonl", "wire.log"
_GUARDIAN = "guardian.jsonl"
_CHECKSUMS, _TAKE = "checksums.txt", "take"
_SCHEMA = "workbench/bundle-1"
_VALID = "valid:"


def sha256(path: Path) -> str:
    """Return the hex digest of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


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
        try:
            manifest = json.loads((path / _MANIFEST).read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(f"{path}: {_no_bundle(path)}") from None
        except OSError as error:
            raise InputError(f"{path / _MANIFEST}: cannot be read: {what_to_do(error)}") from None
        except (json.JSONDecodeError, UnicodeDecodeError) as error:
            raise InputError(f"{path / _MANIFEST}: damaged: {error}") from None
        if not isinstance(manifest, dict) or manifest.get("schema") != _SCHEMA:
            raise InputError(f"{path / _MANIFEST}: not a manifest of schema {_SCHEMA}")
        return cls(path, manifest)

    @classmethod
    def find(cls, run: Path, root: Path) -> Bundle:
        """Open a bundle by its path, or by its name among all bundles.

        Raises:
            InputError: when there is none.
        """
        named = root / run
        if not run.exists() and not named.exists():
            there = sorted(path.parent.name for path in root.glob(f"*/{_MANIFEST}"))
            raise InputError(
                f"{run}: no such bundle, neither a folder nor a name in {root}"
                f"{did_you_mean(run.name, there)}; `workbench runs list --runs {root}` shows those "
                "that are there"
            )
        return cls.open(run if run.exists() else named)

    @classmethod
    def find_all(cls, runs: Iterable[Path], root: Path) -> list[Bundle]:
        """Open bundles by path or name; a folder that is none stands for those in it, by name.

        Raises:
            InputError: when one is neither.
        """
        found: list[Bundle] = []
        for run in runs:
            inside = sorted(run.glob(f"*/{_MANIFEST}")) if run.is_dir() else []
            if inside and not (run / _MANIFEST).exists():
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
        draft = self.path / f".{_MANIFEST}"
        with _told(self.path / _MANIFEST):
            draft.write_text(text, encoding="utf-8")
            os.replace(draft, self.path / _MANIFEST)

    def journal(self, event: str, time_s: float, **facts: Any) -> None:
        """Append one event and wait until the disk has it.

        Raises:
            RecordError: when it cannot be written.
        """
        line = {"time_s": round(time_s, 6), "event": event} | facts
        path = self.path / _JOURNAL
        with _told(path), path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line, ensure_ascii=False, default=str) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def read_journal(self) -> list[dict[str, Any]]:
        """Return the events; a last line cut short by a crash is left out."""
        return _events(self.path / _JOURNAL)

    def read_guardian(self) -> list[dict[str, Any]]:
        """Return what the supply's guardian did, its last verdict on the output among it."""
        return _events(self.path / _GUARDIAN)

    @property
    def output_off(self) -> str | None:
        """How the run left the output: `confirmed`, `unconfirmed`, `supply not opened`.

        The manifest tells; of a run that was killed its guardian does. None where neither knows.
        """
        said = {"off": "confirmed", "terminals": "dead"}
        verdicts = [e[said[e["event"]]] for e in self.read_guardian() if e["event"] in said]
        if "output_off" in self.manifest or not verdicts:
            return self.manifest.get("output_off")
        return "confirmed" if verdicts[-1] else "unconfirmed"

    @property
    def wire_log(self) -> Path:
        """Where exchanges with devices are kept, for a process that writes them itself."""
        return self.path / _WIRE

    @property
    def guardian_log(self) -> Path:
        """Where the supply's guardian keeps what it did."""
        return self.path / _GUARDIAN

    def wire(self, line: str) -> None:
        """Append one exchange with a device."""
        with (self.path / _WIRE).open("a", encoding="utf-8") as file:
            file.write(line.rstrip("\n") + "\n")

    def read_wire(self) -> list[dict[str, Any]]:
        """Return the exchanges with the supply, as their log has them."""
        return _events(self.wire_log)

    def write_document(self, kind: Document, text: str) -> None:
        """Keep a YAML file as it was given."""
        (self.path / f"{kind}.yaml").write_text(text, encoding="utf-8", newline="")

    def write_resolved(self, kind: Document, content: Mapping[str, Any]) -> None:
        """Keep what a file came to, with every default filled in."""
        text = json.dumps(content, indent=2, ensure_ascii=False, default=str) + "\n"
        (self.path / f"{kind}.json").write_text(text, encoding="utf-8")

    def document(self, kind: Document) -> Path:
        """Return the path of a YAML file kept here."""
        return self.path / f"{kind}.yaml"

    @property
    def take_folder(self) -> Path:
        """Return the folder of the raw export, made when missing."""
        folder = self.path / _TAKE
        folder.mkdir(exist_ok=True)
        return folder

    def add_take(self, source: Path) -> Path:
        """Copy an export here, byte for byte, and return its new place."""
        target = self.take_folder / source.name
        if source.resolve() != target.resolve():
            shutil.copyfile(source, target)
        return target

    def has_take(self) -> bool:
        """Tell whether an export was added."""
        folder = self.path / _TAKE
        return folder.is_dir() and any(folder.iterdir())

    def take(self) -> Path:
        """Return the raw export.

        Raises:
            InputError: when there is none.
        """
        files = sorted(self.take_folder.iterdir())
        if not files:
            raise InputError(
                f"{self.path}: holds no take (status {self.manifest.get('status')}); leave it out, "
                "or add its export with `workbench ingest TAKE --into RUN`"
            )
        return files[0]

    def write_series(self, kind: Series, series: TimeSeries, made_from: Mapping[str, str]) -> None:
        """Write a time series as Parquet with the hashes of what it was made from."""
        columns: dict[str, Any] = {"time_s": series.times} | {
            name: series[name] for name in series.names
        }
        for name in series.names:
            if not series.validity(name).all():
                columns[_VALID + name] = series.validity(name)
        table = pa.table(columns).replace_schema_metadata(
            {"made_from": json.dumps(dict(made_from))}
        )
        # measured numbers seldom repeat: a dictionary of them costs time and space
        pq.write_table(table, self.path / f"{kind}.parquet", use_dictionary=False)

    def read_series(self, kind: Series) -> TimeSeries:
        """Read a time series back.

        Raises:
            InputError: when it is missing or damaged.
        """
        path = self.path / f"{kind}.parquet"
        try:
            table = pq.read_table(path)
        except (FileNotFoundError, pa.ArrowInvalid, OSError) as error:
            raise InputError(f"{path}: cannot be read: {error}") from None
        columns = {name: table[name].to_numpy() for name in table.column_names}
        times = columns.pop("time_s")
        masks = {n.removeprefix(_VALID): c for n, c in columns.items() if n.startswith(_VALID)}
        values = {n: c for n, c in columns.items() if not n.startswith(_VALID)}
        valid = [masks.get(name, np.ones(len(times), dtype=bool)) for name in values]
        return TimeSeries(
            times, np.column_stack(list(values.values())), tuple(values), np.column_stack(valid)
        )

    def has(self, kind: Series) -> bool:
        """Tell whether a time series was written."""
        return (self.path / f"{kind}.parquet").exists()

    def view(self, kind: View) -> Path:
        """Return the path of a view."""
        return self.path / _VIEWS[kind]

    def is_closed(self) -> bool:
        """Tell whether checksums were written; a run that was cut off has none."""
        return (self.path / _CHECKSUMS).exists()

    def finish(self, status: Status, **facts: Any) -> None:
        """Write the last status and the checksums; the last thing done to a bundle."""
        self.note({"status": status, **facts})
        lines = [f"{sha256(file)}  {name}" for name, file in self._files()]
        (self.path / _CHECKSUMS).write_text("\n".join(lines) + "\n", encoding="utf-8")

    def _files(self) -> list[tuple[str, Path]]:
        found = [(f.relative_to(self.path).as_posix(), f) for f in self.path.rglob("*")]
        return sorted((name, f) for name, f in found if f.is_file() and name != _CHECKSUMS)


def verify(path: Path) -> list[str]:
    """Return what is wrong with a bundle's files, one sentence each; empty when all is well.

    Raises:
        InputError: when the folder is no bundle.
    """
    bundle = Bundle.open(path)
    listing = path / _CHECKSUMS
    if not listing.exists():
        off = f"; output off: {bundle.output_off}" if bundle.output_off else ""
        status = bundle.manifest["status"]
        return [f"{_CHECKSUMS}: missing; the run was cut off (status {status}){off}"]
    files = dict(bundle._files())
    problems: list[str] = []
    for line in listing.read_text(encoding="utf-8").splitlines():
        digest, _, name = line.partition("  ")
        file = files.pop(name, None)
        if file is None:
            problems.append(f"{name}: missing")
        elif sha256(file) != digest:
            problems.append(f"{name}: changed since the run was finished")
    return problems + [f"{name}: not in {_CHECKSUMS}" for name in files]


def _events(path: Path) -> list[dict[str, Any]]:
    events: list[dict[str, Any]] = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            events.append(json.loads(line))
        except json.JSONDecodeError:
            break
    return events


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Say which file could not be written, and what to do."""
    try:
        yield
    except OSError as error:
        raise RecordError(
            f"{path}: cannot be written ({error.strerror}); free the disk or choose another "
            "folder with --runs"
        ) from error


def _no_bundle(path: Path) -> str:
    """Return what a place is that holds no manifest, and what was perhaps meant."""
    if path.is_file():
        return "a file, not a bundle; name the folder of a run"
    hint = f"; did you mean {path.parent}?" if (path.parent / _MANIFEST).exists() else ""
    return (
        f"not a bundle, it has no {_MANIFEST}{hint}; name the folder of a run, "
        "`workbench runs list` shows them"
    )
