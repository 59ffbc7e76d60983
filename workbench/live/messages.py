"""What a run and its live twin say to each other.

To the worker: one line of JSON (`LiveTask`), one with the stream's bodies, then frames of one size,
in binary, as they arrive. From it: lines of JSON, each an object with one key of `Kind`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from workbench.modes import Mode
from workbench.schemas import PlannedRun, StopWhen
from workbench.tracking import Body, Sample

__all__ = [
    "Kind",
    "LiveState",
    "LiveSummary",
    "LiveTask",
    "bodies_from",
    "bodies_line",
    "frame_bytes",
    "frame_from",
    "frame_size",
    "line",
]

Kind = Literal["ready", "observing", "state", "stop", "failed", "end"]

_HEAD = 3  # number, server's time, arrival


@dataclass(frozen=True)
class LiveTask:
    """What is observed.

    Args:
        name: of the run, for whoever watches.
        mode: of the run.
        model: text of the model file.
        shape: text of the shape file.
        bench: text of the bench file: axes, bodies and markers of its cameras.
        rest_s: for how long the robot is at rest at first [s].
        stop_when: what the run shall stop on.
        viewer: port on loopback where each shown state is sent; None where nobody watches.
    """

    name: str
    mode: Mode
    model: str
    shape: str
    bench: str
    rest_s: float
    stop_when: StopWhen | None = None
    viewer: int | None = None

    @classmethod
    def of(
        cls, run: PlannedRun, model: str, shape: str, bench: str, viewer: int | None
    ) -> LiveTask:
        """Return the task of a run; arguments as of the class."""
        return cls(run.name, run.mode, model, shape, bench, run.rest, run.stop_when, viewer)


@dataclass(frozen=True)
class LiveState:
    """How the observation goes.

    Args:
        time_s: of the newest sample, from the first frame by the cameras' clock [s].
        error_mm: newest prediction error; None where there is none.
        latency_ms: 99th percentile over the last second, from a frame's arrival to its state.
        samples: observed so far.
        skipped: left out so far, as the observer was behind.
        lost: frames that did not arrive so far.
        limit_mm: prediction error on which the run stops; None where it does not.
    """

    time_s: float
    error_mm: float | None
    latency_ms: float
    samples: int
    skipped: int
    lost: int
    limit_mm: float | None = None


@dataclass(frozen=True)
class LiveSummary:
    """How the observation went.

    Args:
        samples: observed.
        skipped: left out, as the observer was behind.
        lost: frames that did not arrive.
        latency_ms: median, 99th percentile and greatest, from a frame's arrival to its state.
        cpu_ms: processor time of a sample.
        error_mm: root mean square and greatest prediction error; None where there was none.
    """

    samples: int
    skipped: int
    lost: int
    latency_ms: tuple[float, float, float]
    cpu_ms: float
    error_mm: tuple[float, float] | None


def line(kind: Kind, value: Any = None) -> bytes:
    """Return a line for the other end."""
    return json.dumps({kind: value}).encode() + b"\n"


def bodies_line(bodies: Sequence[Body]) -> bytes:
    """Return the line that says which bodies the frames hold."""
    facts = [asdict(body) | {"places": body.places.tolist()} for body in bodies]
    return json.dumps(facts).encode() + b"\n"


def bodies_from(text: bytes) -> list[Body]:
    """Return the bodies of such a line."""
    return [
        Body(one["name"], one["number"], np.reshape(one["places"], (-1, 3)), one["first"])
        for one in json.loads(text)
    ]


def frame_size(bodies: Sequence[Body]) -> int:
    """Return how many bytes a frame has."""
    markers = sum(len(body.places) for body in bodies)
    return 8 * (_HEAD + 8 * len(bodies) + 3 * markers)


def frame_bytes(sample: Sample) -> bytes:
    """Return a frame, but for its loose markers."""
    head = np.array([sample.number, sample.time_s, sample.arrived_s])
    return np.concatenate([head, sample.poses.ravel(), sample.markers.ravel()]).tobytes()


def frame_from(data: bytes, count: int) -> Sample:
    """Return the frame of such bytes.

    Args:
        data: of one frame.
        count: of bodies in it.
    """
    values = np.frombuffer(data)
    head, poses, markers = np.split(values, [_HEAD, _HEAD + 8 * count])
    number, time_s, arrived_s = head.tolist()
    return Sample(int(number), time_s, poses.reshape(-1, 8), markers.reshape(-1, 3), {},
                  arrived_s=arrived_s)  # fmt: skip
