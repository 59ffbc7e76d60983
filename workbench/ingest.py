"""Make bundles of runs that were measured elsewhere, as a sheet lists them."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from workbench.bundle import Bundle
from workbench.engine import Progress, versions
from workbench.errors import FileFault, FileFaults, InputError, WorkbenchError
from workbench.motion import DRIVEN
from workbench.pairing import pair
from workbench.protocol import (
    Document,
    ShapeFile,
    Sheet,
    SheetRun,
    load_model,
    load_shape,
    parse,
)
from workbench.twin import check_twin

__all__ = ["ingest_sheet"]


def ingest_sheet(sheet: Document[Sheet], root: Path, progress: Progress) -> Iterator[Bundle]:
    """Copy each take into a bundle, pair it with its twin and yield the bundle.

    Args:
        sheet: as read; paths in it are from its folder.
        root: folder of all bundles.
        progress: is told each take.

    Raises:
        FileFaults: when the sheet names takes or modes that cannot be used; nothing was written.
        WorkbenchError: when a take cannot be used; its bundle says why.
    """
    folder = sheet.path.parent
    model, shape = load_model(sheet.content.model, folder), _shape(sheet)
    _check(sheet)
    check_twin(model.content, shape.content, (run.mode for run in sheet.content.runs))
    for number, run in enumerate(sheet.content.runs, start=1):
        progress(f"{run.take}")
        bundle = Bundle.create(
            root, _name(run), datetime.now().astimezone(), _facts(sheet, run, number)
        )
        bundle.write_document("sheet", sheet.text)
        bundle.write_document("model", model.text)
        bundle.write_document("shape", shape.text)
        bundle.add_take(folder / run.take)
        try:
            pair(bundle)
        except WorkbenchError as error:
            bundle.finish("failed", error=str(error))
            error.args = (f"run {number} ({run.take}): {error}\nsee {bundle.path}",)
            raise
        bundle.finish("complete")
        yield bundle


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


def _facts(sheet: Document[Sheet], run: SheetRun, number: int) -> dict[str, Any]:
    speed = _speed(sheet, run)
    return {
        "kind": "ingest",
        "title": f"{run.mode}{'' if speed is None else f' at {speed:.2f} rad/s'}, {run.take}",
        "sheet": sheet.path.name,
        "number": number,
        "of": len(sheet.content.runs),
        "mode": run.mode,
        "role": run.role,
        "voltage_V": run.voltage,
        "speed_rad_s": speed,
        "pull_N": run.pull,
        "height_m": run.height,
        "rest_s": run.rest,
        "ramp_s": None if speed is None else run.ramp or 0.0,
        "duration_s": run.duration,
        "calibration": sheet.content.calibration.id,
        "versions": versions(),
    }


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
