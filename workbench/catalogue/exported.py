"""Runs for a colleague: one folder or zip that explains itself.

    README.txt      what is here, what each column is, what is damaged
    runs.csv        a line a run
    bundles/RUN/    the bundle as it is, with its checksums, report and recording
    csv/RUN/        its traces as CSV, where asked for
    mat/RUN.mat     the same for MATLAB and Octave, where asked for
    checksums.txt   sha256 of all of it

The same runs give the same bytes: nothing here depends on when or where it was made.
"""

from __future__ import annotations

import hashlib
import io
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from csv import writer
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from workbench.bundle import Bundle, Manifest, contents, foreign, read_remarks, unportable, verify
from workbench.catalogue.entry import Entry, read_entry
from workbench.catalogue.traces import TRACES, as_csv, column_lines, read_traces
from workbench.errors import InputError, RecordError
from workbench.timeseries import TimeSeries

__all__ = ["Exported", "export"]

_ZIP = ".zip"
_OLDEST = (1980, 1, 1, 0, 0, 0)  # the time of every file in a zip: the first that the format knows
_READABLE = 0o644 << 16

Content = Path | bytes
Keep = Callable[[str, Content], None]


@dataclass(frozen=True)
class Exported:
    """What was exported.

    Args:
        target: the folder or zip.
        files: how many.
        size: of all files before they were packed [byte].
        problems: what is wrong with the bundles, a sentence each, with the run's name.
        omitted: what lies in a bundle and not in the export, as `RUN/name`.
    """

    target: Path
    files: int
    size: int
    problems: tuple[str, ...]
    omitted: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Run:
    """A run to be exported, with what can still be read of it."""

    folder: Path
    files: list[tuple[str, Path]]
    omitted: list[str]
    entry: Entry
    manifest: Manifest
    traces: dict[str, TimeSeries]
    problems: list[str]


def export(folders: Sequence[Path], target: Path, csv: bool, mat: bool) -> Exported:
    """Write runs into a new folder, or a new file where the target ends in `.zip`.

    A damaged run is exported with what there is; the README says what is wrong with it. What is no
    plain file of the run, such as a link, is left out, and so is a name that would be another place
    on some system.

    Args:
        folders: the bundles; no two of one name.
        target: the folder or zip; it must not exist.
        csv: whether the traces are wanted as CSV.
        mat: whether they are wanted as MAT-files.

    Raises:
        InputError: when the target exists, or two bundles have one name; nothing is written.
        RecordError: when it cannot be written; then nothing of it stays.
    """
    folders = [folder if folder.name not in ("", "..") else folder.resolve() for folder in folders]
    for folder in folders:
        if foreign(folder) is not None:
            raise InputError(f"{folder}: is a link; name the folder that it leads to")
    names = [folder.name for folder in folders]
    for name in names:
        if (why := unportable(name)) is not None:
            raise InputError(f"{name}: cannot be exported: {why}; rename the folder of the run")
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise InputError(f"two runs are called {min(twice)}; export them apart")
    if target.exists():
        raise InputError(f"{target}: is there already; an export overwrites nothing")
    runs = [_read(folder) for folder in sorted(folders, key=lambda folder: folder.name)]
    problems = tuple(f"{run.folder.name}: {text}" for run in runs for text in run.problems)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.name}-") as scratch:
            draft = Path(scratch) / target.name
            fill = _fill_zip if target.suffix.lower() == _ZIP else _fill_folder
            sizes = fill(draft, _contents(runs, csv, mat))
            draft.rename(target)
    except OSError as error:
        raise RecordError(f"{target}: cannot be written ({error.strerror or error})") from error
    omitted = tuple(f"{run.folder.name}/{name}" for run in runs for name in run.omitted)
    return Exported(target, len(sizes), sum(sizes), problems, omitted)


def _read(folder: Path) -> _Run:
    problems = verify(folder)
    entry = read_entry(folder, closed=True)
    bundle, _ = Bundle.recover(folder)
    traces, lost = read_traces(bundle)
    inside = contents(folder)
    barred = {name: why for name, _ in inside.files if (why := unportable(name)) is not None}
    notes = [f"{name}: left out: {why}; rename it" for name, why in barred.items()]
    return _Run(
        folder,
        [(name, file) for name, file in inside.files if name not in barred],
        [*inside.others, *barred],
        entry,
        bundle.manifest,
        traces,
        problems + lost + notes,
    )


def _contents(runs: Sequence[_Run], csv: bool, mat: bool) -> Iterator[tuple[str, Content]]:
    """Yield the name and content of each file; made one by one, for they may be large."""
    yield "README.txt", _readme(runs, csv, mat).encode()
    yield "runs.csv", _overview(runs)
    for run in runs:
        for name, file in run.files:
            yield f"bundles/{run.folder.name}/{name}", file
        if csv:
            for name, series in run.traces.items():
                yield f"csv/{run.folder.name}/{name}.csv", as_csv(series)
        if mat:
            yield f"mat/{run.folder.name}.mat", _mat(run)


