"""`workbench review`: runs beside their twins, in the viewer, as a film, picture or page."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from workbench import report as views
from workbench.bundle import Bundle, runs_named
from workbench.cli.console import progress, show_table, stderr
from workbench.cli.plain_output import RunArguments, RunsFolder
from workbench.cli.views import picture_of
from workbench.diagnose import extended_model_of
from workbench.report import (
    Comparison,
    ComparisonSet,
    ValidationReplay,
    compare_extended,
    kept_replay,
    load_any,
    validation_rows,
)
from workbench.schemas import Document, ModelFile, load_model

__all__ = ["review"]


def review(
    runs: RunArguments,
    web: Annotated[bool, typer.Option(help="Open in the browser instead of a window.")] = False,
    save: Annotated[
        Path | None, typer.Option(help="Write the recording (.rrd) here instead.")
    ] = None,
    page: Annotated[
        Path | None, typer.Option(help="Write a page (.html) of the run, or of all runs, here.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Write a picture (.png) of the viewer's window here.")
    ] = None,
    video: Annotated[Path | None, typer.Option(help="Film a run into this file (.mp4).")] = None,
    frames: Annotated[
        Path | None, typer.Option(help="Film a run into this folder, a PNG a frame.")
    ] = None,
    slow: Annotated[float, typer.Option(help="How many times slower than life it is filmed.")] = 1,
    model: Annotated[
        str | None,
        typer.Option(help="Extended model, a name or file: its twin is shown as a third robot."),
    ] = None,
    diagnoses: Annotated[
        Path,
        typer.Option(
            help="Folder of diagnoses; the newest one of a run brings its extended model.",
            envvar="WORKBENCH_DIAGNOSES",
        ),
    ] = Path("diagnoses"),
    folder: RunsFolder = Path("runs"),
) -> None:
    """Show robots beside their twins, and the twin of an extended model where there is one.

    Several runs are in one recording: a tab for each pair, and one where all start together. A run
    that was cut off, or whose files were changed, is marked and shown as far as it goes.

    Example: workbench review runs/2026-03-12_101500_hop-16.99

    Example: workbench review speed-scan --page speed-scan.html

    Example: workbench review RUN --video hop.mp4 --slow 4
    """
    bundles = [Bundle.recover(one)[0] for one in runs_named(runs, folder)]
    given = None if model is None else load_model(model, Path())
    shown = ComparisonSet(bundles, [_comparison(bundle, given, diagnoses) for bundle in bundles])
    if video is not None or frames is not None:
        _film(shown.only(), video, frames, slow)
    if save is not None:
        shown.record(save)
        stderr.print(f"saved {save}", markup=False)
    if picture is not None:
        progress("picture of the viewer")
        shown.picture().save(picture)
        stderr.print(f"saved {picture}", markup=False)
    if page is not None:
        shown.write_page(page, picture_of(shown))
        stderr.print(f"page: {page}", markup=False)
    if not any((video, frames, save, picture, page)):
        with tempfile.TemporaryDirectory() as temporary:
            recording = shown.record(Path(temporary) / "runs.rrd")
            views.open_viewer(recording, web, lambda text: stderr.print(text, markup=False))


def _comparison(bundle: Bundle, given: Document[ModelFile] | None, diagnoses: Path) -> Comparison:
    """Return a run beside its twin, and the twin of the model given or of its diagnosis."""
    comparison, model = load_any(bundle), given
    if comparison.mark is not None:
        stderr.print(f"{comparison.run}: {comparison.mark}", style="bold", markup=False)
        for warning in comparison.warnings:
            stderr.print(f"  {warning}", markup=False)
        return comparison
    if model is None and bundle.has_take():
        path = extended_model_of(bundle.path.name, bundle.take(), diagnoses)
        model = None if path is None else load_model(str(path), Path())
    if model is None:
        return comparison
    progress(f"simulate {comparison.run} with {model.content.name}")
    comparison = compare_extended(bundle, model, _validation(bundle, model))
    _print_errors(comparison)
    return comparison


def _validation(bundle: Bundle, model: Document[ModelFile]) -> ValidationReplay | None:
    """Return the validation of the run by the diagnosis that wrote a model, if there is one."""
    if not bundle.has_take():
        return None
    return kept_replay(model.path, bundle.path.name, bundle.take())


def _film(run: Comparison, video: Path | None, frames: Path | None, slow: float) -> None:
    from workbench.report import Film, write_frames, write_video

    how = Film(slow=slow)
    if video is not None or frames is not None:
        progress("film")
    if video is not None:
        write_video(run, video, how, progress.update)
        stderr.print(f"saved {video}", markup=False)
    if frames is not None:
        write_frames(run, frames, how, progress.update)
        stderr.print(f"saved {frames}", markup=False)


def _print_errors(comparison: Comparison) -> None:
    """Print the errors of both models, as compared first, then as commanded."""
    if comparison.validation is not None:
        names = [f"{who} ({one.name})" for who, one in comparison.validation.both]
        show_table(f"{comparison.title}: as compared", ["", *names], validation_rows(comparison))
        stderr.print(comparison.validation.about, markup=False)
    errors = {"twin": comparison.misfit}
    if comparison.extended is not None:
        errors["extended twin"] = comparison.extended.misfit
    rows = [
        [who, *(f"{error:.1f}" for error in (e.foot_mm, e.top_mm, e.both_mm))]
        for who, e in errors.items()
    ]
    show_table("as commanded", ["", "foot [mm]", "T [mm]", "foot and T [mm]"], rows)
