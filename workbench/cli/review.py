"""`workbench review`: open a run's recording in rerun."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle
from workbench.cli.completing import run_names
from workbench.cli.output import RunsFolder, people, show_table, tell
from workbench.errors import InputError
from workbench.pairing import pair_extended
from workbench.protocol import Document, ModelFile, load_model
from workbench.review import Comparison, open_viewer, write_recording

__all__ = ["review"]


def review(
    run: Annotated[
        Path, typer.Argument(help="Bundle: its folder or name.", autocompletion=run_names)
    ],
    web: Annotated[bool, typer.Option(help="Open in the browser instead of a window.")] = False,
    save: Annotated[Path | None, typer.Option(help="Copy the recording here instead.")] = None,
    model: Annotated[
        str | None,
        typer.Option(help="Extended model, a name or file: its twin is shown as a third robot."),
    ] = None,
    runs: RunsFolder = Path("runs"),
) -> None:
    """Show the robot and its twin side by side, and the twin of an extended model beside them.

    Example: workbench review runs/2026-03-12_101500_hop-16.99 --model diagnoses/a/a-model.yaml
    """
    bundle = Bundle.find(run, runs)
    if model is not None:
        _show_extended(bundle, load_model(model, Path()), web, save)
        return
    recording = bundle.view("recording")
    if not recording.exists():
        raise InputError(f"{run}: has no recording; its status is in `workbench runs show {run}`")
    if save is not None:
        shutil.copyfile(recording, save)
        people.print(f"saved {save}", markup=False)
        return
    tell("open the recording in the viewer")
    open_viewer(recording, web=web)


def _show_extended(
    bundle: Bundle, model: Document[ModelFile], web: bool, save: Path | None
) -> None:
    """Make a recording with a third robot; the bundle's own stays as it is."""
    tell("simulate the run with both models")
    comparison = pair_extended(bundle, model)
    _print_errors(comparison)
    if save is not None:
        write_recording(comparison, save)
        people.print(f"saved {save}", markup=False)
        return
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / f"{comparison.run}.rrd"
        write_recording(comparison, recording)
        open_viewer(recording, web=web)


def _print_errors(comparison: Comparison) -> None:
    errors = {"twin": comparison.misfit}
    if comparison.extended is not None:
        errors["extended twin"] = comparison.extended.misfit
    rows = [
        [who, *(f"{error:.1f}" for error in (e.foot_mm, e.top_mm, e.both_mm))]
        for who, e in errors.items()
    ]
    show_table(comparison.title, ["", "foot [mm]", "T [mm]", "foot and T [mm]"], rows)
