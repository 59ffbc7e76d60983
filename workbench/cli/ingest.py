"""`workbench ingest`: measured data into bundles, or the quality report of one take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from workbench.bundle import Bundle
from workbench.cli.output import JsonFlag, RunsFolder, comparison_table, emit, show_table, tell
from workbench.ingest import ingest_sheet
from workbench.protocol import Sheet, load
from workbench.tracking import quality, read_take

__all__ = ["ingest"]


def ingest(
    source: Annotated[Path, typer.Argument(metavar="SHEET_OR_TAKE", help="Sheet or export.")],
    runs: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Make bundles of a sheet's takes, or tell what one export holds.

    Example: workbench ingest "Take 2026-03-12.csv"
    """
    if source.suffix in (".yaml", ".yml"):
        _ingest_sheet(source, runs, as_json)
        return
    report = quality(read_take(source))
    if as_json:
        emit(report)
    else:
        _print_quality(source, report)


def _ingest_sheet(source: Path, runs: Path, as_json: bool) -> None:
    done: list[Bundle] = []
    for bundle in ingest_sheet(load(source, Sheet), runs, tell):
        done.append(bundle)
        if not as_json:
            comparison_table(bundle.manifest)
            print(f"bundle: {bundle.path}")
    if as_json:
        emit({"bundles": [str(bundle.path) for bundle in done]})


def _print_quality(source: Path, report: dict[str, Any]) -> None:
    kind = {"row": "row format", "motive": "Motive", "c3d": "C3D"}[report["format"]]
    title = (
        f"{source.name}: {' '.join(filter(None, (kind, report['version'])))}, "
        f"{report['frames']} frames at {report['rate_hz']:.6g} Hz, "
        f"{report['first_time_s']:.3f} s to {report['last_time_s']:.3f} s"
    )
    rows = [
        [name, _reasons(body), str(body["gaps"]), str(body["longest_gap"]), _hidden(body),
         _place(body["mean_position_m"])]
        for name, body in report["bodies"].items()
    ]  # fmt: skip
    head = ["body", "missing", "gaps", "longest gap", "hidden markers", "mean position [m]"]
    show_table(title, head, rows)
    print(f"clock: steps scatter by {1e3 * report['jitter_s']:.3f} ms")
    if report["start_time"]:
        print(f"start: {report['start_time']}")
    for warning in report["warnings"]:
        print(f"note: {warning}")


def _reasons(body: dict[str, Any]) -> str:
    """Return how many samples of a body are missing, and why."""
    return " + ".join(f"{count} {reason}" for reason, count in body["reasons"].items()) or "0"


def _hidden(body: dict[str, Any]) -> str:
    """Return in how many samples each marker is hidden; a dash where the file has no markers."""
    return " ".join(str(count) for count in body["markers"].values()) or "-"


def _place(mean: list[float] | None) -> str:
    return "never seen" if mean is None else ", ".join(f"{value:.3f}" for value in mean)
