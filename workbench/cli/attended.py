"""An experiment at a desk: seen, answered and stopped from the panel as well as from here."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from workbench.bench import Bench, Operator
from workbench.bundle import Bundle
from workbench.cli.keyboard import Keyboard
from workbench.cli.output import QuietOperator, TerminalOperator, tell
from workbench.desk import Desk, open_desk
from workbench.engine import carry_out
from workbench.experiment import Experiment
from workbench.protocol import BenchFile, Item, PlannedPause, PlannedRun
from workbench.resume import Course, begin

__all__ = ["carry_out_at_desk", "operator_of"]


def carry_out_at_desk(
    experiment: Experiment, bench: Bench, runs: Path, course: Course | None = None
) -> Iterator[Bundle]:
    """Do what is planned and not yet done, where the panel can see it; yield each bundle.

    Args:
        experiment: plan and files.
        bench: what it is done on.
        runs: folder of all bundles.
        course: of an experiment that was begun; None begins one.

    Raises:
        InputError: when another process carries this experiment out.
        WorkbenchError: as `carry_out`.
    """
    now = datetime.now()
    course = course or begin(experiment.inputs(), now)
    with open_desk(runs, course.id, _facts(experiment, course, now)) as desk:
        operator = operator_of(bench.file, desk)

        def show(text: str) -> None:
            desk.show_phase(text)
            tell(text)

        yield from carry_out(experiment, bench, runs, operator, show, course)


def operator_of(bench: BenchFile, desk: Desk) -> Operator:
    """Return who answers the prompts of a bench.

    On a virtual one nobody, unless it runs in real time: then it is there to practise.
    """
    if bench.virtual is None:
        return TerminalOperator(desk, Keyboard())
    if bench.virtual.real_time:
        return TerminalOperator(desk, Keyboard(), needed=False)
    return QuietOperator()


def _facts(experiment: Experiment, course: Course, now: datetime) -> dict[str, Any]:
    """Return what the card says, besides where the desk is; the panel tells the time left by it."""
    plan = experiment.plan.without(course.done)
    return {
        "title": experiment.plan.title,
        "protocol": str(experiment.protocol.path),
        "bench": experiment.bench.content.name,
        "began": now.astimezone().isoformat(timespec="milliseconds"),
        "runs": len(experiment.plan.runs),
        "items": [fact for item in plan.items if (fact := _item(item))],
    }


def _item(item: Item) -> dict[str, Any] | None:
    match item:
        case PlannedRun(number=number, name=name, rest=rest, duration=duration):
            return {"number": number, "name": name, "asked": item.action.asked,
                    "rest_s": rest, "seconds": rest + duration}  # fmt: skip
        case PlannedPause(seconds=seconds, why=why):
            return {"why": why, "seconds": seconds}
        case _:
            return None
