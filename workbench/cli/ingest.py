"""`workbench ingest`: measured data into bundles, or the quality report of one take."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from workbench.bundle import Bundle, run_named
from workbench.cli.console import comparison_table, print_notes, progress
from workbench.cli.plain_output import JsonFlag, RunsFolder, emit, print_columns
from workbench.cli.quality import print_quality
from workbench.cli.views import bundle_json, draw_views
from workbench.errors import InputError
from workbench.progress import counted
from workbench.tracking import exports_in, guess_bodies, quality, quality_or_error, read_take

__all__ = ["ingest"]


def ingest(
    source: Annotated[
        Path, typer.Argument(metavar="SHEET_OR_TAKE", help="Sheet, export, or a folder of exports.")
    ],
    into: Annotated[
        Path | None, typer.Option(metavar="RUN", help="Add the export to this run without one.")
    ] = None,
    insist: Annotated[
        bool, typer.Option("--insist", help="Add it although it does not seem to belong.")
    ] = False,
    runs: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Make bundles of a sheet's takes, report what an export holds, or add it to a run.

    All exports of a folder are listed in one table, a line each.

    With --into the export is checked as at the bench: whole, begun when the run's cameras began,
    and as long as the run. Then the run is compared with its twin and complete.

    Example: workbench ingest "Take 2026-03-12.csv"
    """
    if source.is_dir():
        if into is not None:
            raise InputError(f"{source}: --into takes one export, not a folder")
        _print_folder(source, as_json)
        return
    sheet = source.suffix in (".yaml", ".yml")
    if insist and into is None:
        raise InputError("--insist goes with --into RUN")
    if into is not None:
        if sheet:
            raise InputError(f"{source}: --into takes one export, not a sheet")
        _add(source, Bundle.open(run_named(into, runs)), insist, as_json)
        return
    if sheet:
        _ingest_sheet(source, runs, as_json)
        return
    progress(f"read {source.name}")
    take = read_take(source)
    report, guess = quality(take), guess_bodies(take)
    if as_json:
        emit({**report, "guess": None if guess is None else asdict(guess)})
    else:
        print_quality(source.name, report, guess)


def _print_folder(folder: Path, as_json: bool) -> None:
    """Print what each export of a folder holds, and why other files are none.

    Raises:
        InputError: no file in it is an export.
    """
    files, reports = exports_in(folder), dict[str, dict[str, Any]]()
    for number, path in enumerate(files, start=1):
        progress(counted(path.name, number, len(files)))
        reports[path.name] = quality_or_error(path)
    if not any("frames" in report for report in reports.values()):
        reasons = "; ".join(report["error"] for report in list(reports.values())[:3])
        reasons = reasons or "it holds no file; put exports into it, or name a file"
        raise InputError(f"{folder}: no export in it can be read: {reasons}")
    if as_json:
        emit({"takes": reports})
        return
    read = {name: report for name, report in reports.items() if "frames" in report}
    rows = [
        [name, str(report["frames"]), f"{report['rate_hz']:.6g}",
         f"{report['last_time_s'] - report['first_time_s']:.2f}", _missing_shares(report),
         str(len(report["warnings"]))]
        for name, report in read.items()
    ]  # fmt: skip
    print_columns(["take", "frames", "rate [Hz]", "length [s]", "missing", "notes"], rows)
    print_notes([report["error"] for report in reports.values() if "error" in report])


def _missing_shares(report: dict[str, Any]) -> str:
    """Return how much of each body is missing [%], in words."""
    n = report["frames"]
    shares = [
        f"{name} {100 * body['missing'] / n:.1f} %" for name, body in report["bodies"].items()
    ]
    return ", ".join(shares) or f"no bodies, {len(report['points'])} markers"


def _add(source: Path, bundle: Bundle, insist: bool, as_json: bool) -> None:
    from workbench.run import add_take

    add_take(source, bundle, progress, insist)
    undrawn = draw_views(bundle, progress)
    if as_json:
        emit(bundle_json(bundle, undrawn))
    else:
        comparison_table(bundle.asked.title, bundle.compared)
        print(f"bundle: {bundle.path}")


def _ingest_sheet(source: Path, runs: Path, as_json: bool) -> None:
    from workbench.run import ingest_sheet
    from workbench.schemas import Sheet, load

    done: list[Bundle] = []
    undrawn: list[str] = []
    for bundle in ingest_sheet(load(source, Sheet), runs, progress):
        done.append(bundle)
        undrawn += draw_views(bundle, progress)
        if not as_json:
            comparison_table(bundle.asked.title, bundle.compared)
            print(f"bundle: {bundle.path}")
    if as_json:
        emit({"bundles": [str(bundle.path) for bundle in done], "warnings": undrawn})
