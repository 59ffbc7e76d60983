"""The process that observes a stream: frames in at its standard input, lines out at its output.

It takes frames in their order. Where it is behind it shows nothing; where it is further behind than
`BEHIND_S`, it leaves out all frames but the newest, steps over the gap, and counts them.
"""

from __future__ import annotations

import gc
import signal
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, WorkbenchError
from workbench.fit import LEAST_REST, Estimate, OnlineObserver
from workbench.live.messages import (
    Kind,
    LiveState,
    LiveSummary,
    LiveTask,
    bodies_from,
    frame_from,
    frame_size,
    line,
)
from workbench.live.pose_drawing import PoseDrawing
from workbench.live.verdict import LimitMonitor
from workbench.loopback import HERE
from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, TOP
from workbench.schemas import BenchFile, ModelFile, ShapeFile, StopWhen, parse
from workbench.sim import SAMPLE_RATE_HZ, Robot, make_robot
from workbench.timeseries import TimeSeries
from workbench.tracking import Axes, Body, BodyNames, FramePoints, Sample

__all__ = ["BEHIND_S", "main", "work"]

BEHIND_S = 0.5
"""Further behind than this the observer goes on with the newest frame [s]."""
_STATES_S = 0.1  # between two states for the run
_DRAW_S = 1 / 20  # between two that are drawn: the missing force costs as much as two samples
_REST_SHARE, _MOST_REST_S = 0.8, 1.0  # of the rest, how much the observer starts from
_RATE_WITHIN = 0.01

Send = Callable[[Kind, Any], None]


