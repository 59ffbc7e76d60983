"""Carry out a plan on a bench: journal, prompts, one bundle a run, the output always ends off.

A run without a drive leaves the supply alone: it is neither opened nor asked anything.
"""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Literal

from workbench.bundle import Asked, Bundle, CameraWindow, Event, Measured, SupplyIdentity, events
from workbench.errors import Interrupted, RecordError, SafetyStop, WorkbenchError
from workbench.hw import Reading, Supply, stop, switch_on, watch
from workbench.live import LiveTask, LiveTwin, NoTwin
from workbench.output import BY_HAND, MAY_BE_ON
from workbench.progress import Progress, Stage, within
from workbench.run.bench import BUILT_IN, Bench, CameraSpan, Operator, Subject
from workbench.run.bench_supply import check_new_scale, made_ready, require_not_latched
from workbench.run.between import Between, Part, go_on, what_follows
from workbench.run.course import Course, begin
from workbench.run.experiment import Experiment, condition_facts
from workbench.run.prompting import PromptAnswer, ask
from workbench.run.readiness import require_room
from workbench.run.started_by import operator_name, started
from workbench.schemas import (
    CalibrationFile,
    PlannedDrive,
    PlannedPause,
    PlannedPrompt,
    PlannedRelease,
    PlannedRun,
    calibration_text,
)
from workbench.signals import Signals
from workbench.timeseries import TimeSeries
from workbench.twin import compare_with_twin
from workbench.versions import versions

__all__ = ["carry_out"]

_Ended = Literal["failed", "interrupted", "safety-stop"]
_POLL_S = 0.2
_HAND_S = 1.5  # a person lets go within this time of being asked


def carry_out(
    experiment: Experiment,
    bench: Bench,
    root: Path,
    operator: Operator,
    progress: Progress,
    course: Course | None = None,
    between: Between = go_on,
) -> Iterator[Bundle]:
    """Do what is planned and not yet done, in order; yield each run's bundle when it is complete.

    A run that is repeated is another attempt; its prompts and pauses are repeated with it. One that
    is skipped is left to be made when the experiment is resumed.

    Args:
        experiment: plan and files.
        bench: what it is done on.
        root: folder of all bundles.
        operator: answers the prompts.
        progress: receives each phase.
        course: of an experiment that was begun; None begins one.
        between: is asked after each run.

    Raises:
        SafetyStop: when a limit or a protection ended a run, or nobody acknowledged that of an
            earlier one.
        Interrupted: on Ctrl-C; the output is off and the bundle says so.
        InputError: when no run can be written to `root`, before anybody is asked anything.
        HardwareError: when the bench is not ready, likewise.
        WorkbenchError: when a run failed; its bundle holds what there is, and why.
    """
    if experiment.plan.drives:
        require_not_latched(bench.ledgers(), bench.file.name, experiment.bench.path)
    require_room(root)
    bench.require_ready(experiment.plan.drives)
    course = course or begin(experiment.inputs(), datetime.now())
    remaining, busy = experiment.plan.without(course.done), 0.0
    waiting: Sequence[Part] = remaining.by_run()
    while waiting:
        answers: list[PromptAnswer] = []
        items, run = waiting[0]
        for item in items:
            match item:
                case PlannedPrompt():
                    answers.append(ask(operator, item))
                case PlannedPause():
                    _wait(bench, item, progress)
        of, share = len(experiment.plan.runs), min(busy / remaining.seconds, 1.0)
        of_run = within(progress, f"run {run.number} of {of}: ", share if of > 1 else None)
        bundle = _Conductor(experiment, bench, root, operator, of_run, run, course).conduct(answers)
        yield bundle
        busy, course = busy + run.rest + run.duration, course.after(run.number)
        waiting = what_follows(waiting, bundle, between)


def _wait(bench: Bench, pause: PlannedPause, progress: Progress) -> None:
    """Wait with the output off."""
    progress(Stage(f"{pause.why}: {pause.seconds:g} s", seconds=pause.seconds))
    bench.clock.sleep(pause.seconds)


