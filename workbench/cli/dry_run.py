"""`workbench run --dry-run`: what a protocol would do, as rehearsed on a simulated supply."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from textwrap import fill
from typing import Any

from workbench.bundle import Judgement
from workbench.cli.console import progress, show_table
from workbench.cli.plain_output import emit, width
from workbench.run import Course, Experiment, Rehearsed, rehearse
from workbench.schemas import (
    Calibration,
    CalibrationFile,
    Plan,
    PlannedDrive,
    PlannedPause,
    PlannedPrompt,
    PlannedRelease,
    PlannedRun,
)

__all__ = ["show_dry_run"]


def show_dry_run(
    experiment: Experiment, as_json: bool, course: Course | None = None, registers: bool = False
) -> None:
    """Rehearse an experiment and print it.

    Args:
        experiment: plan and files.
        as_json: whether one object is wanted.
        course: of an experiment that would be resumed; its complete runs are left out.
        registers: whether each instant's writes to the supply are printed.
    """
    if course is not None:
        progress(_resumed(experiment, course))
        experiment = replace(experiment, plan=experiment.plan.without(course.done))
    plan = experiment.plan
    runs = f"{len(plan.runs)} run{'s' * (len(plan.runs) != 1)}"
    progress(
        f"{runs}, {_minutes(plan.seconds)} on the bench without the operator's time; "
        f"{plan.prompts} prompts"
    )
    progress(f"rehearse {runs} on a simulated supply")
    rehearsed = rehearse(experiment, progress.update)
    if as_json:
        resumed = None if course is None else _course(experiment, course)
        emit(_object(experiment, rehearsed) | {"resume": resumed})
        return
    seconds = _seconds(experiment, rehearsed)
    show_table(
        f"{plan.title} (runs: {len(plan.runs)}, {_minutes(seconds)}; prompts, not counted: "
        f"{plan.prompts})",
        ["run", "mode", "asked", "rest\n[s]", "ramp\n[s]", "duration\n[s]", "role"],
        [_row(run) for run in plan.runs],
    )
    for line in _between_runs(plan):
        print(fill(line, width(), subsequent_indent="    "))
    show_table("limits", ["", ""], _limits(experiment))
    if not registers:
        print("what would be written to the supply, and when: --dry-run --registers")
        return
    for one in rehearsed:
        show_table(
            f"run {one.run.number}, {one.run.name}, {one.busy:.1f} s",
            ["time [s]", "what", "written to the supply"],
            [[f"{i.time:.2f}", "; ".join(i.events), ", ".join(i.words)] for i in one.instants],
        )


def _resumed(experiment: Experiment, course: Course) -> str:
    """Return in a sentence which runs a resumed experiment would skip and carry out."""
    remaining = experiment.plan.without(course.done).runs
    again = [run.number for run in remaining if course.tries.get(run.number, 0)]
    words = f"experiment {course.id}: skipped would be {_numbers(course.done)}, made "
    words += _numbers(run.number for run in remaining)
    return words + (f"; begun before and made again: {_numbers(again)}" if again else "")


def _numbers(numbers: Iterable[int]) -> str:
    """Return runs by number, `runs 1 to 3, 7`."""
    parts: list[list[int]] = []
    for number in sorted(numbers):
        if parts and parts[-1][-1] == number - 1:
            parts[-1] = [parts[-1][0], number]
        else:
            parts.append([number])
    if not parts:
        return "none"
    several = len(parts) > 1 or len(parts[0]) > 1
    return f"run{'s' * several} " + ", ".join(" to ".join(map(str, part)) for part in parts)


def _course(remaining: Experiment, course: Course) -> dict[str, Any]:
    """Return as JSON which runs a resumed experiment would skip and carry out."""
    made = [
        {"number": run.number, "attempt": course.tries.get(run.number, 0) + 1}
        for run in remaining.plan.runs
    ]
    return {"experiment": course.id, "skipped": sorted(course.done), "made": made}


def _seconds(experiment: Experiment, rehearsed: tuple[Rehearsed, ...]) -> float:
    """Return the bench time with its pauses [s]; pauses lie between the rehearsed runs."""
    plan = experiment.plan
    pauses = plan.seconds - sum(run.rest + run.duration for run in plan.runs)
    return pauses + sum(one.busy for one in rehearsed)


def _minutes(seconds: float) -> str:
    if seconds < 120:
        return f"about {seconds:.0f} s"
    return f"about {seconds / 60:.0f} min" if seconds < 7200 else f"about {seconds / 3600:.1f} h"


def _limits(experiment: Experiment) -> list[tuple[str, str]]:
    supply = experiment.bench.content.supply
    limits, line = supply.limits, experiment.bench.content.line
    day = line.measured_on if isinstance(line, Calibration | CalibrationFile) else None
    since = "" if day is None else f" of {day}"
    return [
        ("supply", supply.model),
        ("voltage", f"at most {limits.voltage:g} V, trips at {limits.over_voltage:g} V"),
        (
            "current",
            f"at most {experiment.plan.current_limit:g} A, trips at {limits.over_current:g} A",
        ),
        ("slew", f"at most {limits.slew:g} V/s"),
        (
            "calibration",
            f"{line.id}{since}: omega = {line.slope:g} U {line.offset:+g} rad/s, "
            f"{line.lowest:g} V to {line.highest:g} V",
        ),
    ]


def _row(run: PlannedRun) -> list[str]:
    ramp = f"{run.action.ramp:.3g}" if isinstance(run.action, PlannedDrive) else ""
    times = [f"{run.rest:g}", ramp, f"{run.duration:g}"]
    return [str(run.number), run.mode, run.action.asked, *times, run.role]


def _between_runs(plan: Plan) -> Iterator[str]:
    """Yield prompts, pauses and what stops a run, each text once, with the runs it belongs to."""
    runs_of: dict[tuple[str, str], list[int]] = {}
    for items, run in plan.by_run():
        release = run.action if isinstance(run.action, PlannedRelease) else None
        texts = [
            *(("before", _text(item)) for item in (*items, *run.before)),
            *(("in", text) for text in ((release.ready, release.now) if release else ())),
            *(("after", item.text) for item in run.after),
            *((("stops", run.stop_when.words),) if run.stop_when is not None else ()),
        ]
        for key in texts:
            runs_of.setdefault(key, []).append(run.number)
    for (when, text), numbers in runs_of.items():
        yield f"{when} {_numbers(dict.fromkeys(numbers))}: {text}"


def _text(item: PlannedPrompt | PlannedPause) -> str:
    if isinstance(item, PlannedPause):
        return f"pause of {item.seconds:g} s, {item.why}"
    return item.text


def _object(experiment: Experiment, rehearsed: tuple[Rehearsed, ...]) -> dict[str, Any]:
    plan = experiment.plan
    return {
        "title": plan.title,
        "plan_id": experiment.digest,
        "seconds": _seconds(experiment, rehearsed),
        "prompts": plan.prompts,
        "warnings": plan.warnings,
        "current_limit_A": plan.current_limit,
        "limits": dict(_limits(experiment)),
        "operator": list(_between_runs(plan)),
        "runs": [
            {
                "number": one.run.number,
                "mode": one.run.mode,
                "asked": one.run.action.asked,
                "rest_s": one.run.rest,
                "ramp_s": one.run.action.ramp if isinstance(one.run.action, PlannedDrive) else None,
                "duration_s": one.run.duration,
                "role": one.run.role,
                "shape": None if one.run.shape is None else one.run.shape.name,
                "expected": [
                    f"{shown.quantity.spoken} {shown.words[-1]}"
                    for name, ends in one.run.expect
                    for shown in [Judgement(name, math.nan, *ends)]
                ],
                **_action(one.run.action),
                "instants": [
                    {"time_s": i.time, "events": i.events, "written": i.words} for i in one.instants
                ],
            }
            for one in rehearsed
        ],
    }


def _action(action: PlannedDrive | PlannedRelease) -> dict[str, Any]:
    match action:
        case PlannedDrive():
            volts = None if action.voltage is None else float(action.voltage)
            steps = [{"time_s": t, "voltage_V": float(v)} for t, v in action.steps]
            return {"speed_rad_s": action.speed, "voltage_V": volts, "steps": steps}
        case PlannedRelease():
            prompts = [action.ready, action.now]
            return {"pull_N": action.pull, "height_m": action.height, "prompts": prompts}