def main() -> None:
    """Work for whoever started this process, until its standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the run's
    out = sys.stdout.buffer

    def send(kind: Kind, value: Any) -> None:
        out.write(line(kind, value))
        out.flush()

    try:
        work(sys.stdin.buffer, send)
    except WorkbenchError as error:
        send("failed", str(error))
    except BrokenPipeError:
        pass  # the run is gone


def work(source: BinaryIO, send: Send) -> None:
    """Observe what comes from a source until it ends.

    Raises:
        InputError: when the stream cannot be observed.
    """
    task = task_from(source.readline())
    robot = _robot(task)
    _warm_up(robot, task)
    send("ready", None)
    text = source.readline()
    if not text:
        return
    bodies, frames = bodies_from(text), _Frames()
    threading.Thread(target=frames.fill, args=(source, bodies), daemon=True).start()
    rest = frames.first(task.rest_s)
    if not rest:
        return
    _Observation(task, robot, bodies, rest, send).follow(frames)


def task_from(text: bytes) -> LiveTask:
    """Return the task of its line."""
    import json

    facts = json.loads(text)
    stop = facts.pop("stop_when")
    return LiveTask(**facts, stop_when=None if stop is None else StopWhen(*stop))


def _robot(task: LiveTask) -> Robot:
    model = parse(Path("model"), task.model, ModelFile).content
    shape = parse(Path("shape"), task.shape, ShapeFile).content
    return make_robot(model.values(), shape, model.increments, model.quantities())


def _warm_up(robot: Robot, task: LiveTask) -> None:
    """Compile and load all that a sample needs, on a robot at rest that nobody saw."""
    names = (*FOOT, *TOP, *ROTOR, PITCH, ROTOR_ANGLE)
    still = np.zeros((LEAST_REST, len(names)))
    still += 1e-5 * np.sin(np.arange(still.size)).reshape(still.shape)
    times = np.arange(LEAST_REST, dtype=float)
    observer = OnlineObserver(robot, task.mode, TimeSeries(times, still, names, still == still))
    for _ in range(LEAST_REST // 2):
        observer.advance(dict(zip(names, still[0].tolist(), strict=True)))
    observer.missing_force()
    gc.collect()
    gc.freeze()


class _Frames:
    """Frames that arrived and were not taken yet, oldest first."""

    def __init__(self) -> None:
        self._queue = deque[Sample]()
        self._news = threading.Condition()
        self._ended = False

    def fill(self, source: BinaryIO, bodies: list[Body]) -> None:
        """Take frames from a source until it ends."""
        size = frame_size(bodies)
        with suppress(OSError, ValueError):
            while len(data := source.read(size)) == size:
                with self._news:
                    self._queue.append(frame_from(data, len(bodies)))
                    self._news.notify()
        with self._news:
            self._ended = True
            self._news.notify()

    def __len__(self) -> int:
        """Return how many wait."""
        return len(self._queue)

    def take(self) -> Sample | None:
        """Return the oldest; waits for one, None when there will be none."""
        with self._news:
            self._news.wait_for(lambda: self._queue or self._ended)
            return self._queue.popleft() if self._queue else None

    def newest(self) -> Sample:
        """Return the newest of several that wait; those before it are left out."""
        with self._news:
            newest = self._queue.pop()
            self._queue.clear()
            return newest

    def first(self, rest_s: float) -> list[Sample]:
        """Return the frames at rest from which the observer starts; fewer when the stream ends."""
        wanted = max(LEAST_REST / SAMPLE_RATE_HZ, min(_REST_SHARE * rest_s, _MOST_REST_S))
        found: list[Sample] = []
        while (one := self.take()) is not None:
            found.append(one)
            if one.time_s - found[0].time_s >= wanted - 0.5 / SAMPLE_RATE_HZ:
                return found
        return []


class _Observation:
    """A stream that is observed."""

    def __init__(
        self, task: LiveTask, robot: Robot, bodies: list[Body], rest: list[Sample], send: Send
    ) -> None:
        self._task, self._send = task, send
        self._zero, self._number = rest[0].time_s, rest[-1].number
        self._every = _every(rest)
        cameras = parse(Path("bench"), task.bench, BenchFile).content.tracking
        kept = [one for one in rest if (rest[-1].number - one.number) % self._every == 0]
        self._points = FramePoints(
            kept,
            bodies,
            BodyNames(cameras.bodies.foot, cameras.bodies.top, cameras.bodies.rotor),
            Axes(up=cameras.axes.up, forward=cameras.axes.forward),
            {name: np.array(positions) for name, positions in cameras.markers.items()},
        )
        self._observer = OnlineObserver(robot, task.mode, self._points.rest)
        limit = task.stop_when
        self._verdict = None if limit is None else LimitMonitor(limit)
        self._skipped = self._lost = 0
        self._errors: list[tuple[float, float]] = []
        self._sent = 0
        self._latencies: list[float] = []
        self._viewer = None if task.viewer is None else _Viewer(task.viewer, self._scene(robot))
        self._drawing = PoseDrawing(self._observer.model, robot)
        self._reported = self._drawn = 0.0
        send("observing", rest[-1].time_s - self._zero)

    def _scene(self, robot: Robot) -> dict[str, Any]:
        """Return what a viewer has to know before the first state."""
        limit = self._task.stop_when
        return {
            "name": self._task.name,
            "foot": [robot.values["foot_length"], robot.values["foot_width"]],
            "limit_mm": None if limit is None else 1e3 * limit.above_m,
        }

    def follow(self, frames: _Frames) -> None:
        """Observe until the stream ends, then report how it went."""
        begun, skips = time.process_time(), False
        while (frame := frames.take()) is not None:
            if len(frames) > BEHIND_S * SAMPLE_RATE_HZ * self._every:
                frame, skips = frames.newest(), True
            gap = frame.number - self._number
            if gap <= 0 or gap % self._every:  # played in a loop, or between two samples
                continue
            samples = gap // self._every
            if skips:
                self._skipped += samples - 1
            else:
                self._lost += samples - 1
            skips = False
            self._observe(frame, samples)
            self._report_state()
            if not len(frames):  # nothing is drawn while it is behind
                self._draw(frame)
        self._report(time.process_time() - begun)

    def _observe(self, frame: Sample, samples: int) -> None:
        self._number = frame.number
        seen = self._points.of(frame)
        estimate = self._observer.advance(seen, samples)
        self._newest: tuple[dict[str, float], Estimate] = (seen, estimate)
        at = frame.time_s - self._zero
        self._errors.append((at, estimate.error_m))
        self._latencies.append(time.monotonic() - frame.arrived_s)
        if self._verdict is not None:
            stop = self._verdict.after(at, estimate.error_m)
            if stop is not None:
                self._verdict = None
                self._send("stop", asdict(stop))

    def _report_state(self) -> None:
        now = time.monotonic()
        if now - self._reported > _STATES_S:
            self._reported = now
            self._send("state", {"state": asdict(self._state()), "errors": self._unsent()})

    def _draw(self, frame: Sample) -> None:
        now = time.monotonic()
        if self._viewer is not None and now - self._drawn > _DRAW_S:
            self._drawn = now
            seen, estimate = self._newest
            facts = self._drawing.of(seen, estimate, self._observer.missing_force())
            facts |= {"time_s": frame.time_s - self._zero, "arrived_s": frame.arrived_s}
            self._viewer.show(facts | {"error_mm": _mm(estimate.error_m)})

    def _state(self) -> LiveState:
        at, error = self._errors[-1]
        recent = 1e3 * np.array(self._latencies[-SAMPLE_RATE_HZ:])
        limit = self._task.stop_when
        return LiveState(
            time_s=at,
            error_mm=_mm(error),
            latency_ms=float(np.percentile(recent, 99)),
            samples=len(self._errors),
            skipped=self._skipped,
            lost=self._lost,
            limit_mm=None if limit is None else 1e3 * limit.above_m,
        )

    def _unsent(self) -> list[tuple[float, float | None]]:
        """Return the prediction errors [mm] since they were last asked for."""
        new, self._sent = self._errors[self._sent :], len(self._errors)
        return [(at, _mm(error)) for at, error in new]

    def _report(self, cpu_s: float) -> None:
        if not self._errors:
            return
        latencies = 1e3 * np.array(self._latencies)
        errors = 1e3 * np.array([error for _, error in self._errors])
        known: NDArray[np.float64] = errors[np.isfinite(errors)]
        root = float(np.sqrt(np.mean(known**2))) if len(known) else 0.0
        p50, p99 = np.percentile(latencies, [50, 99])
        summary = LiveSummary(
            samples=len(errors),
            skipped=self._skipped,
            lost=self._lost,
            latency_ms=(float(p50), float(p99), float(latencies.max())),
            cpu_ms=1e3 * cpu_s / len(errors),
            error_mm=(root, float(known.max())) if len(known) else None,
        )
        self._send("end", {"summary": asdict(summary), "errors": self._unsent()})


class _Viewer:
    """A line to a viewer that nobody waits for: what it does not take at once is not shown."""

    def __init__(self, port: int, scene: dict[str, Any]) -> None:
        self._link: socket.socket | None = None
        with suppress(OSError):
            self._link = socket.create_connection((HERE, port), timeout=1.0)
            self._link.sendall(line("observing", scene))
            self._link.setblocking(False)

    def show(self, facts: dict[str, Any]) -> None:
        if self._link is None:
            return
        data = line("state", facts)
        try:
            sent = self._link.send(data)
            if sent < len(data):  # half a line: the rest has to follow, and soon
                self._link.settimeout(0.02)
                self._link.sendall(data[sent:])
                self._link.setblocking(False)
        except BlockingIOError:
            return
        except OSError:
            self._link.close()
            self._link = None


def _every(rest: list[Sample]) -> int:
    """Return how many frames a sample of the observer is.

    Raises:
        InputError: when the stream's rate is no multiple of the observer's.
    """
    seconds = rest[-1].time_s - rest[0].time_s
    rate = (rest[-1].number - rest[0].number) / seconds if seconds > 0 else 0.0
    every = max(1, round(rate / SAMPLE_RATE_HZ))
    if abs(rate / (every * SAMPLE_RATE_HZ) - 1) > _RATE_WITHIN:
        raise InputError(
            f"the stream has {rate:.1f} frames a second; the live twin takes a multiple of "
            f"{SAMPLE_RATE_HZ}"
        )
    return every


def _mm(error_m: float) -> float | None:
    return None if np.isnan(error_m) else 1e3 * error_m
