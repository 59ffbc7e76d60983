"""A run's hold on its live twin: start it, feed it, receive its states, and end with it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import workbench
from workbench.bundle import Bundle, Event, events, sha256
from workbench.errors import WorkbenchError
from workbench.live.messages import LiveState, LiveSummary, LiveTask, bodies_line, frame_bytes
from workbench.live.verdict import Stop
from workbench.timeseries import TimeSeries

if TYPE_CHECKING:
    from workbench.hw import Clock
    from workbench.tracking import Recorder

__all__ = ["BLIND_S", "COMMAND", "LiveTwin", "NoTwin"]

COMMAND = (sys.executable, "-m", "workbench.live")
"""What starts the process."""
BLIND_S = 1.0
"""A run that stops on its prediction error stops where there was none for so long [s]."""
_READY_S = 60.0  # a cold computer compiles
_LOOK_S = 0.005  # how often a waiting run looks
_HAND_ON_S = 0.1  # longest wait for a frame that is passed on
_END_S = 2.0  # for what still waits in the line to be observed

OnLiveState = Callable[[LiveState | None], None]


class NoTwin:
    """The live twin of a run that has none."""

    def __enter__(self) -> Self:
        """Do nothing."""
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing."""

    def require_ready(self) -> None:
        """Return at once."""

    def follow(self, recorder: Recorder | None) -> None:
        """Follow nothing."""

    def wait(self, clock: Clock, seconds: float) -> str | None:
        """Wait; nothing stops the run early."""
        clock.sleep(seconds)
        return None

    def keep_in(self, bundle: Bundle, journal: Callable[[Event], None]) -> None:
        """Keep nothing."""


