"""Make bundles of runs that were measured elsewhere; add a take to a run without one."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

from workbench.bundle import Asked, Bundle, Measured, events, verify
from workbench.errors import FileFault, FileFaults, InputError, WorkbenchError
from workbench.motion import DRIVEN
from workbench.progress import Progress, counted
from workbench.run.started_by import operator_name
from workbench.run.takes import CameraTime, judge
from workbench.schemas import (
    BenchFile,
    Document,
    ShapeFile,
    Sheet,
    SheetRun,
    load,
    load_model,
    load_shape,
    parse,
)
from workbench.versions import versions

__all__ = ["add_take", "ingest_sheet"]


def ingest_sheet(sheet: Document[Sheet], root: Path, progress: Progress) -> Iterator[Bundle]:
    """Copy each take into a bundle, pair it with its twin and yield the bundle.

    Args:
        sheet: as read; paths in it are from its folder.
        root: folder of all bundles.
        progress: receives each take.

    Raises:
        FileFaults: when the sheet names takes or modes that cannot be used; nothing was written.
        WorkbenchError: when a take cannot be used; its bundle says why.
    """
    from workbench.twin import (
        check_twin,
        compare_with_twin,  # with simulation: rarely needed
    )

    folder = sheet.path.parent
    model, shape = load_model(sheet.content.model, folder), _shape(sheet)
    _check(sheet)
    check_twin(model.content, shape.content, (run.mode for run in sheet.content.runs))
    for number, run in enumerate(sheet.content.runs, start=1):
        progress(counted(str(run.take), number, len(sheet.content.runs)))
        bundle = Bundle.create(
            root,
            _name(run),
            datetime.now().astimezone(),
            _asked(sheet, run, number, model.content.name, shape.content.name),
        )
        bundle.write_document("sheet", sheet.text)
        bundle.write_document("model", model.text)
        bundle.write_document("shape", shape.text)
        bundle.add_take(folder / run.take)
        try:
            compare_with_twin(bundle)
        except WorkbenchError as error:
            bundle.finish("failed", error=str(error))
            error.args = (f"run {number} ({run.take}): {error}\nsee {bundle.path}",)
            raise
        bundle.finish("complete")
        yield bundle


def add_take(take: Path, bundle: Bundle, progress: Progress, insist: bool = False) -> None:
    """Give a run without a take its take, compare it with its twin and finish it.

    Args:
        take: the export; checked as at the bench.
        bundle: of a run that was measured, but whose take did not come.
        progress: receives what begins.
        insist: take it although it does not seem to belong; the bundle says so.

    Raises:
        InputError: when the run needs no take, was changed, or the take does not belong to it;
            nothing was written.
        WorkbenchError: when the take cannot be used; the bundle says why.
    """
    from workbench.twin import compare_with_twin

    wanted = _wanted(bundle)
    tolerance = load(bundle.document("bench"), BenchFile).content.tracking.takes_tolerance
    verdict = judge(take, wanted, tolerance)
    if not verdict.belongs and not (insist and verdict.readable):
        hint = "\n--insist adds it all the same" if verdict.readable else ""
        raise InputError("\n".join(verdict.reasons) + hint)
    since = (datetime.now() - wanted.began).total_seconds()
    added = events.TakeAdded(file=str(take), notes=tuple(verdict.notes))
    bundle.record.journal(added, since)
    if verdict.reasons:
        bundle.record.note(Measured(take_forced=tuple(verdict.reasons)))
    bundle.add_take(take)
    progress("track, twin")
    try:
        compare_with_twin(bundle)
    except WorkbenchError as error:
        bundle.finish("failed", error=str(error))
        error.args = (f"{error}\nsee {bundle.path}",)
        raise
    bundle.finish("complete")


def _wanted(bundle: Bundle) -> CameraTime:
    """Return what the take of an unfinished run has to show; refuse every other bundle."""
    cameras, asked = bundle.manifest.measured.cameras, bundle.manifest.asked
    if cameras is None:
        kind = "unknown" if asked is None else asked.kind
        raise InputError(
            f"{bundle.path}: no take can be added; it is no run that was measured to its end "
            f"(kind {kind}, status {bundle.manifest.status})"
        )
    if bundle.has_take():
        raise InputError(
            f"{bundle.path}: holds a take already, {bundle.take().name}, and a take is never "
            "replaced; make a new bundle of the other with a sheet"
        )
    problems = verify(bundle.path) if bundle.is_closed() else []
    if problems:
        raise InputError(f"{bundle.path}: changed since the run: {'; '.join(problems)}")
    return CameraTime(cameras.began, cameras.seconds)


def _check(sheet: Document[Sheet]) -> None:
    faults: list[FileFault] = []
    for i, run in enumerate(sheet.content.runs):
        if not (sheet.path.parent / run.take).is_file():
            faults.append(sheet.fault(("runs", i, "take"), f"no such file {run.take!r}"))
        if run.voltage is not None:
            try:
                sheet.content.calibration.speed(run.voltage)
            except InputError as error:
                faults.append(sheet.fault(("runs", i, "voltage"), str(error)))
    if faults:
        raise FileFaults(faults)


def _speed(sheet: Document[Sheet], run: SheetRun) -> float | None:
    """Return the rotor's speed that was asked for [rad/s], None where nothing drives it."""
    if run.mode not in DRIVEN:
        return None
    if run.omega is not None:
        return run.omega
    return sheet.content.calibration.speed(run.voltage or 0.0)


def _name(run: SheetRun) -> str:
    return f"{run.mode}-{Path(run.take).stem.replace(' ', '_')[:40]}"


def _asked(sheet: Document[Sheet], run: SheetRun, number: int, model: str, shape: str) -> Asked:
    speed = _speed(sheet, run)
    pull = run.pull if isinstance(run.pull, tuple) else (run.pull, None)
    return Asked(
        kind="ingest",
        title=f"{run.mode}{'' if speed is None else f' at {speed:.2f} rad/s'}, {run.take}",
        sheet=sheet.path.name,
        number=number,
        of=len(sheet.content.runs),
        mode=run.mode,
        role=run.role,
        model=model,
        shape=shape,
        operator=operator_name(),
        voltage_V=run.voltage,
        speed_rad_s=speed,
        pull_N=pull[0],
        pull_up_N=pull[1],
        height_m=run.height,
        rest_s=run.rest,
        ramp_s=None if speed is None else run.ramp or 0.0,
        duration_s=run.duration,
        calibration=sheet.content.calibration.id,
        versions=versions(),
    )


def _shape(sheet: Document[Sheet]) -> Document[ShapeFile]:
    """Return the shape; angles listed in the sheet become a file of their own."""
    shape, folder = sheet.content.shape, sheet.path.parent
    if isinstance(shape, str):
        return load_shape(shape, folder)
    initial = load_shape("thesis-initial", folder).content
    text = (
        f"schema: workbench/shape-1\nname: from {sheet.path.name}\nangles: {list(shape)}\n"
        f"length: {initial.length * 1000:.3f} mm\nstate: unloaded\n"
        f"source: listed in {sheet.path.name}; length as in the thesis\n"
    )
    return parse(sheet.path, text, ShapeFile)
