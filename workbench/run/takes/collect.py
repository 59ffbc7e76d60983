"""Wait for the export of a run: watch the folder, ask the operator, take only what belongs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from workbench.bundle import Bundle, Event, Measured, events
from workbench.errors import HardwareError
from workbench.hw import Clock
from workbench.run.takes.belonging import CameraTime, TakeVerdict, judge
from workbench.run.takes.folder import TakeFolder
from workbench.run.takes.operator import Operator

__all__ = ["Collector"]

_POLL_S = 0.25
_INSIST = "yes"


class Collector:
    """Finds the take of one run; every refusal and its reason goes into the run's journal.

    Args:
        bundle: of the run.
        wanted: when the cameras had to record.
        start: of the run's journal, by the clock [s].
        operator: reads what is waited for, and is asked for a path.
        clock: the waiting is timed with it.
        tolerance: how far the clocks of bench and tracking PC may lie apart [s].
        used: recordings that showed earlier runs, and which; the one found is added. A recording
            shows one run, and short runs follow one another within the tolerance.
    """

    def __init__(
        self,
        bundle: Bundle,
        wanted: CameraTime,
        start: float,
        operator: Operator,
        clock: Clock,
        tolerance: float,
        used: dict[str, str],
    ) -> None:
        self._bundle, self._wanted, self._start = bundle, wanted, start
        self._operator, self._clock, self._tolerance = operator, clock, tolerance
        self._used = used

    def wait(self, folder: TakeFolder, timeout: float) -> Path:
        """Return the export that appears in a folder, or that the operator names.

        Ctrl-C asks the operator for a path; nothing typed goes on waiting, Ctrl-C again gives up.
        Without an operator the first Ctrl-C gives up.

        Args:
            folder: made when the cameras started.
            timeout: longest wait [s].

        Raises:
            HardwareError: when the time is over.
            KeyboardInterrupt: when the operator gives up.
        """
        self._journal(events.TakeWanted(folder=str(folder.path)))
        while True:
            self._operator.show_text(self._request(folder))
            try:
                return self._watch(folder, timeout)
            except KeyboardInterrupt as stop:
                if stop.args or not self._operator.present:  # a signal that ends us has a name
                    raise
            named = self._ask(f"Path of the export (nothing: go on watching {folder.path})")
            if named is not None:
                return named

    def ask(self) -> Path:
        """Return the export that the operator names.

        Raises:
            HardwareError: when nobody answers.
        """
        self._journal(events.TakeWanted())
        text = "Stop recording, export the take as CSV, then give its path"
        named = self._ask(text)
        while named is None:
            if not self._operator.present:
                raise HardwareError("nobody names the export; give the bench file tracking.takes")
            named = self._ask(text)
        return named

    def accept(self, path: Path) -> Path:
        """Return an export that has to belong.

        Raises:
            HardwareError: when it does not, with the reasons.
        """
        verdict = self._judged(path)
        if not verdict.belongs:
            raise HardwareError("\n".join(verdict.reasons))
        return path

    def _request(self, folder: TakeFolder) -> str:
        text = f"Stop recording and export the take as CSV into {folder.path}."
        if not self._operator.present:
            return text
        return f"{text} To name another file: Ctrl-C in the terminal, or STOP in the panel."

    def _watch(self, folder: TakeFolder, timeout: float) -> Path:
        deadline, trouble, others = self._clock.now() + timeout, "", 0
        while self._clock.now() < deadline:
            try:
                finished, trouble = folder.finished(), ""
            except HardwareError as error:
                if str(error) != trouble:
                    self._operator.show_text(f"{error}. Still trying.")
                finished, trouble = [], str(error)
            for path in finished:
                verdict = self._judged(path)
                if verdict.belongs:
                    return path
                self._operator.show_text("\n".join(verdict.reasons) + "\nStill waiting.")
                others += 1
            self._clock.sleep(_POLL_S)
        refused = f", {others} that did not belong" if others else ""
        raise HardwareError(
            trouble
            or f"{folder.path}: no export of this run appeared within {timeout / 60:g} min{refused}"
        )

    def _ask(self, text: str) -> Path | None:
        """Ask until a take belongs or the operator insists; None when nothing is typed."""
        question, refused = text, None
        while answer := self._operator.ask(question, "").strip().strip('"'):
            if refused is not None and answer.casefold() == _INSIST:
                return self._forced(*refused)
            path = Path(answer).expanduser()
            verdict = self._judged(path)
            if verdict.belongs:
                return path
            refused = (path, verdict) if verdict.readable else None
            insist = f", or {_INSIST} to take it all the same" if refused else ""
            question = "\n".join([*verdict.reasons, f"Another path{insist}"])
        return None

    def _judged(self, path: Path) -> TakeVerdict:
        verdict = judge(path, self._wanted, self._tolerance)
        if verdict.belongs and verdict.recording in self._used:
            reason = f"{path}: this recording shows run {self._used[verdict.recording]} already"
            verdict = replace(verdict, reasons=(reason,))
        if verdict.belongs:
            self._used[verdict.recording] = self._bundle.path.name
            self._journal(events.TakeAccepted(file=str(path), notes=tuple(verdict.notes)))
            for note in verdict.notes:
                self._operator.show_text(note)
        else:
            self._journal(events.TakeRefused(file=str(path), reasons=tuple(verdict.reasons)))
        return verdict

    def _forced(self, path: Path, verdict: TakeVerdict) -> Path:
        self._journal(events.TakeForced(file=str(path)))
        self._bundle.record.note(Measured(take_forced=tuple(verdict.reasons)))
        return path

    def _journal(self, event: Event) -> None:
        self._bundle.record.journal(event, self._clock.now() - self._start)
