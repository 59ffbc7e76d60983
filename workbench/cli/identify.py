"""`workbench identify`: the model's parameters from measured runs."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle, runs_named
from workbench.cli.console import progress, show_table, stderr
from workbench.cli.plain_output import JsonFlag, RunArguments, RunsFolder, emit
from workbench.identify import BEAM, Identification, ParameterEstimate
from workbench.report import fit_runs

__all__ = ["identify"]


def identify(
    runs: RunArguments,
    fit: Annotated[
        str, typer.Option(help="Parameters of the model file, separated by commas.")
    ] = ",".join(BEAM),
    out: Annotated[
        Path | None, typer.Option(help="New model file; by default models/MODEL-DAY.yaml.")
    ] = None,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Fit stiffness and damping, or what --fit names, to runs; validate on those held out.

    Clamped runs and ring-downs determine beam and masses, drops and hops ground, friction and
    foot; named together, all runs are fitted at once. Beside the new model lies its report, an HTML
    page with figures.

    Example: workbench identify runs

    Example: workbench identify runs --fit hinge_stiffness,root_stiffness,top_mass

    Example: workbench identify runs --fit ground_stiffness,ground_damping,friction_slide
    """
    begin = time.perf_counter()
    bundles = [Bundle.open(one) for one in runs_named(runs, folder)]
    done = fit_runs(bundles, _names(fit), out, progress)
    if as_json:
        emit(done.as_json() | {"seconds": time.perf_counter() - begin})
        return
    _print(done.found)
    print(done.validation)
    print(f"model: {done.model.path}")
    print(f"report: {done.report}")


def _names(fit: str) -> list[str]:
    return [name.strip() for name in fit.split(",") if name.strip()]


def _print(found: Identification) -> None:
    title = f"{len(found.runs)} runs, misfit {found.misfit:.2f} times the noise"
    _print_estimates(title, found.estimates)
    if found.within_tolerance:
        _print_estimates("the model's other numbers, within tolerance", found.within_tolerance)
    for one in found.not_determined:
        stderr.print(f"not determined: {one}", markup=False)
    for warning in found.warnings:
        stderr.print(f"note: {warning}", markup=False)


def _print_estimates(title: str, estimates: Mapping[str, ParameterEstimate]) -> None:
    rows = [
        [name, f"{e.value:.4g}", f"± {e.half_width:.2g}", f"{e.stated:.4g}",
         f"{100 * (e.value / e.stated - 1):+.2f} %", e.unit]
        for name, e in estimates.items()
    ]  # fmt: skip
    head = ["parameter", "value", "90 %", "nominal", "change", "unit"]
    show_table(title, head, rows)