class _Conductor:
    """One run, from the empty bundle to the finished one."""

    def __init__(
        self,
        experiment: Experiment,
        bench: Bench,
        root: Path,
        operator: Operator,
        progress: Progress,
        run: PlannedRun,
        course: Course,
    ) -> None:
        self.experiment, self.bench, self.run = experiment, bench, run
        self.operator, self.progress, self.course = operator, progress, course
        self.shape = experiment.shape_of(run)
        self.readings: list[Reading] = []
        self.signals = Signals()
        self.twin: LiveTwin | NoTwin = NoTwin()
        self.start = bench.clock.now()
        self.bundle = Bundle.create(root, run.name, datetime.now().astimezone(), self._asked())

    def conduct(self, answers: Sequence[PromptAnswer]) -> Bundle:
        with self.signals:
            try:
                try:
                    self._carry_out(answers)
                finally:
                    self.signals.hold()  # a second Ctrl-C would cut off what follows the first
            except KeyboardInterrupt:
                self._end("interrupted", "stopped by the user")
                raise Interrupted(self._failure_text("stopped by the user")) from None
            except SafetyStop as error:
                self._end("safety-stop", str(error))
                error.args = (self._failure_text(str(error)),)
                raise
            except WorkbenchError as error:
                self._end("failed", str(error))
                error.args = (self._failure_text(str(error)),)
                raise
            except Exception:
                self._end("failed", traceback.format_exc())
                raise
            finally:
                self.bench.stop_cameras()
            self._journal(events.Complete())
            self.bundle.finish("complete")
        return self.bundle

    def _carry_out(self, answers: Sequence[PromptAnswer]) -> None:
        """Do all that the run asks for, from its inputs in the bundle to its pair."""
        self._keep_inputs()
        for one in answers:
            self._keep(one)
        self._ask(self.run.before)
        take = self._measure()
        self._ask(self.run.after)
        if take is not None:
            self.bundle.add_take(take)
            self.progress("track, twin")
            compare_with_twin(self.bundle)

    def _asked(self) -> Asked:
        run, protocol = self.run, self.experiment.protocol
        facts = condition_facts(run.action)
        facts |= {"expect": dict(run.expect)} if run.expect else {}
        return Asked(
            kind="run",
            title=protocol.content.title,
            protocol=protocol.path.name,
            number=run.number,
            of=len(self.experiment.plan.runs),
            mode=run.mode,
            role=run.role,
            model=self.experiment.model.content.name,
            shape=self.shape.content.name,
            operator=operator_name(),
            repeat=run.repeat,
            experiment=self.course.id,
            inputs=dict(self.course.inputs),
            attempt=self.course.attempt(run.number),
            rest_s=run.rest,
            duration_s=run.duration,
            **facts,
            bench=self.experiment.bench.content.name,
            calibration=self.experiment.bench.content.line.id,
            versions=versions(),
        )

    def _keep_inputs(self) -> None:
        experiment = self.experiment
        for kind in ("protocol", "bench", "model"):
            self.bundle.write_document(kind, getattr(experiment, kind).text)
        self.bundle.write_document("shape", self.shape.text)
        line = experiment.bench.content.line
        if isinstance(line, CalibrationFile):  # the bench names it; the bundle needs it beside
            self.bundle.write_document("calibration", calibration_text(line))
        parts = {one.path.name: one.content.model_dump() for one in experiment.parts.values()}
        resolved = experiment.protocol.content.model_dump(by_alias=True)
        self.bundle.write_resolved("protocol", resolved | ({"parts": parts} if parts else {}))
        self.bundle.write_resolved("bench", experiment.bench.content.model_dump(by_alias=True))
        run, action = self.run, self.run.action
        steps = tuple(action.steps) if isinstance(action, PlannedDrive) else ()
        self._journal(events.RunAsked(run=run.name, rest_s=run.rest, steps=steps, **started()))

    def _measure(self) -> Path | None:
        """Let the robot move while the cameras run and return the export."""
        model, shape = self.experiment.model.content, self.shape.content
        match self.run.action:
            case PlannedDrive() as drive:
                subject = Subject(model, shape, self.run.mode)
                window = self._measure_drive(drive)
            case PlannedRelease() as release:
                subject = Subject(model, shape, self.run.mode, release.pull, release.height)
                window = self._measure_release(release)
        if awaited := self.bench.awaited:
            self.progress(f"output off, {awaited}")
        cameras = CameraWindow(began=window.cameras.began, seconds=window.cameras.seconds)
        self.bundle.record.note(Measured(cameras=cameras))
        return self.bench.collect(subject, window, self.bundle, self.operator)

    def _measure_drive(self, drive: PlannedDrive) -> CameraSpan:
        """Drive the robot while the cameras run."""
        self.twin = self._live_twin()
        with self.signals.first_only(), self.twin, self.bench.supply(self.bundle) as supply:
            self._prepare(supply)
            self.twin.require_ready()
            began = self._start_cameras()
            self.twin.follow(self.bench.recorder)
            first: BaseException | None = None
            try:
                try:
                    self._drive(supply, drive)
                finally:
                    self.signals.hold()
            except BaseException as error:
                first = error
                raise
            finally:  # a signal until then raised, and holds back the next by itself
                self._switch_off(supply, first)
        self._keep_readings()
        self.twin.keep_in(self.bundle, self._journal)
        return CameraSpan(self.start, self.bench.clock.now(), began)

    def _live_twin(self) -> LiveTwin | NoTwin:
        """Return what observes the run while it goes on, where the cameras stream."""
        if not self.bench.streams:
            return NoTwin()
        texts = (self.experiment.model.text, self.shape.text, self.experiment.bench.text)
        return LiveTwin(LiveTask.of(self.run, *texts, self.bench.viewer), self.bench.on_live_state)

    def _measure_release(self, release: PlannedRelease) -> CameraSpan:
        """Let the operator hold the robot and let go while the cameras run."""
        self._journal(events.NoDrive())
        self.bundle.record.note(Measured(output_off="supply not opened"))
        self._ask([PlannedPrompt(release.ready)])
        began = self._start_cameras()
        self._rest()
        asked = self.bench.clock.now()
        self._ask([PlannedPrompt(release.now)])
        seconds = self.run.duration
        self.progress(Stage(f"{seconds:g} s after the release", seconds=seconds))
        self.bench.clock.sleep(self.run.duration + _HAND_S)
        return CameraSpan(self.start, self.bench.clock.now(), began, asked)

    def _ask(self, prompts: Sequence[PlannedPrompt]) -> None:
        for prompt in prompts:
            asked = self.bench.clock.now() - self.start
            self._keep(ask(self.operator, prompt), asked_s=round(asked, 6))

    def _keep(self, one: PromptAnswer, asked_s: float | None = None) -> None:
        """Keep an answer in the journal, and its value in the manifest."""
        self._journal(one.event(asked_s))
        if fact := one.fact():
            answers = self.bundle.manifest.measured.answers | fact
            self.bundle.record.note(Measured(answers=answers))

    def _start_cameras(self) -> datetime:
        """Start the cameras, and with them the run's time, and return the wall time."""
        self.bench.start_cameras(self.operator)
        self.start, began = self.bench.clock.now(), datetime.now()
        self._journal(events.CamerasStarted(began=began))
        return began

    def _rest(self) -> None:
        self.progress(Stage(f"rest {self.run.rest:g} s", seconds=self.run.rest))
        self.bench.clock.sleep(self.run.rest)

    def _prepare(self, supply: Supply) -> None:
        self.progress("prepare the supply")
        limits = self.bench.limits(self.experiment.plan.current_limit)
        ready = made_ready(self.experiment.bench.content, supply, limits)
        identity = SupplyIdentity(**ready.identity._asdict())
        self.bundle.record.note(Measured(supply=identity))
        self._journal(events.SupplyPrepared(identity=identity, found=vars(ready.found)))
        ledger, firmware = self.bench.ledger_of(ready.identity), ready.identity.firmware
        if seen := check_new_scale(supply, ledger, firmware, self.progress):
            scale = events.Scale(set_voltage_V=seen.set_voltage_V, voltage_V=seen.voltage_V)
            self._journal(scale)

    def _drive(self, supply: Supply, drive: PlannedDrive) -> None:
        clock = self.bench.clock
        self._rest()
        on, first = clock.now(), drive.steps[0][1]
        self._journal(events.OutputOn(volts=first))
        seconds = self.run.duration
        self.progress(Stage(f"drive {seconds:g} s: {drive.asked}", seconds=seconds))
        self._note_reading(switch_on(supply, first))
        sent = [(on - self.start, float(first))]
        for after, volts in drive.steps[1:]:
            self._watch_until(on + after, supply)
            at = clock.now() - self.start
            applied = supply.set_voltage(volts)
            self._journal(events.Voltage(asked=volts, read_back=applied))
            sent.append((at, float(applied)))
            self._note_reading(watch(supply))
        self._watch_until(on + self.run.duration, supply)
        self._note_reading(watch(supply))
        sent.append((clock.now() - self.start, 0.0))
        self.bundle.record.note(Measured(sent=tuple(sent)))

    def _watch_until(self, end: float, supply: Supply) -> None:
        """Watch a running supply until an instant of the bench's clock."""
        clock = self.bench.clock
        while (remaining_s := end - clock.now()) > 0:
            if (why := self.twin.wait(clock, min(_POLL_S, remaining_s))) is not None:
                raise stop(supply, why)
            if remaining_s > _POLL_S:
                self._note_reading(watch(supply))

    def _switch_off(self, supply: Supply, first: BaseException | None) -> None:
        """Switch off, and write down whether that was confirmed; what happened first is kept."""
        off = supply.off()
        dead = off and supply.terminals_dead()
        self.bundle.record.note(Measured(output_off="confirmed" if dead else "unconfirmed"))
        self._journal(events.OutputOff(confirmed=dead))
        if dead:
            return
        why = supply.not_dead if off else supply.not_off
        began = f"{first}; " if isinstance(first, WorkbenchError) else f"{supply.name}: "
        if MAY_BE_ON in began:  # its guardian has said all that there is
            return
        raise SafetyStop(f"{began}{why}; {MAY_BE_ON}, {BY_HAND}") from first

    def _note_reading(self, reading: Reading) -> None:
        self.readings.append(reading)
        keys = ("set_voltage_V", "voltage_V", "current_A", "output")
        self._journal(events.SupplyReading(**{key: getattr(reading, key) for key in keys}))

    def _keep_readings(self) -> None:
        names = ("set_voltage_V", "voltage_V", "current_A")
        unique = {r.time_s - self.start: r for r in self.readings}
        times = sorted(unique)
        columns = {name: [getattr(unique[t], name) for t in times] for name in names}
        self.bundle.series.write("supply", TimeSeries.of(times, columns), {})

    def _journal(self, event: Event) -> None:
        self.bundle.record.journal(event, self.bench.clock.now() - self.start)

    def _end(self, status: _Ended, reason: str) -> None:
        """Close the bundle of a run that did not succeed, with what there is."""
        # on a full disk the message alone says what happened
        with suppress(OSError, RecordError):
            self._journal(events.Stopped(event=status, reason=reason))
            if self.readings and not self.bundle.series.has("supply"):
                self._keep_readings()
            self.twin.keep_in(self.bundle, self._journal)
            self.bench.keep_recorded(self.bundle)
            self.bundle.finish(status, error=reason)

    def _failure_text(self, reason: str) -> str:
        off = self.bundle.record.output.description + "; "
        if MAY_BE_ON in reason:  # which was said before more was known
            off = "" if self.bundle.record.output.live else f"by now {off}"
        text = f"run {self.run.number} ({self.run.name}): {reason}\n{off}see {self.bundle.path}"
        if self.bundle.manifest.measured.cameras is not None and not self.bundle.has_take():
            text += f"\nadd its take later: workbench ingest TAKE --into {self.bundle.path}"
        asked, bench = self.experiment.protocol.path, self.experiment.bench
        lab = "virtual" if bench.path == BUILT_IN else bench.path
        return f"{text}\ngo on: workbench run {asked} --bench {lab} --resume {self.bundle.path}"