def _mat(run: _Run) -> bytes:
    from workbench.catalogue.matlab import as_mat  # scipy, for those who ask for it

    said = read_remarks(run.folder)
    remarks = {
        "verdict": said.verdict,
        "tags": " ".join(said.tags),
        "notes": "\n".join(f"{note.at} {note.who}: {note.text}" for note in said.notes),
        "problems": "\n".join(run.problems),
    }
    return as_mat(run.manifest, run.traces, remarks)


def _overview(runs: Sequence[_Run]) -> bytes:
    """Return a table of the runs."""
    heads = {
        "run": "name", "created": "created", "status": "status", "title": "title", "mode": "mode",
        "model": "model", "shape": "shape", "operator": "operator",
        "slowest asked for [rad/s]": "slowest", "fastest asked for [rad/s]": "fastest",
        "distance [m]": "distance", "distance of the twin [m]": "twin_distance",
        "error of the twin [mm]": "error", "verdict": "verdict", "tags": "tags", "notes": "notes",
    }  # fmt: skip
    text = io.StringIO()
    table = writer(text)
    table.writerow([*heads, "problems"])
    for run in runs:
        cells = [getattr(run.entry, field) for field in heads.values()]
        plain = [" ".join(cell.split()) if isinstance(cell, str) else cell for cell in cells]
        table.writerow([*plain, "; ".join(run.problems)])
    return text.getvalue().encode()


def _readme(runs: Sequence[_Run], csv: bool, mat: bool) -> str:
    names = {trace.name: dict.fromkeys(["time_s"]) for trace in TRACES}
    for run in runs:
        for name, series in run.traces.items():
            names[name] |= dict.fromkeys(series.names)
    parts = [_WHAT.format(count=len(runs)), *([_CSV] if csv else []), *([_MAT] if mat else [])]
    parts += [
        "\n".join([f"Columns of {name}: {description}.", *column_lines(names[name])])
        for name, _, description in TRACES
        if len(names[name]) > 1
    ]
    omitted = [f"  {run.folder.name}/{name}" for run in runs for name in run.omitted]
    if omitted:
        parts.append("\n".join(["LEFT OUT, as it is no file that can be exported:", *omitted]))
    damaged = [f"  {run.folder.name}: {text}" for run in runs for text in run.problems]
    if damaged:
        parts.append("\n".join(["DAMAGED OR UNFINISHED; what is there is here:", *damaged]))
    return "\n\n".join(parts) + "\n"


_WHAT = """\
Runs of a curved-beam hopping robot, each beside its twin, a simulation of the same run.
{count} run(s); runs.csv has a line for each.

bundles/RUN/   everything that belongs to a run, unchanged. report.html opens in any browser;
               compare.rrd in the viewer rerun; *.parquet are the traces, take/ is the export of
               the cameras; remarks.jsonl what people said of it.
checksums.txt  sha256 of every file: sha256sum -c checksums.txt; each bundle has its own as well."""
_CSV = """\
csv/RUN/*.csv  the traces, comma separated, a head line with units. Empty cell: nothing was seen."""
_MAT = """\
mat/RUN.mat    the same for MATLAB and Octave: load RUN.mat, then run.measured.time_s,
               run.measured.foot_x_m, run.measured.units. NaN: nothing was seen.
               jsondecode(run.manifest) has every fact of the run."""


def _fill_folder(draft: Path, contents: Iterator[tuple[str, Content]]) -> list[int]:
    def keep(name: str, content: Content) -> None:
        path = draft / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            _pour(content, file)

    return _kept(contents, keep)


def _fill_zip(draft: Path, contents: Iterator[tuple[str, Content]]) -> list[int]:
    with ZipFile(draft, "w") as archive:

        def keep(name: str, content: Content) -> None:
            info = ZipInfo(name, _OLDEST)
            info.compress_type, info.external_attr, info.create_system = ZIP_DEFLATED, _READABLE, 3
            info.file_size = _size(content)  # so that one above 2 GB is announced as such
            with archive.open(info, "w") as file:
                _pour(content, file)

        return _kept(contents, keep)


def _kept(contents: Iterator[tuple[str, Content]], keep: Keep) -> list[int]:
    """Keep each content and the checksums of all, and return the sizes [byte]."""
    sizes: list[int] = []
    lines: list[str] = []
    for name, content in contents:
        keep(name, content)
        lines.append(f"{_sha256(content)}  {name}\n")
        sizes.append(_size(content))
    keep("checksums.txt", "".join(lines).encode())
    return sizes


def _pour(content: Content, file: Any) -> None:
    with _source(content) as source:
        shutil.copyfileobj(source, file)


def _sha256(content: Content) -> str:
    with _source(content) as source:
        return hashlib.file_digest(source, "sha256").hexdigest()


def _source(content: Content) -> io.BufferedReader | io.BytesIO:
    return content.open("rb") if isinstance(content, Path) else io.BytesIO(content)


def _size(content: Content) -> int:
    return content.stat().st_size if isinstance(content, Path) else len(content)
