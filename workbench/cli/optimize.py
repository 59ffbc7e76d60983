"""`workbench optimize`: better shapes for a speed, and other numbers of the robot."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.console import progress, show_table, stderr
from workbench.cli.number_option import number
from workbench.cli.plain_output import JsonFlag, SchedulerOption, SearchesFolder, emit
from workbench.design import ALGORITHMS, BOUNDS, GOALS, LEAST_RADIUS_M, MUTATIONS, Settings, Study
from workbench.errors import InputError, WorkbenchError
from workbench.quantities import unit_of
from workbench.report import Searched, finish_search, search_folder
from workbench.schemas import load_model, load_shape
from workbench.sim import Fanout

__all__ = ["optimize"]

_WITH_RESUME = {"resume", "evaluations", "scheduler", "patience", "as_json"}
"""Options that may be given together with --resume; the others define the search."""


def optimize(
    context: typer.Context,
    omega: Annotated[
        float, typer.Option(help="Rotor speed [rad/s].", parser=number("speed", "rad/s"))
    ] = 17.0,
    algorithm: Annotated[str, typer.Option(help=f"One of {', '.join(ALGORITHMS)}.")] = "guided",
    goal: Annotated[
        str, typer.Option(help=f"One of {', '.join(GOALS)}; two with a comma between: pareto.")
    ] = "distance",
    vary: Annotated[
        list[str] | None,
        typer.Option(help="NAME=LOWER:UPPER, SI: omega or a parameter of the model. Repeatable."),
    ] = None,
    robust: Annotated[
        bool, typer.Option("--robust", help="Judge by mean and spread over what may be built.")
    ] = False,
    draws: Annotated[int, typer.Option(help="Robots for one candidate, --robust.", min=2)] = 8,
    bounds: Annotated[str, typer.Option(help=f"One of {', '.join(BOUNDS)}.")] = "thesis",
    mutation: Annotated[
        str, typer.Option(help=f"Of ga, one of {', '.join(MUTATIONS)}.")
    ] = "adaptfeasible",
    seed: Annotated[int, typer.Option(help="The same seed, the same search.", min=0)] = 0,
    evaluations: Annotated[int, typer.Option(help="Candidates to try.", min=1)] = 480,
    duration: Annotated[
        float, typer.Option(help="Of a hop [s].", parser=number("time", "s", 0.1, 600))
    ] = 10.0,
    model: Annotated[str, typer.Option(help="Model name or file.")] = "thesis",
    shape: Annotated[str, typer.Option(help="Shape to begin at, name or file.")] = "thesis-initial",
    thickness: Annotated[
        float | None,
        typer.Option(
            help="Of the strip [mm]; by default the shape's.", parser=number("length", "mm", 0)
        ),
    ] = None,
    min_radius: Annotated[
        float,
        typer.Option(help="Tightest bend that can be made [mm].", parser=number("length", "mm", 0)),
    ] = 1e3 * LEAST_RADIUS_M,
    out: Annotated[
        Path | None, typer.Option(help="Folder of this search; by default named by the time.")
    ] = None,
    searches: SearchesFolder = Path("searches"),
    resume: Annotated[
        Path | None, typer.Option(help="Go on with the search of this folder or file.")
    ] = None,
    scheduler: SchedulerOption = None,
    patience: Annotated[
        float, typer.Option(help="Wait so long for a lost scheduler or workers [s].", min=0)
    ] = 600.0,
    as_json: JsonFlag = False,
) -> None:
    """Search for a beam that hops farther, or is better in another way.

    The folder holds the best shape, every candidate, a report, and all that --resume needs.

    Example: workbench optimize --omega 17 --seed 1

    Example: workbench optimize --algorithm pareto --goal distance,cost

    Example: workbench optimize --resume searches/2026-11-21_143000
    """
    begin = time.perf_counter()
    if resume is not None:
        study = _resumed(context, resume, evaluations)
    else:
        settings = Settings(
            omega, duration, algorithm, tuple(goal.split(",")), bounds, tuple(vary or ()), robust,
            draws, seed, evaluations, mutation, None if thickness is None else thickness / 1e3,
            min_radius / 1e3,
        )  # fmt: skip
        folder = out or search_folder(searches)
        study = Study.begin(folder, settings, load_model(model, Path()), load_shape(shape, Path()))
    with _fanout(study, scheduler, patience) as fanout:
        history = study.run(fanout, progress.update)
    progress("write the report")
    done = finish_search(study, history)
    if as_json:
        emit(done.as_json() | {"wall_s": time.perf_counter() - begin})
        return
    _show(done)
    stderr.print(f"report: {done.report}", markup=False)


@contextmanager
def _fanout(study: Study, scheduler: str | None, patience: float) -> Iterator[Fanout]:
    """Yield the workers of a search; where it ends early, say how to resume it."""
    progress(f"search by {study.settings.algorithm}, {study.settings.evaluations} candidates")
    try:
        with Fanout(scheduler, patience=patience) as fanout:
            yield fanout
    except KeyboardInterrupt:
        if study.checkpoint.exists():
            stderr.print(f"go on with: workbench optimize --resume {study.folder}", markup=False)
        raise
    except InputError:
        raise
    except WorkbenchError as error:
        raise WorkbenchError(
            f"{error}. Nothing that was finished is lost; go on with: workbench optimize "
            f"--resume {study.folder}" + (f" --scheduler {scheduler}" if scheduler else "")
        ) from error


def _resumed(context: typer.Context, path: Path, evaluations: int) -> Study:
    """Return the search of a folder; options that would change it are refused."""
    sources = {name: context.get_parameter_source(name) for name in context.params}
    given = [name for name, source in sources.items() if source and source.name == "COMMANDLINE"]
    other = [f"--{name.replace('_', '-')}" for name in given if name not in _WITH_RESUME]
    if other:
        raise InputError(
            f"--resume goes on with the search as it was begun; leave out {', '.join(other)}, or "
            "begin another search without --resume"
        )
    study = Study.resume(path)
    if "evaluations" in given:
        study = replace(study, settings=replace(study.settings, evaluations=evaluations))
    return study


def _show(done: Searched) -> None:
    rows = [
        [one.name, *(f"{one.values.get(g.column, float('nan')):.4g}" for g in GOALS.values())]
        for one in done.found
    ]
    heads = ["design", *(f"{name} [{unit_of(g.column)[1] or '-'}]" for name, g in GOALS.items())]
    title = f"{done.study.problem.words}: {done.history.asked} evaluations"
    show_table(title, heads, rows)
    print(f"distance spread of {done.found[0].name}: {done.spread.text()}")
