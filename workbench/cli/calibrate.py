"""`workbench calibrate`: the speed-voltage line from measured runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle, runs_named
from workbench.cli.console import progress, show_table, stderr
from workbench.cli.plain_output import JsonFlag, RunArguments, RunsFolder, emit
from workbench.identify import (
    SpeedCalibration,
    SpeedPoint,
    last_day,
    new_target,
    on_their_bench,
    propose_protocol,
    speed_points,
    write_calibration,
    write_new,
)
from workbench.identify import calibrate as calibrate_runs
from workbench.report import figure_5_3

__all__ = ["calibrate"]


def calibrate(
    runs: RunArguments,
    out: Annotated[
        Path | None,
        typer.Option(help="New calibration file; by default calibrations/DAY.yaml, the runs' day."),
    ] = None,
    name: Annotated[
        str | None, typer.Option("--id", help="Name of the calibration; by default the file's.")
    ] = None,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Fit the line from voltage to rotor speed, with intervals and checks of linearity.

    Example: workbench calibrate runs
    """
    bundles = [Bundle.open(one) for one in runs_named(runs, folder)]
    day = last_day(bundles)
    target = new_target(out, Path("calibrations") / f"{day.isoformat()}.yaml", _results)
    _, picture, proposal = _results(target)
    found = calibrate_runs(*speed_points(bundles, progress))
    if found.line is None:
        write_new(proposal, propose_protocol(on_their_bench(bundles), found.mode))
        files = {"calibration": None, "figure": None, "next_protocol": str(proposal)}
    else:
        write_calibration(target, name or target.stem, day, found)
        figure_5_3(found).savefig(picture, metadata={"Date": None})
        files = {"calibration": str(target), "figure": str(picture), "next_protocol": None}
    if as_json:
        emit(found.as_json() | files)
    else:
        _print(found, files)
    if found.line is None:
        raise typer.Exit(1)


def _results(target: Path) -> list[Path]:
    return [target, target.with_suffix(".svg"), target.with_name(f"{target.stem}-protocol.yaml")]


def _print(found: SpeedCalibration, files: dict[str, str | None]) -> None:
    _print_runs(found)
    if found.line is not None:
        rows = [
            [key, f"{one.value:.5g}", f"{one.low:.5g} to {one.high:.5g}", unit]
            for key, (one, unit) in found.parameters.items()
        ]
        title = f"omega = slope U + offset, scatter {found.line.scatter:.2g} rad/s from run to run"
        show_table(title, ["parameter", "value", "90 % interval", "unit"], rows)
        _print_checks(found)
    for one in found.omitted:
        stderr.print(f"left out {one.name}: {one.reason}", markup=False)
    for warning in found.warnings:
        stderr.print(f"note: {warning}", markup=False)
    if found.open is not None:
        stderr.print(f"not determined: {found.open}", markup=False)
        stderr.print("the protocol below determines it", markup=False)
    for key, path in files.items():
        if path is not None:
            print(f"{key.replace('_', ' ')}: {path}")


def _print_runs(found: SpeedCalibration) -> None:
    rows = [
        [f"{point.name}{held}", f"{point.voltage:.3f}", f"{point.speed:.4f}",
         f"{point.standard_error:.4f}", _off_the_line(found, point)]
        for held, points in (("", found.points), (" (held out)", found.held_out))
        for point in points
    ]  # fmt: skip
    asked = sum(point.source == "asked" for point in found.points)
    title = f"runs: {len(found.points)}, voltage read back in {len(found.points) - asked} of them"
    head = ["run", "voltage [V]", "speed [rad/s]", "error [rad/s]", "off the line [rad/s]"]
    show_table(title, head, rows)


def _off_the_line(found: SpeedCalibration, point: SpeedPoint) -> str:
    return "-" if found.line is None else f"{found.line.residual(point):+.4f}"


def _print_checks(found: SpeedCalibration) -> None:
    rows = [
        [key.replace("_", " "), "-", "-", f"cannot be determined: {one.untested}"]
        if one.untested is not None
        else [key.replace("_", " "), f"{one.size:+.3g} {one.unit}", f"{one.p_value:.2g}",
              "found" if one.found else "not found"]
        for key, one in found.checks.items()
    ]  # fmt: skip
    show_table("against a straight line", ["check", "size", "p", "verdict"], rows)
