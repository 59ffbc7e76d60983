"""`workbench identify`: the model's parameters from measured runs."""

from __future__ import annotations

import time
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle, sha256
from workbench.cli.completing import run_names
from workbench.cli.output import JsonFlag, RunsFolder, emit, people, show_table, tell
from workbench.errors import InputError
from workbench.identify import (
    BEAM,
    Identification,
    MeasuredRun,
    Validation,
    made_from,
    measured_run,
    report_fit,
    validate,
    write_model,
)
from workbench.identify import identify as identify_runs
from workbench.progress import counted
from workbench.protocol import Document, ModelFile, ShapeFile, load
from workbench.sim import make_robot

__all__ = ["identify", "read_runs", "same_robot"]


def identify(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUNS...", help="Bundles, or folders that hold some.", autocompletion=run_names
        ),
    ],
    fit: Annotated[
        str, typer.Option(help="Parameters of the model file, separated by commas.")
    ] = ",".join(BEAM),
    out: Annotated[
        Path | None, typer.Option(help="New model file; by default models/<model>-<day>.yaml.")
    ] = None,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Fit stiffness and damping, or what --fit names, to runs; validate on those held out.

    Beam and masses are told by clamped runs and ring-downs, ground, friction and foot by drops and
    hops; named together, all runs are fitted at once. Beside the new model lies its report, an HTML
    page with figures.

    Example: workbench identify runs

    Example: workbench identify runs --fit hinge_stiffness,root_stiffness,top_mass

    Example: workbench identify runs --fit ground_stiffness,ground_damping,friction_slide
    """
    begin = time.perf_counter()
    bundles = Bundle.find_all(runs, folder)
    stated, shape = same_robot(bundles)
    target = out or Path("models") / f"{stated.content.name}-{date.today().isoformat()}.yaml"
    page = target.with_suffix(".html")
    _require_new(target, page)
    measured = read_runs(bundles)
    train = [run for run in measured if run.role == "train"]
    found = identify_runs(train, stated.content, shape.content, _names(fit), progress=tell)
    names = tuple(run.name for run in found.runs)
    written = write_model(
        target, stated, found.values, found.estimates, names, date.today(), found.robot.increments
    )
    tell("validate on runs that the fit has not seen")
    held = [run for run in measured if run.role == "held_out"]
    validation = validate(held, stated.content, written.content, shape.content)
    robot = make_robot(written.content.values(), shape.content, written.content.increments)
    made = made_from(bundles, stated, written)
    tell("draw the report")
    report = report_fit(page, found, measured, robot, validation, made)
    files = {"model": str(written.path), "report": str(report)}
    if as_json:
        emit(_as_json(found, validation) | files | {"seconds": time.perf_counter() - begin})
        return
    _print(found)
    print(validation)
    for kind, file in files.items():
        print(f"{kind}: {file}")


def _require_new(*paths: Path) -> None:
    for path in paths:
        if path.exists():
            raise InputError(f"{path}: exists and is never overwritten; give another --out")


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


def read_runs(bundles: Sequence[Bundle]) -> list[MeasuredRun]:
    """Return what was measured in runs, and tell of each; one that is not complete is left out.

    Raises:
        InputError: when none is complete.
    """
    measured: list[MeasuredRun] = []
    for k, bundle in enumerate(bundles):
        status = bundle.manifest.status
        if status != "complete":
            tell(f"left out {bundle.path.name}: its status is {status}")
            continue
        tell(counted(f"read {bundle.path.name}", k + 1, len(bundles)))
        measured.append(measured_run(bundle))
    if not measured:
        raise InputError(
            "none of these runs is complete, and only a complete run can be fitted; "
            "`workbench runs list` shows which are"
        )
    return measured


def same_robot(bundles: Sequence[Bundle]) -> tuple[Document[ModelFile], Document[ShapeFile]]:
    """Return the model and the shape that all bundles were made with.

    Raises:
        InputError: when they differ; a fit of two robots at once is of neither.
    """
    for kind in ("model", "shape"):
        seen: dict[str, str] = {}
        for bundle in bundles:
            seen.setdefault(sha256(bundle.document(kind)), bundle.path.name)
        if len(seen) > 1:
            raise InputError(
                f"the runs were made with different {kind} files: {', '.join(seen.values())}; "
                f"give only runs of one {kind}"
            )
    first = bundles[0]
    return load(first.document("model"), ModelFile), load(first.document("shape"), ShapeFile)


def _print(found: Identification) -> None:
    rows = [
        [name, f"{e.value:.5g}", f"{e.low:.5g} to {e.high:.5g}", f"{e.stated:.5g}",
         f"{100 * (e.value / e.stated - 1):+.2f} %", e.unit]
        for name, e in found.estimates.items()
    ]  # fmt: skip
    head = ["parameter", "value", "90 % interval", "stated", "change", "unit"]
    show_table(f"{len(found.runs)} runs, misfit {found.misfit:.2f} times the noise", head, rows)
    for one in found.not_determined:
        people.print(f"not determined: {one}", markup=False)
    for warning in found.warnings:
        people.print(f"note: {warning}", markup=False)
