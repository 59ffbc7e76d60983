"""`workbench thesis`: the thesis' experiments again, beside its numbers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.console import progress, show_table, stderr
from workbench.cli.number_option import number
from workbench.cli.plain_output import JsonFlag, SchedulerOption, SearchesFolder, emit
from workbench.design import ALGORITHMS, BOUNDS, Settings
from workbench.errors import InputError, WorkbenchError, require_named
from workbench.report import EXPERIMENTS, SEEDS, SPEEDS, ExperimentTable, Lab, write_experiment
from workbench.schemas import load_model, load_shape
from workbench.sim import Fanout

__all__ = ["thesis"]

_QUICK = {"duration": 1.0, "evaluations": 24}
_QUICK_SEEDS, _QUICK_SPEEDS = SEEDS[:2], SPEEDS[:2]


def thesis(
    experiment: Annotated[str, typer.Argument(help=f"One of {', '.join(EXPERIMENTS)}.")],
    algorithm: Annotated[
        str, typer.Option(help=f"One of {', '.join(a for a in ALGORITHMS if a != 'pareto')}.")
    ] = "ga",
    bounds: Annotated[str, typer.Option(help=f"One of {', '.join(BOUNDS)}.")] = "thesis",
    evaluations: Annotated[int, typer.Option(help="Of each search.", min=1)] = 480,
    duration: Annotated[
        float, typer.Option(help="Of a hop [s].", parser=number("time", "s", 0.1, 600))
    ] = 10.0,
    model: Annotated[str, typer.Option(help="Model name or file.")] = "thesis",
    shape: Annotated[
        str, typer.Option(help="Shape to begin at; by default that of the thesis' Appendix E.")
    ] = "thesis-ga-start",
    out: Annotated[
        Path | None, typer.Option(help="Folder of these searches; by default thesis.")
    ] = None,
    searches: SearchesFolder = Path("searches"),
    quick: Annotated[bool, typer.Option("--quick", help="Hops of 1 s, few candidates.")] = False,
    scheduler: SchedulerOption = None,
    as_json: JsonFlag = False,
) -> None:
    """Do an experiment of the thesis again and print it beside the thesis' numbers.

    Searches that are in the folder already are read or resumed, so this can be stopped.

    Example: workbench thesis repeatability
    """
    require_named("experiment", experiment, EXPERIMENTS)
    settings = Settings(
        duration=duration, algorithm=algorithm, bounds=bounds, evaluations=evaluations
    )
    seeds, speeds = SEEDS, SPEEDS
    if quick:
        settings, seeds, speeds = replace(settings, **_QUICK), _QUICK_SEEDS, _QUICK_SPEEDS
    with Fanout(scheduler) as fanout:
        stated, start = load_model(model, Path()), load_shape(shape, Path())
        folder = out or searches / "thesis"
        lab = Lab(folder, settings, stated, start, fanout, progress.update, progress)
        try:
            parts = list(EXPERIMENTS[experiment](lab, seeds, speeds))
        except (KeyboardInterrupt, WorkbenchError) as error:
            if not isinstance(error, InputError):
                stderr.print("the same command goes on where this was stopped")
            raise
    page = folder / f"{experiment}.html"
    hops = f"{settings.evaluations} hops of {settings.duration:g} s"
    about = f"searches by {settings.algorithm}, {hops} each, begun at {shape}"
    write_experiment(page, experiment, about, parts)
    tables = [part for part in parts if isinstance(part, ExperimentTable)]
    if as_json:
        found = [table._asdict() for table in tables]
        emit({"experiment": experiment, "tables": found, "report": str(page)})
        return
    for table in tables:
        _show(table)
    stderr.print(f"report: {page}", markup=False)


def _show(table: ExperimentTable) -> None:
    show_table(table.title, table.heads, table.rows)
    if table.note:
        print(f"thesis: {table.note}")
