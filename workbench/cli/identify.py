"""`workbench identify`: the model's parameters from measured runs."""

from __future__ import annotations

import time
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle, sha256
from workbench.cli.output import JsonFlag, RunsFolder, emit, people, show_table, tell
from workbench.errors import InputError
from workbench.identify import BEAM, Identification, measured_run, write_model
from workbench.identify import identify as identify_runs
from workbench.protocol import Document, ModelFile, ShapeFile, load

__all__ = ["identify", "same_robot"]


def identify(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUNS...", help="Bundles, or folders that hold some.")
    ],
    fit: Annotated[
        str, typer.Option(help="Parameters of the model file, separated by commas.")
    ] = ",".join(BEAM),
    out: Annotated[
        Path | None, typer.Option(help="New model file; by default models/<model>-<day>.yaml.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the bootstrap that gives the intervals.")] = 0,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Fit stiffness and damping, or what --fit names, to clamped runs and ring-downs.

    Example: workbench identify runs
    Example: workbench identify runs --fit hinge_stiffness,root_stiffness,top_mass
    """
    begin = time.perf_counter()
    bundles = Bundle.find_all(runs, folder)
    stated, shape = same_robot(bundles)
    names = [name.strip() for name in fit.split(",") if name.strip()]
    target = out or Path("models") / f"{stated.content.name}-{date.today().isoformat()}.yaml"
    if target.exists():
        raise InputError(f"{target}: exists; a model is never changed, give another --out")
    fitted = [run for run in map(measured_run, bundles) if run.role == "train"]
    found = identify_runs(fitted, stated.content, shape.content, names, seed=seed, progress=tell)
    written = write_model(target, stated, found, date.today())
    if as_json:
        emit(
            {
                "parameters": {n: e.as_json() for n, e in found.estimates.items()},
                "not_determined": [str(one) for one in found.not_determined],
                "validation": None,
                "misfit": found.misfit,
                "increments": found.increments,
                "runs": [run.name for run in found.runs],
                "warnings": list(found.warnings),
                "model": str(written.path),
                "seconds": time.perf_counter() - begin,
            }
        )
        return
    _print(found, written)


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


def _print(found: Identification, written: Document[ModelFile]) -> None:
    rows = [
        [name, f"{e.value:.5g}", f"{e.low:.5g} to {e.high:.5g}", f"{e.stated:.5g}",
         f"{100 * (e.value / e.stated - 1):+.2f} %", e.unit]
        for name, e in found.estimates.items()
    ]  # fmt: skip
    head = ["parameter", "value", "90 % interval", "stated", "change", "unit"]
    show_table(f"{len(found.runs)} runs, misfit {found.misfit:.2f} times the noise", head, rows)
    for warning in found.warnings:
        people.print(f"note: {warning}", markup=False)
    print(f"model: {written.path}")