class LiveTwin:
    """A worker process for one run; use it in a `with` block, at whose end the process is gone.

    A run that stops on its prediction error needs it: it stops as well where the process ends, or
    reports no prediction error for `BLIND_S`. Any other run goes on without it.

    Args:
        task: what is observed.
        on_state: receives each state in a thread of its own, and None at the end.
        command: starts the process.

    Attributes:
        summary: how it went; None before the end of the block, or where the process was lost.
        errors: (time from the first frame, cameras' clock [s]; prediction error [mm] or None).
        lost: why there is none any more, in words; empty while there is.
    """

    def __init__(
        self,
        task: LiveTask,
        on_state: OnLiveState = lambda state: None,
        command: Sequence[str] = COMMAND,
    ) -> None:
        self._task, self._on_state = task, on_state
        self.summary: LiveSummary | None = None
        self.errors: list[tuple[float, float | None]] = []
        self.lost = ""
        self._stop: Stop | None = None
        self._ready, self._ending = threading.Event(), threading.Event()
        self._known = 0.0  # when a prediction error was last received
        self._waits = self._kept = False
        self._feeder: threading.Thread | None = None
        self._words = tempfile.TemporaryFile()  # noqa: SIM115  closed with the process
        folder = Path(workbench.__file__).parents[1]
        path = os.pathsep.join(filter(None, (str(folder), os.environ.get("PYTHONPATH"))))
        one_core = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._words,
            env={**os.environ, **one_core, "PYTHONPATH": path},
        )
        self._hearer = threading.Thread(target=self._receive, name="live twin", daemon=True)

    def __enter__(self) -> Self:
        """Send the process its task."""
        self._hearer.start()
        with suppress(OSError):
            self._send(json.dumps(asdict(self._task)).encode() + b"\n")
        return self

    def __exit__(self, *_: object) -> None:
        """Let it observe what arrived, and end it."""
        self._ending.set()
        if self._feeder is not None:
            self._feeder.join(_END_S)
        assert self._process.stdin is not None
        with suppress(OSError, ValueError):
            self._process.stdin.close()
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._hearer.join(_END_S)
        self._on_state(None)
        self._words.close()

    def require_ready(self) -> None:
        """Return when it can take frames.

        Raises:
            WorkbenchError: when it cannot, and the run stops on its prediction error.
        """
        if not self._ready.wait(_READY_S):
            self.lost = self.lost or f"it was not ready within {_READY_S:g} s"
        if self.lost and self._task.stop_when is not None:
            raise WorkbenchError(f"the live twin of this run did not start: {self.lost}")

    def follow(self, recorder: Recorder | None) -> None:
        """Hand each frame of a recorder on as it arrives, in a thread; the recorder never waits."""
        if recorder is None or self.lost:
            return
        self._feeder = threading.Thread(
            target=self._feed, args=(recorder,), name="live twin's frames", daemon=True
        )
        self._feeder.start()

    def wait(self, clock: Clock, seconds: float) -> str | None:
        """Wait with the output on, and return early why the run has to stop."""
        if self._task.stop_when is None:
            clock.sleep(seconds)
            return None
        if not self._waits:
            self._waits, self._known = True, time.monotonic()
        until = clock.now() + seconds
        while (why := self._why()) is None and (remaining_s := until - clock.now()) > 0:
            clock.sleep(min(_LOOK_S, remaining_s))
        return why

    def keep_in(self, bundle: Bundle, journal: Callable[[Event], None]) -> None:
        """Write the prediction error over time into a bundle, and journal how it went, once."""
        if self._kept:
            return
        self._kept = True
        if self.errors:
            times, errors = zip(*self.errors, strict=True)
            column = [float("nan") if error is None else error for error in errors]
            made_from = {kind: sha256(bundle.document(kind)) for kind in ("model", "shape")}
            series = TimeSeries.of(times, {"prediction_error_mm": column})
            bundle.series.write("live", series, made_from)
        facts = {} if self.summary is None else asdict(self.summary)
        journal(events.LiveTwinState(**facts, gone=self.lost))

    def _why(self) -> str | None:
        """Return why the run has to stop, in words."""
        limit = self._task.stop_when
        if limit is None:
            return None
        if self._stop is not None:
            stop = self._stop
            why = (
                f"prediction error {1e3 * stop.error_m:.1f} mm {stop.time_s:.2f} s after the first "
                f"frame, above {1e3 * limit.above_m:g} mm for {stop.since_s:.2f} s"
            )
        elif self.lost:
            why = f"its live twin is gone ({self.lost})"
        elif (blind := time.monotonic() - self._known) > BLIND_S:
            why = (
                f"no prediction error for {blind:.1f} s, allowed {BLIND_S:g} s; do the cameras see "
                "all bodies, and does the computer keep up"
            )
        else:
            return None
        return f"{why} (stop_when: {limit.words})"

    def _send(self, data: bytes) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(data)
        self._process.stdin.flush()

    def _feed(self, recorder: Recorder) -> None:
        count = 0
        with suppress(OSError, ValueError):  # the process ended; who reads it says why
            self._send(bodies_line(recorder.bodies))
            while True:
                ending = self._ending.is_set()
                new = recorder.since(count, 0.0 if ending else _HAND_ON_S)
                if new:
                    count += len(new)
                    self._send(b"".join(map(frame_bytes, new)))
                if ending:
                    return

    def _receive(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for text in lines:
                with suppress(ValueError):
                    ((kind, value),) = json.loads(text).items()
                    self._take(kind, value)
        if self.summary is None and not self.lost and not self._ending.is_set():
            self.lost = f"its process ended: {self._last_words()}"
        self._ready.set()

    def _take(self, kind: str, value: Any) -> None:
        match kind:
            case "ready":
                self._ready.set()
            case "failed":
                self.lost = str(value)
            case "stop":
                self._stop = Stop(**value)
            case "state" | "end":
                self.errors += [(at, error) for at, error in value["errors"]]
                if any(error is not None for _, error in value["errors"]):
                    self._known = time.monotonic()
                if kind == "state":
                    self._on_state(LiveState(**value["state"]))
                else:
                    self.summary = LiveSummary(**value["summary"])

    def _last_words(self) -> str:
        self._words.seek(0)
        lines = self._words.read().decode(errors="replace").splitlines()
        return lines[-1] if lines else "without a word"
