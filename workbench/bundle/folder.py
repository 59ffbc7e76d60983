"""One bundle: written while a run goes on, read ever after."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Literal

from workbench.bundle.finding import is_run, no_bundle
from workbench.bundle.inside import foreign, require_file
from workbench.bundle.manifest import SCHEMA, Asked, Compared, Manifest, Status
from workbench.bundle.names import CHECKSUMS, GUARDIAN, MANIFEST, TAKE, VIEWS, WIRE, View
from workbench.bundle.record import Record
from workbench.bundle.recovery import recovered_manifest
from workbench.bundle.sealing import seal
from workbench.bundle.series import SeriesFiles
from workbench.bundle.writing import replaced
from workbench.errors import InputError, RecordError, what_to_do

__all__ = ["Bundle", "Document", "View"]

_MOST_AHEAD_S = 5

Document = Literal["protocol", "bench", "model", "shape", "sheet", "calibration"]


@dataclass(frozen=True)
class Bundle:
    """An open bundle: documents, take and views are its own, the rest is in two parts.

    Args:
        path: the folder.
        record: manifest, journal and the supply's logs.
    """

    path: Path
    record: Record

    @property
    def manifest(self) -> Manifest:
        """What the run was, as far as it is known."""
        return self.record.manifest

    @property
    def asked(self) -> Asked:
        """What was asked for.

        Raises:
            InputError: when the manifest does not say.
        """
        if self.manifest.asked is None:
            raise InputError(f"{self.path / MANIFEST}: does not say what was asked for")
        return self.manifest.asked

    @property
    def compared(self) -> Compared:
        """The run beside its twin.

        Raises:
            InputError: when they were never compared.
        """
        if self.manifest.compared is None:
            raise InputError(f"{self.path}: was never compared with its twin")
        return self.manifest.compared

    @property
    def experiment(self) -> str | None:
        """Id of the experiment that the run belongs to; None where it belongs to none."""
        return None if self.manifest.asked is None else self.manifest.asked.experiment

    @property
    def series(self) -> SeriesFiles:
        """The time series of the run."""
        return SeriesFiles(self.path)

    @classmethod
    def create(cls, root: Path, name: str, now: datetime, asked: Asked | None = None) -> Bundle:
        """Make a new folder under `root`; its manifest says `failed` until `finish`.

        Args:
            root: folder of all bundles.
            name: short name of the run, part of the folder's name.
            now: local time, part of the folder's name.
            asked: what the run shall be.
        """
        stem = _next_name(root, name, now)
        path = root / stem
        for k in range(2, 1000):
            try:
                path.mkdir(parents=True)
                break
            except FileExistsError:
                path = root / f"{stem}_{k}"
        head = Manifest(id=path.name, status="failed", created=now.isoformat(timespec="seconds"))
        bundle = cls(path, Record(path, head))
        bundle.record.note(*(() if asked is None else (asked,)))
        return bundle

    @classmethod
    def open(cls, path: Path | str) -> Bundle:
        """Open an existing bundle.

        Raises:
            InputError: when the folder is no bundle, or its manifest is damaged.
        """
        path = Path(path)
        manifest_file = require_file(path / MANIFEST)
        try:
            facts = json.loads(manifest_file.read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(f"{path}: {no_bundle(path)}") from None
        except OSError as error:
            raise InputError(f"{path / MANIFEST}: cannot be read: {what_to_do(error)}") from None
        except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
            raise InputError(f"{path / MANIFEST}: damaged: {error}") from None
        if not isinstance(facts, dict) or facts.get("schema") != SCHEMA:
            raise InputError(f"{path / MANIFEST}: not a manifest of schema {SCHEMA}")
        try:
            return cls(path, Record(path, Manifest.read(facts)))
        except ValueError as error:
            raise InputError(f"{path / MANIFEST}: damaged: {error}") from None

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
            return cls(path, Record(path, recovered_manifest(path))), f"{MANIFEST}: {lost}"

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
            InputError: when something else is there, such as a link.
        """
        return require_file(self.path / f"{kind}.yaml")

    def resolved(self, kind: Document) -> Path:
        """Return the path of what a file came to; not every kind is kept so.

        Raises:
            InputError: as `document`.
        """
        return require_file(self.path / f"{kind}.json")

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
        """Return whether an export was added."""
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
                f"{self.path}: holds no take (status {self.manifest.status}); leave it out, "
                "or add its export with `workbench ingest TAKE --into RUN`"
            )
        return files[0]

    def view(self, kind: View) -> Path:
        """Return the path of a view."""
        return self.path / VIEWS[kind]

    def write_view(self, kind: View, write: Callable[[Path], None]) -> None:
        """Let somebody draw a view, also of a sealed run; the one before stays until it is done.

        Raises:
            RecordError: when it cannot be written; then nothing of it stays.
        """
        path = self.view(kind)
        try:
            with replaced(path) as draft:
                write(draft)
        except RuntimeError as error:  # what rerun makes of a full disk
            raise RecordError(f"{path}: cannot be written ({error})") from error

    def is_closed(self) -> bool:
        """Return whether checksums were written; a run that was cut off has none."""
        return (self.path / CHECKSUMS).exists()

    def finish(self, status: Status, error: str | None = None) -> None:
        """Write the last status and the checksums; the last thing done to a bundle.

        Args:
            status: how the run ended.
            error: why it is not complete; one of before goes where there is none.
        """
        self.record.end(status, error)
        live = self.record.guardian_log.exists() and self.record.output.live
        seal(self.path, (GUARDIAN, WIRE) if live else ())  # which its guardian still writes


def _next_name(root: Path, name: str, now: datetime) -> str:
    """Return a name that no run of these seconds comes after, for lists are in order of names.

    A simulated run can be over within a second; the name of the next may be ahead by a few.
    """
    seconds = [
        f"{now + timedelta(seconds=ahead):%Y-%m-%d_%H%M%S}_" for ahead in range(_MOST_AHEAD_S)
    ]
    there = [one.name for second in seconds for one in root.glob(f"{second}*")]
    for second in seconds:
        stem = second + name
        if all(one <= stem or one.startswith(f"{stem}_") for one in there):
            return stem
    return seconds[0] + name
