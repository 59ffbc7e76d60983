"""Whether an export is whole, and whether it shows the run that it is wanted for."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.errors import TakeError

if TYPE_CHECKING:
    from workbench.tracking import Take

__all__ = ["TOLERANCE_S", "CameraTime", "TakeVerdict", "judge"]

TOLERANCE_S = 60.0
"""How far the clocks of the bench and of the tracking PC may lie apart [s]."""

_SHORT_S = 1.0  # the run's end is known to about this: the supply's port is closed first
_LONG_S = 120.0
_TEXT_FORMATS = ("motive", "row")
_TAIL_BYTES = 1 << 16
_STATED_FRAMES = ("Total Exported Frames", "framecount")  # Motive; row format


@dataclass(frozen=True)
class CameraTime:
    """When the cameras had to record.

    Args:
        began: local wall time of the bench, without a zone.
        seconds: from there to the end of the run [s].
    """

    began: datetime
    seconds: float


@dataclass(frozen=True)
class TakeVerdict:
    """What was found out about an export.

    Args:
        reasons: why it is not the take that is wanted; empty when it is.
        notes: what a user should know of a take that belongs.
        readable: False when it cannot be used at all, whoever insists.
        recording: the same for every export of one recording: its start, or the file's hash where
            the export states none.
    """

    reasons: tuple[str, ...]
    notes: tuple[str, ...] = ()
    readable: bool = True
    recording: str = ""

    @property
    def belongs(self) -> bool:
        """Return whether it is the take that is wanted."""
        return not self.reasons


def judge(path: Path, wanted: CameraTime, tolerance: float = TOLERANCE_S) -> TakeVerdict:
    """Read an export and find out whether it is whole and of this run.

    Args:
        path: the export.
        wanted: when the cameras had to record.
        tolerance: how far the two clocks may lie apart [s].
    """
    from workbench.tracking import read_take  # only at the end of a run

    try:
        take = read_take(path)
        tail = _tail(path) if take.format in _TEXT_FORMATS else b"\n"
    except TakeError as error:
        return TakeVerdict((str(error),), readable=False)
    except OSError as error:
        return TakeVerdict((f"{path}: cannot be read ({error})",), readable=False)
    reasons = [f"{path}: {reason}" for reason in _cut_short(take, tail)]
    reasons += [f"{path}: {reason}" for reason in _of_another_run(take, wanted, tolerance)]
    recording = take.began[0].isoformat() if take.began else take.sha256
    notes = () if reasons else tuple(_notes(take, wanted))
    return TakeVerdict(tuple(reasons), notes, recording=recording)


def _cut_short(take: Take, tail: bytes) -> Iterator[str]:
    if not tail.endswith(b"\n"):
        yield "the last line has no end, so its last number may be cut; is the export finished?"
    _, frame, rest = tail.rpartition(b"\nframe,")
    if take.format == "row" and frame and rest.count(b"\n") - 1 < len(take.bodies):
        yield "rows of bodies are missing after the last frame; the export is not finished"
    stated = next((take.header[key] for key in _STATED_FRAMES if key in take.header), "")
    if stated.isascii() and stated.isdigit() and int(stated) > len(take):
        yield (
            f"the header states {stated} frames, the file has {len(take)}; "
            "the export is not finished or was cut"
        )


def _of_another_run(take: Take, wanted: CameraTime, tolerance: float) -> Iterator[str]:
    seconds = _seconds(take)
    if seconds < wanted.seconds - _SHORT_S:
        yield (
            f"the take lasts {seconds:.1f} s, from the start of the cameras to the end of this "
            f"run it was {wanted.seconds:.1f} s"
        )
    if not take.began:
        return
    began = _likeliest(take, wanted)
    late = (began - wanted.began).total_seconds()
    # a recording that was started long before is as good, when it lasts until the run is over
    early = wanted.seconds - seconds - late
    if late > tolerance or early > tolerance:
        yield (
            f"the take began at {began:%Y-%m-%d %H:%M:%S} by the tracking PC, {_apart(late)} this "
            f"run's cameras at {wanted.began:%Y-%m-%d %H:%M:%S}; {tolerance:g} s are allowed. If "
            "it is the right one, the clocks differ: set one of them, or tracking.takes_tolerance"
        )


def _notes(take: Take, wanted: CameraTime) -> Iterator[str]:
    if take.began:
        late = (_likeliest(take, wanted) - wanted.began).total_seconds()
        yield f"by its clock the take began {_apart(late)} this run's cameras"
    else:
        yield "the export has no start time, so it was matched by duration and file time"
    longer = _seconds(take) - wanted.seconds
    if longer > _LONG_S:
        yield f"the take is {timedelta(seconds=round(longer))} longer than the run"


def _likeliest(take: Take, wanted: CameraTime) -> datetime:
    """Return the nearest of the times that a start time can mean."""
    return min(take.began, key=lambda time: abs(time - wanted.began))


def _seconds(take: Take) -> float:
    return float(take.times[-1] - take.times[0]) + 1.0 / take.rate_hz


def _apart(late: float) -> str:
    """Return a time difference [s] in words that end before the word it is about."""
    if abs(late) < 100:
        return f"{abs(late):.1f} s {'after' if late > 0 else 'before'}"
    return f"{timedelta(seconds=round(abs(late)))} {'after' if late > 0 else 'before'}"


def _tail(path: Path) -> bytes:
    with path.open("rb") as file:
        file.seek(max(0, os.fstat(file.fileno()).st_size - _TAIL_BYTES))
        return file.read()
