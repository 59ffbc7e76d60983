"""`workbench ingest`: measured data into bundles, or the quality report of one take."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from workbench.bundle import Bundle
from workbench.cli.output import (
    JsonFlag,
    RunsFolder,
    comparison_table,
    emit,
    print_notes,
    show_table,
    tell,
)
from workbench.cli.plain import print_columns
from workbench.cli.views import described, draw_views
from workbench.errors import InputError, TakeError
from workbench.progress import counted
from workbench.tracking import BodyNames, guess_bodies, quality, read_take

__all__ = ["ingest", "print_quality"]

_EXPORTS = (".csv", ".c3d", ".trc")
_KINDS = {
    "row": "row format", "motive": "Motive", "natnet": "NatNet", "c3d": "C3D", "trc": "TRC"
}  # fmt: skip
_MOST_POINTS = 20
_MOST_IDS = 3


def ingest(
    source: Annotated[
        Path, typer.Argument(metavar="SHEET_OR_TAKE", help="Sheet, export, or a folder of exports.")
    ],
    into: Annotated[
        Path | None, typer.Option(metavar="RUN", help="Add the export to this run, which lacks it.")
    ] = None,
    insist: Annotated[
        bool, typer.Option("--insist", help="Add it although it does not seem to belong.")
    ] = False,
    runs: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Make bundles of a sheet's takes, tell what one export holds, or add it to a run.

    Of a folder, all exports in it are told in one table, a line each.

    With --into the export is checked as at the bench: whole, begun when the run's cameras began,
    and as long as the run. Then the run is paired with its twin and complete.

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
        _add(source, Bundle.find(into, runs), insist, as_json)
        return
    if sheet:
        _ingest_sheet(source, runs, as_json)
        return
    tell(f"read {source.name}")
    take = read_take(source)
    report, guess = quality(take), guess_bodies(take)
    if as_json:
        emit({**report, "guess": None if guess is None else asdict(guess)})
    else:
        print_quality(source.name, report, guess)


def _print_folder(folder: Path, as_json: bool) -> None:
    """Tell what each export of a folder holds; what is none is told with the reason.

    Raises:
        InputError: no file in it is an export.
    """
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in _EXPORTS)
    reports: dict[str, dict[str, Any]] = {}
    for number, path in enumerate(files, start=1):
        tell(counted(path.name, number, len(files)))
        try:
            reports[path.name] = quality(read_take(path))
        except TakeError as error:
            reports[path.name] = {"error": str(error)}
    if not any("frames" in report for report in reports.values()):
        told = "; ".join(report["error"] for report in list(reports.values())[:3])
        told = told or "it holds no file; put exports into it, or name a file"
        raise InputError(f"{folder}: no export in it can be read: {told}")
    if as_json:
        emit({"takes": reports})
        return
    read = {name: report for name, report in reports.items() if "frames" in report}
    rows = [
        [name, str(report["frames"]), f"{report['rate_hz']:.6g}",
         f"{report['last_time_s'] - report['first_time_s']:.2f}", _worst(report),
         str(len(report["warnings"]))]
        for name, report in read.items()
    ]  # fmt: skip
    print_columns(["take", "frames", "rate [Hz]", "length [s]", "missing", "notes"], rows)
    print_notes([report["error"] for report in reports.values() if "error" in report])


def _worst(report: dict[str, Any]) -> str:
    """Return how much of each body is missing, in their order."""
    n = report["frames"]
    shares = [
        f"{name} {100 * body['missing'] / n:.1f} %" for name, body in report["bodies"].items()
    ]
    return ", ".join(shares) or f"no bodies, {len(report['points'])} markers"


def _add(source: Path, bundle: Bundle, insist: bool, as_json: bool) -> None:
    from workbench.ingest import add_take

    add_take(source, bundle, tell, insist)
    undrawn = draw_views(bundle, tell)
    if as_json:
        emit(described(bundle, undrawn))
    else:
        comparison_table(bundle.asked.title, bundle.compared)
        print(f"bundle: {bundle.path}")


def _ingest_sheet(source: Path, runs: Path, as_json: bool) -> None:
    from workbench.ingest import ingest_sheet
    from workbench.protocol import Sheet, load

    done: list[Bundle] = []
    undrawn: list[str] = []
    for bundle in ingest_sheet(load(source, Sheet), runs, tell):
        done.append(bundle)
        undrawn += draw_views(bundle, tell)
        if not as_json:
            comparison_table(bundle.asked.title, bundle.compared)
            print(f"bundle: {bundle.path}")
    if as_json:
        emit({"bundles": [str(bundle.path) for bundle in done], "warnings": undrawn})


def print_quality(source: str, report: dict[str, Any], guess: BodyNames | None) -> None:
    """Print the quality report of one take, and which bodies look like the robot's."""
    kind = _KINDS[report["format"]]
    title = (
        f"{source}: {' '.join(filter(None, (kind, report['version'])))}, "
        f"{report['frames']} frames at {report['rate_hz']:.6g} Hz, "
        f"{report['first_time_s']:.3f} s to {report['last_time_s']:.3f} s"
    )
    rows = [
        [name, _reasons(body), str(body["gaps"]), str(body["longest_gap"]), _hidden(body),
         _place(body["mean_position_m"])]
        for name, body in report["bodies"].items()
    ]  # fmt: skip
    head = ["body", "missing", "gaps", "longest gap", "hidden markers", "mean position [m]"]
    if report["bodies"]:
        show_table(title, head, rows)
    else:
        _print_points(title, report["points"])
    print(f"clock: steps scatter by {1e3 * report['jitter_s']:.3f} ms")
    if report["start_time"]:
        print(f"start: {report['start_time']}")
    if guess is not None:
        print(f"looks like: foot {guess.foot}, top {guess.top}, rotor {guess.rotor}")
    print_notes(report["warnings"])


def _print_points(title: str, points: list[dict[str, Any]]) -> None:
    """Print the markers of a take without bodies; ids that follow one another are one marker."""
    rows = [
        [_ids(point["names"]), str(point["missing"]), str(point["gaps"]),
         str(point["longest_gap"]), _place(point["mean_position_m"])]
        for point in points[:_MOST_POINTS]
    ]  # fmt: skip
    show_table(title, ["marker", "missing", "gaps", "longest gap", "mean position [m]"], rows)
    if len(points) > _MOST_POINTS:
        print(f"and {len(points) - _MOST_POINTS} more markers; --json has all of them")


def _ids(names: list[str]) -> str:
    """Return the ids that a marker had, the first and the last of many."""
    if len(names) <= _MOST_IDS:
        return ", ".join(names)
    return f"{names[0]}, ... {names[-1]} ({len(names)} ids)"


def _reasons(body: dict[str, Any]) -> str:
    """Return how many samples of a body are missing, and why."""
    return " + ".join(f"{count} {reason}" for reason, count in body["reasons"].items()) or "0"


def _hidden(body: dict[str, Any]) -> str:
    """Return in how many samples each marker is hidden; a dash where the file does not tell."""
    counts = list(body["markers"].values())
    if all(count is None for count in counts):
        return "-"
    return " ".join("-" if count is None else str(count) for count in counts)


def _place(mean: list[float] | None) -> str:
    return "never seen" if mean is None else ", ".join(f"{value:.3f}" for value in mean)
