"""What a calibration leaves on disk: the file that benches name, and the next protocol."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from datetime import date, datetime
from pathlib import Path

import numpy as np

from workbench.bundle import Bundle
from workbench.errors import InputError
from workbench.identify.calibrate import SpeedCalibration
from workbench.identify.shaft import LEAST_TURNS, RUN_OUT_S, START_UP_S
from workbench.schemas import (
    BenchFile,
    Calibration,
    CalibrationFile,
    Mode,
    MotorLine,
    calibration_text,
    load,
)
from workbench.twin import settings

__all__ = [
    "last_day",
    "new_target",
    "on_their_bench",
    "propose_protocol",
    "write_calibration",
    "write_new",
]

LOWEST_V, HIGHEST_V = 1.0, 5.0  # thesis, fig. 5.3
RUNS = 10
DURATION_S = 10.0
SLOWEST = 1.0  # [rad/s]; a motor that turns slower is about to stand
SPARE_TURNS = 1.0  # the line's slowest speed is the one in doubt
SEED = 1


def new_target(out: Path | None, named: Path, results: Callable[[Path], list[Path]]) -> Path:
    """Return where a result goes: `out`, else `named`, numbered from 2 where that is taken.

    Args:
        out: that was asked for.
        named: without.
        results: returns all files that are written for one of these paths.

    Raises:
        InputError: when `out` or what lies beside it exists; a result is never overwritten.
    """
    if out is not None:
        if taken := [path for path in results(out) if path.exists()]:
            raise InputError(f"{taken[0]}: exists and is never overwritten; give another --out")
        return out
    target, number = named, 1
    while any(path.exists() for path in results(target)):
        number += 1
        target = named.with_stem(f"{named.stem}-{number}")
    return target


def write_new(path: Path, text: str) -> None:
    """Write a file that does not exist yet.

    Raises:
        InputError: when it exists; a result is never overwritten.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path}: exists and is never overwritten; give another --out") from None


def write_calibration(path: Path, name: str, day: date, found: SpeedCalibration) -> None:
    """Write a calibration file.

    Args:
        path: a new file.
        name: id under which bundles refer to it.
        day: of the last run.
        found: with a line.

    Raises:
        InputError: when there is no line, or the file exists.
    """
    if found.line is None:
        raise InputError(f"no calibration to write: {found.open}")
    line, volts = found.line, found.line.voltages
    content = CalibrationFile.model_construct(
        schema_="workbench/calibration-1",
        id=name,
        measured_on=day,
        slope=line.slope.value,
        slope_interval=(line.slope.low, line.slope.high),
        offset=line.offset.value,
        offset_interval=(line.offset.low, line.offset.high),
        lowest=float(volts.min()),
        highest=float(volts.max()),
        scatter=line.scatter,
        runs=tuple(point.name for point in found.points),
        warnings=found.warnings,
    )
    write_new(path, calibration_text(content))


def last_day(bundles: Sequence[Bundle]) -> date:
    """Return the day of the last of some runs."""
    return max(datetime.fromisoformat(one.manifest.created).date() for one in bundles)


def on_their_bench(bundles: Sequence[Bundle]) -> Bundle | None:
    """Return the last of some runs that says what it was made on, None where none does."""
    kept = [
        bundle
        for bundle in bundles
        if bundle.document("bench").exists() or bundle.document("sheet").exists()
    ]
    return kept[-1] if kept else None


def propose_protocol(bundle: Bundle | None = None, mode: Mode = "clamped") -> str:
    """Return a protocol whose runs determine the line: ten voltages, far apart, in random order.

    Args:
        bundle: of a run on the bench in question, whose range and limit are kept to; without one,
            the thesis' range.
        mode: in which the motor will be used.
    """
    line: MotorLine = Calibration()
    limit = math.inf
    if bundle is not None:
        _, line = settings(bundle)
        if bundle.document("bench").exists():
            limit = load(bundle.document("bench"), BenchFile).content.supply.limits.voltage
    turning = (SLOWEST - line.offset) / line.slope
    low = _up(max(LOWEST_V, line.lowest, turning))
    high = min(HIGHEST_V, line.highest, limit)
    slowest = line.slope * low + line.offset
    needed = START_UP_S + RUN_OUT_S + (LEAST_TURNS + SPARE_TURNS) * 2 * math.pi / slowest
    duration = max(DURATION_S, math.ceil(needed))
    volts = ", ".join(f"{volt:.2f} V" for volt in np.linspace(low, high, RUNS))
    return f"""\
schema: workbench/protocol-1
title: Speed-voltage line
steps:
{_FIRST.get(mode, "")}\
  - sweep:
      mode: {mode}
      voltages: [{volts}]
      rest: 2 s
      ramp: 0 s
      duration: {duration:g} s
      order: random
      seed: {SEED}
      before: [{_BEFORE[mode]}]
"""


_FIRST: dict[Mode, str] = {"clamped": "  - prompt: Clamp the foot.\n"}
_BEFORE: dict[Mode, str] = {
    "clamped": "Wait until the beam is still.",
    "hop": "Stand the robot on the start line.",
}


def _up(volts: float) -> float:
    """Return the next 10 mV above, so that rounding never leaves the range."""
    return math.ceil(round(100 * volts, 6)) / 100
