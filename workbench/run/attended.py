"""An experiment with a control server: seen, answered and stopped from the panel too."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

from workbench.bundle import Bundle, add_remark
from workbench.progress import Progress
from workbench.run.bench import Bench, Operator
from workbench.run.between import Choice
from workbench.run.control import ControlServer, open_control_server
from workbench.run.course import Course, begin
from workbench.run.engine import carry_out
from workbench.run.experiment import Experiment
from workbench.run.started_by import operator_name, start_id
from workbench.schemas import BenchFile, Item, PlannedPause, PlannedRun

__all__ = ["DrawViews", "OperatorAt", "carry_out_with_control"]

OperatorAt = Callable[[BenchFile, ControlServer], Operator]
"""Returns who answers the prompts of a bench, which a control server shows elsewhere too."""

DrawViews = Callable[[Bundle, Progress], list[str]]
"""Draws recording and report of a sealed bundle, and returns what could not be drawn and why."""


def carry_out_with_control(
    experiment: Experiment,
    bench: Bench,
    runs: Path,
    operator_at: OperatorAt,
    progress: Progress,
    draw: DrawViews,
    course: Course | None = None,
    pause: bool = False,
) -> Iterator[tuple[Bundle, list[str]]]:
    """Do what is planned and not yet done, where the panel can see it.

    Args:
        experiment: plan and files.
        bench: what it is done on.
        runs: folder of all bundles.
        operator_at: returns who answers the prompts.
        progress: receives each stage.
        draw: draws the views of each sealed bundle.
        course: of an experiment that was begun; None begins one.
        pause: whether to ask after each run what is done next; otherwise after one where somebody
            asked for it in the panel.

    Yields:
        Each sealed bundle, and what of its views could not be drawn.

    Raises:
        InputError: when another process carries this experiment out.
        WorkbenchError: as `carry_out`.
    """
    now = datetime.now()
    course = course or begin(experiment.inputs(), now)
    with open_control_server(runs, course.id, _facts(experiment, course, now)) as server:
        operator = operator_at(bench.file, server)
        bench.on_live_state = lambda now: server.show_live(None if now is None else asdict(now))

        def show(text: str) -> None:
            server.show_phase(text)
            progress(text)

        between = _Between(experiment, server, operator, progress, pause)
        for bundle in carry_out(experiment, bench, runs, operator, show, course, between):
            yield bundle, draw(bundle, show)


class _Between:
    """Asks the operator between two runs, where that was asked for."""

    def __init__(
        self,
        experiment: Experiment,
        server: ControlServer,
        operator: Operator,
        progress: Progress,
        always: bool,
    ) -> None:
        self._of = len(experiment.plan.runs)
        self._server, self._operator = server, operator
        self._progress, self._always = progress, always
        self._skipped = False

    def __call__(self, bundle: Bundle, run: PlannedRun, following: PlannedRun | None) -> Choice:
        """Return what is done next, and keep with the run that it was chosen."""
        if not (self._always or self._server.pausing or self._skipped):
            return "go on"
        self._server.want_pause(False)
        if not self._operator.present:
            self._progress("nobody is there to be asked what is done next; going on")
            return "go on"
        words = self._words(run, following)
        choice = self._choose(run, following, words)
        self._skipped = choice == "skip"
        who, now = operator_name(), datetime.now().astimezone()
        add_remark(bundle.path, "note", f"paused after this run, then: {words[choice]}", who, now)
        if choice == "end" and following is not None:
            self._server.outcome = "ended"
        return choice

    def _words(self, run: PlannedRun, following: PlannedRun | None) -> dict[Choice, str]:
        if following is None:
            return {"end": "end", "repeat": f"repeat run {run.number}"}
        return {
            "go on": f"go on with run {following.number}",
            "skip": f"skip run {following.number}",
            "repeat": f"repeat run {run.number}",
            "end": "end here",
        }

    def _choose(
        self, run: PlannedRun, following: PlannedRun | None, words: Mapping[Choice, str]
    ) -> Choice:
        """Ask until the answer is one of the words, or the beginning of one alone."""
        after = "it is the last" if following is None else f"next is {following.name}"
        text = f"Paused after run {run.number} of {self._of}, {run.name}; {after}."
        asked = f"{text} [{', '.join(words.values())}]"
        while True:
            typed = self._operator.ask(asked, "", tuple(words.values())).strip().casefold()
            meant: list[Choice] = [
                one for one, phrase in words.items() if typed and phrase.startswith(typed)
            ]
            if len(meant) == 1:
                return meant[0]
            among = ", ".join(words.values())
            self._operator.show_text(f"not taken: {typed!r} is not one of {among}")


def _facts(experiment: Experiment, course: Course, now: datetime) -> dict[str, Any]:
    """Return the facts of the session file; the panel computes the remaining time from them."""
    plan = experiment.plan.without(course.done)
    return {
        "title": experiment.plan.title,
        "protocol": str(experiment.protocol.path),
        "bench": experiment.bench.content.name,
        "operator": operator_name(),
        "start": start_id(),
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
