"""`workbench identify`: the model's parameters from measured runs."""

from __future__ import annotations

import time
from datetime import date
from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle, runs_named
from workbench.cli.output import JsonFlag, RunArguments, RunsFolder, emit, people, show_table, tell
from workbench.identify import (
    BEAM,
    Identification,
    Validation,
    made_from,
    measured_runs,
    new_target,
    report_fit,
    same_robot,
    validate,
    write_model,
)
from workbench.identify import identify as identify_runs
from workbench.progress import Stage, portion
from workbench.sim import make_robot

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
    stated, shape = same_robot(bundles)
    named = Path("models") / f"{stated.content.name}-{date.today().isoformat()}.yaml"
    target = new_target(out, named, _results)
    page = target.with_suffix(".html")
    measured = measured_runs(bundles, tell)
    train = [run for run in measured if run.role == "train"]
    found = identify_runs(
        train, stated.content, shape.content, _names(fit), progress=portion(tell, 0.05, 0.8)
    )
    names = tuple(run.name for run in found.runs)
    written = write_model(
        target, stated, found.values, found.estimates, names, date.today(), found.robot.increments
    )
    tell(Stage("validate on runs that the fit has not seen", 0.8))
    held = [run for run in measured if run.role == "held_out"]
    validation = validate(held, stated.content, written.content, shape.content)
    robot = make_robot(written.content.values(), shape.content, written.content.increments)
    made = made_from(bundles, stated, written)
    tell(Stage("draw the report", 0.95))
    report = report_fit(page, found, measured, robot, validation, made)
    files = {"model": str(written.path), "report": str(report)}
    if as_json:
        emit(_as_json(found, validation) | files | {"seconds": time.perf_counter() - begin})
        return
    _print(found)
    print(validation)
    for kind, file in files.items():
        print(f"{kind}: {file}")


def _results(target: Path) -> list[Path]:
    return [target, target.with_suffix(".html")]


def _as_json(found: Identification, validation: Validation) -> dict[str, object]:
    return {
        "parameters": {name: one.as_json() for name, one in found.estimates.items()},
        "not_determined": list(found.not_determined),
        "validation": validation.as_json(),
        "misfit": found.misfit,
        "process_noise": found.process_noise,
        "runs": [run.name for run in found.runs],
        "warnings": list(found.warnings),
    }


def _names(fit: str) -> list[str]:
    return [name.strip() for name in fit.split(",") if name.strip()]


def _print(found: Identification) -> None:
    rows = [
        [name, f"{e.value:.5g}", f"{e.low:.5g} to {e.high:.5g}", f"{e.stated:.5g}",
         f"{100 * (e.value / e.stated - 1):+.2f} %", e.unit]
        for name, e in found.estimates.items()
    ]  # fmt: skip
    head = ["parameter", "value", "90 % interval", "nominal", "change", "unit"]
    show_table(f"{len(found.runs)} runs, misfit {found.misfit:.2f} times the noise", head, rows)
    for one in found.not_determined:
        people.print(f"not determined: {one}", markup=False)
    for warning in found.warnings:
        people.print(f"note: {warning}", markup=False)
