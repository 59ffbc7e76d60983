"""`workbench run`: a protocol on a bench."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from workbench.bench import Operator, load_bench, make_bench
from workbench.bundle import Bundle
from workbench.cli.output import (
    JsonFlag,
    QuietOperator,
    RunsFolder,
    TerminalOperator,
    comparison_table,
    emit,
    show_table,
    tell,
)
from workbench.engine import Experiment, carry_out
from workbench.protocol import (
    BenchFile,
    Document,
    Plan,
    PlannedDrive,
    PlannedRelease,
    PlannedRun,
    Protocol,
    load,
    load_model,
    load_shape,
    make_plan,
)
from workbench.twin import check_twin

__all__ = ["describe", "experiment_of", "operator_of", "run"]

T = TypeVar("T")


def run(
    protocol: Annotated[Path, typer.Argument(help="Protocol file.")],
    bench: Annotated[str, typer.Option(help="Bench file, or `virtual`.")] = "virtual",
    dry_run: Annotated[bool, typer.Option(help="Print the plan; switch nothing.")] = False,
    runs: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Carry out a protocol: drive, track, simulate the twin, compare.

    After each run its export is awaited in the folder `tracking.takes` of the bench file: it is
    taken when it is whole and belongs to this run. Ctrl-C then asks for a path instead; Ctrl-C
    again ends, with the output off, and `workbench ingest TAKE --into RUN` adds the take later.

    Example: workbench run protocols/hop-17.yaml --bench virtual
    """
    asked, lab = load(protocol, Protocol), load_bench(bench)
    device = make_bench(lab.content)
    experiment = experiment_of(asked, lab, device.voltage_step)
    if dry_run:
        _print_plan(experiment, as_json)
        return
    done: list[Bundle] = []
    for bundle in carry_out(experiment, device, runs, operator_of(lab.content), tell):
        done.append(bundle)
        if not as_json:
            _print_bundle(bundle)
    if as_json:
        emit(_report(done))


def operator_of(bench: BenchFile) -> Operator:
    """Return who answers the prompts of a bench: nobody has to where it is virtual."""
    return TerminalOperator() if bench.virtual is None else QuietOperator()


def describe(bundle: Bundle) -> dict[str, Any]:
    """Return a bundle's JSON object: path, status, real, twin, error."""
    facts = bundle.manifest
    keys = ("status", "mode", "role", "real", "twin", "error_mm", "error_foot_mm", "error_top_mm")
    return {"bundle": str(bundle.path)} | {key: facts.get(key) for key in (*keys, "warnings")}


def experiment_of(
    asked: Document[Protocol], lab: Document[BenchFile], voltage_step: Decimal
) -> Experiment:
    """Return a protocol as a bench would carry it out, with the robot that either names."""
    own, other = (asked.path.parent, lab.path.parent)
    model = _first(load_model, (asked.content.model, own), (lab.content.model, other))
    shape = _first(load_shape, (asked.content.shape, own), (lab.content.shape, other))
    plan = make_plan(asked, lab.content, voltage_step)
    check_twin(model.content, shape.content, (run.mode for run in plan.runs))
    return Experiment(asked, lab, model, shape, plan)


def _first(
    read: Callable[[str, Path], T], own: tuple[str | None, Path], default: tuple[str, Path]
) -> T:
    """Read what the protocol names, else what the bench names, each beside its own file."""
    name, beside = own
    return read(*default) if name is None else read(name, beside)


def _report(done: list[Bundle]) -> dict[str, Any]:
    """Return one run's object, or all of them; a single run needs no list to be read."""
    every = [describe(bundle) for bundle in done]
    return (every[0] if len(every) == 1 else {}) | {"runs": every}


def _print_bundle(bundle: Bundle) -> None:
    comparison_table(bundle.manifest)
    for warning in bundle.manifest["warnings"]:
        print(f"note: {warning}")
    print(f"bundle:    {bundle.path}")
    print(f"report:    {bundle.view('report')}")
    print(f"recording: workbench review {bundle.path}")


def _print_plan(experiment: Experiment, as_json: bool) -> None:
    plan = experiment.plan
    if as_json:
        emit(_plan_object(plan))
        return
    show_table(
        f"{plan.title} (runs: {len(plan.runs)}, about {plan.seconds:.0f} s, "
        f"current limit {plan.current_limit:g} A)",
        ["run", "mode", "asked", "rest [s]", "ramp [s]", "duration [s]", "role"],
        [_plan_row(run) for run in plan.runs],
    )


def _plan_row(run: PlannedRun) -> list[str]:
    match run.action:
        case PlannedDrive() as drive:
            asked, ramp = f"{drive.voltage} V, {drive.speed:.3f} rad/s", f"{drive.ramp:g}"
        case PlannedRelease() as release:
            asked, ramp = release.asked, ""
    times = [f"{run.rest:g}", ramp, f"{run.duration:g}"]
    return [str(run.number), run.mode, asked, *times, run.role]


def _plan_object(plan: Plan) -> dict[str, Any]:
    return {
        "title": plan.title,
        "seconds": plan.seconds,
        "current_limit_A": plan.current_limit,
        "runs": [
            {
                "number": run.number,
                "mode": run.mode,
                "rest_s": run.rest,
                "duration_s": run.duration,
                "role": run.role,
            }
            | _action_object(run.action)
            for run in plan.runs
        ],
    }


def _action_object(action: PlannedDrive | PlannedRelease) -> dict[str, Any]:
    match action:
        case PlannedDrive():
            steps = [{"time_s": t, "voltage_V": float(v)} for t, v in action.steps]
            numbers = {"speed_rad_s": action.speed, "voltage_V": float(action.voltage)}
            return {**numbers, "steps": steps}
        case PlannedRelease():
            prompts = [action.ready, action.now]
            return {"pull_N": action.pull, "height_m": action.height, "prompts": prompts}
