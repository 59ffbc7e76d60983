"""`workbench ingest`: measured data into bundles, or the quality report of one take."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from workbench.bundle import Bundle
from workbench.cli.output import JsonFlag, RunsFolder, comparison_table, emit, show_table, tell
from workbench.ingest import ingest_sheet
from workbench.protocol import Sheet, load
from workbench.tracking import BodyNames, guess_bodies, quality, read_take

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
    take = read_take(source)
    report, guess = quality(take), guess_bodies(take)
    if as_json:
        emit({**report, "guess": None if guess is None else asdict(guess)})
    else:
        _print_quality(source, report, guess)


def _ingest_sheet(source: Path, runs: Path, as_json: bool) -> None:
    done: list[Bundle] = []
    for bundle in ingest_sheet(load(source, Sheet), runs, tell):
        done.append(bundle)
        if not as_json:
            comparison_table(bundle.manifest)
            print(f"bundle: {bundle.path}")
    if as_json:
        emit({"bundles": [str(bundle.path) for bundle in done]})


def _print_quality(source: Path, report: dict[str, Any], guess: BodyNames | None) -> None:
    kind = {"row": "row format", "motive": "Motive"}[report["format"]]
    title = (
        f"{source.name}: {kind} {report['version']}, {report['frames']} frames at "
        f"{report['rate_hz']:.6g} Hz, "
        f"{report['first_time_s']:.3f} s to {report['last_time_s']:.3f} s"
    )
    rows = [
        [name, str(body["missing"]), str(body["gaps"]), str(body["longest_gap"]),
         _place(body["mean_position_m"])]
        for name, body in report["bodies"].items()
    ]  # fmt: skip
    head = ["body", "missing", "gaps", "longest gap", "mean position [m]"]
    show_table(title, head, rows)
    if guess is not None:
        print(f"looks like: foot {guess.foot}, top {guess.top}, rotor {guess.rotor}")
    for warning in report["warnings"]:
        print(f"note: {warning}")


def _place(mean: list[float] | None) -> str:
    return "never seen" if mean is None else ", ".join(f"{value:.4f}" for value in mean)
