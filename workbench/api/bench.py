"""Runs that are made here: on a virtual bench, or of data that were measured elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from workbench.api.runs import Run, Runs
from workbench.errors import InputError

if TYPE_CHECKING:
    from workbench.progress import Progress

__all__ = ["ingest_sheet", "run_protocol"]


def run_protocol(
    protocol: str | Path,
    bench: str | Path = "virtual",
    folder: str | Path = "runs",
    progress: Progress = lambda text: None,
) -> Runs:
    """Carry out a protocol on a virtual bench: drive, track, simulate the twin, compare.

    A bench with a supply needs a person who answers its prompts and can stop it: that is
    `workbench run`. Report and recording are drawn by `workbench review RUN`.

    Args:
        protocol: path of the file.
        bench: `virtual`, or path of a bench file with a section `virtual`.
        folder: of all runs.
        progress: called with each stage, such as `print`.

    Raises:
        InputError: when the bench is a real one, or a file is missing.
        FileFaults: with every fault of a file, with line and column.
        WorkbenchError: when a run failed; its folder holds what there is, and why.

    Example:
        >>> (run,) = wb.run_protocol("protocols/hop-17.yaml", progress=print)
    """
    from workbench.run import QuietOperator, carry_out, load_bench, make_bench, read_experiment

    lab = load_bench(str(bench))
    if lab.content.virtual is None:
        raise InputError(
            f"{lab.path}: bench {lab.content.name!r} drives a motor, and only virtual benches run "
            f"from Python; type `workbench run {protocol} --bench {bench}`, which asks and can be "
            "stopped"
        )
    device = make_bench(lab.content)
    asked = read_experiment(Path(protocol), lab, device.voltage_step)
    return Runs(map(Run, carry_out(asked, device, Path(folder), QuietOperator(progress), progress)))


def ingest_sheet(
    sheet: str | Path, folder: str | Path = "runs", progress: Progress = lambda text: None
) -> Runs:
    """Make runs of takes that were measured elsewhere, each with its twin.

    Args:
        sheet: path of the YAML file that lists the takes.
        folder: of all runs.
        progress: called with each take, such as `print`.

    Raises:
        FileFaults: with every fault of the sheet; nothing was written.
        WorkbenchError: when a take cannot be used; its folder says why.

    Example:
        >>> wb.ingest_sheet("april/sheet.yaml").table().to_pandas()
    """
    from workbench.run import ingest_sheet as ingest
    from workbench.schemas import Sheet, load

    return Runs(map(Run, ingest(load(Path(sheet), Sheet), Path(folder), progress)))
