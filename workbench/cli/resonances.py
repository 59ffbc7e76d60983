"""`workbench resonances`: amplitude, phase, spectra and damping of measured runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle, runs_named
from workbench.cli.console import progress, show_table, stderr
from workbench.cli.plain_output import JsonFlag, RunArguments, RunsFolder, emit
from workbench.errors import InputError
from workbench.fit import measured_runs
from workbench.identify import ModeDamping, Resonances, damping
from workbench.identify import resonances as find_resonances
from workbench.report import write_resonances

__all__ = ["resonances"]


def resonances(
    runs: RunArguments,
    folder: RunsFolder = Path("runs"),
    report: Annotated[
        Path | None, typer.Option(help="Write figures and tables to this HTML file.")
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Report the resonances of a clamped sweep and the damping of ring-downs.

    Example: workbench resonances runs --report resonances.html
    """
    bundles = [Bundle.open(one) for one in runs_named(runs, folder)]
    if not any(one.manifest.status == "complete" for one in bundles):
        raise InputError(
            f"{', '.join(map(str, runs))}: holds no complete bundle; "
            "`workbench run protocols/clamped-sweep.yaml` makes some"
        )
    bundles.sort(key=lambda one: (one.manifest.created, one.asked.number))
    measured = measured_runs(bundles, progress)
    progress(f"find resonances in {len(measured)} runs")
    found = find_resonances(measured)
    modes = damping(measured) if any(run.mode == "decay" for run in measured) else ()
    if report is not None:
        progress("draw the report")
        (first, *others) = [b for b in bundles if b.path.name in {run.name for run in measured}]
        title = "Resonances of the robot" if others else first.asked.title
        write_resonances(report, title, measured, found, modes)
    if as_json:
        emit(
            found.as_json()
            | {
                "damping": [mode.as_json() for mode in modes],
                "report": None if report is None else str(report),
            }
        )
        return
    _show(found, modes)
    if report is not None:
        print(f"report: {report}")


def _show(found: Resonances, modes: Sequence[ModeDamping]) -> None:
    if found.points:
        head = ["speed [rad/s]", "sweep", "x [mm]", "z [mm]", "lag x [deg]", "lag z [deg]",
                "half x [mm]", "half z [mm]"]  # fmt: skip
        rows = [
            [
                ("" if p.steady else "~") + f"{p.speed:.2f}",
                p.direction,
                *(f"{1000 * a:.1f}" for a in p.amplitude()),
                *(f"{57.29578 * lag:.0f}" for lag in p.lag),
                *(f"{1000 * a:.1f}" for a in p.amplitude(0.5)),
            ]
            for p in found.points
        ]
        show_table(
            "response of T at the rotor's speed and at half of it; ~ where it still changed",
            head,
            rows,
        )
    if found.peaks:
        head = ["resonance", "sweep", "speed [rad/s]", "error [rad/s]", "frequency [Hz]"]
        rows = [
            [p.oscillation, p.direction, f"{p.speed:.2f}", f"{p.speed_error:.2f}", f"{p.hz:.3f}"]
            for p in found.peaks
        ]
        show_table("resonances", head, rows)
    _show_lines(found)
    for mode in modes:
        print(mode)
    for jump in found.jumps:
        print(jump)
    for warning in found.warnings:
        stderr.print(f"note: {warning}", markup=False)


def _show_lines(found: Resonances) -> None:
    head = ["run", "line [Hz]", "[rad/s]", "x [mm]", "z [mm]", "is"]
    rows = []
    for one in found.spectra:
        for line in one.lines[:1]:
            sizes = [f"{1000 * amplitude:.1f}" for amplitude in line.amplitude]
            name = one.run.split("_")[-1]
            rows.append([name, f"{line.hz:.3f}", f"{line.rad_s:.2f}", *sizes, line.name])
    if rows:
        show_table("strongest line of T's motion", head, rows)
