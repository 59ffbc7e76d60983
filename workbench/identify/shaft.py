"""The mean speed of the motor's shaft in one run, from the tracked rotor.

The motor is on the beam's tip. What the cameras see is the angle of the rotor in the world: the
shaft's, plus the tip's tilt, which near a resonance swings by half a radian and more and tilts a
line through the angle by 0.01 rad/s over ten seconds. The tilt is a smooth function of where the
tip is from the foot, so a parabola of that place is fitted beside the line and taken off.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.motion import FOOT, PITCH, ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking import RotorSpeed, mean_speed

__all__ = ["shaft_speed"]

Array = NDArray[np.float64]

START_UP_S = 1.0  # after the last change of the voltage
RUN_OUT_S = 0.2  # before the output goes off: the run's clock and the cameras' differ by less
LEAST_TURNS = 3.0
STALLED = 0.5  # of a mean turn: a rotor that gets no farther in that time was stopped
STEADY = 0.02  # of the speed: more change over the run is no steady speed
MISCOUNTED_RAD = np.pi / 2  # a whole turn too many shows as more, a tilt across a gap as less
_TURN = 2 * np.pi
_HARMONICS = 2
_LEAST_SAMPLES = 20
_CHANNELS = (ROTOR_ANGLE, TOP[0], TOP[2], FOOT[0], FOOT[2], PITCH)


def shaft_speed(run: MeasuredRun) -> RotorSpeed:
    """Return the mean speed of the motor's shaft while the voltage was constant [rad/s].

    On the virtual bench it is within 0.001 rad/s of the truth on runs of 10 s, a tenth of what a
    line through the rotor's angle is off near a resonance (`benchmarks/calibrate.py`).

    Args:
        run: hop or clamped.

    Raises:
        InputError: the rotor is not seen, its turns cannot be counted, it stalls or is not steady.
    """
    if not run.driven or len(run.steps) < 2:
        raise InputError(f"mode {run.mode} has no drive, so it gives no speed at a voltage")
    start, stop = run.steps[-2][0] + START_UP_S, run.steps[-1][0] - RUN_OUT_S
    part = run.motion.between(start, stop).select(_CHANNELS)
    seen = np.asarray((part.valid & np.isfinite(part.values)).all(axis=1))
    if np.count_nonzero(seen) < _LEAST_SAMPLES:
        raise InputError(
            f"rotor, T and foot are seen together in only {np.count_nonzero(seen)} samples between "
            f"{start:g} and {stop:g} s, after the start-up"
        )
    times = part.times[seen]
    in_the_world = part[ROTOR_ANGLE][seen]
    _require_turning(times, in_the_world)
    angle = in_the_world - _tilt(times, in_the_world, part, seen)
    _require_counted(times, angle)
    _require_steady(times, angle)
    return mean_speed(times, angle)


def _tilt(times: Array, angle: Array, part: TimeSeries, seen: NDArray[np.bool_]) -> Array:
    """Return the tilt of the beam's tip, (n,) [rad], up to a constant.

    Line and harmonics are fitted with it, so that it takes nothing of theirs: the line through what
    is left is that of the whole fit (Frisch, Waugh and Lovell).
    """
    since = (times - times.mean()) / np.ptp(times)
    speed, level = np.polyfit(since, angle, 1)
    phase = np.outer(level + speed * since, np.arange(1, _HARMONICS + 1))
    turning = [since, np.ones_like(since), *np.cos(phase).T, *np.sin(phase).T]
    tip = _tip(part, seen)
    terms = np.column_stack([*turning, *tip])
    found = np.linalg.lstsq(terms, angle)[0]
    return np.column_stack(tip) @ found[len(turning) :]


def _tip(part: TimeSeries, seen: NDArray[np.bool_]) -> list[Array]:
    """Return terms up to the second power of T's place from the foot, in the foot's frame."""
    x, z = (part[TOP[k]][seen] - part[FOOT[k]][seen] for k in (0, 2))
    pitch = part[PITCH][seen]
    forward = np.cos(pitch) * x - np.sin(pitch) * z
    up = np.sin(pitch) * x + np.cos(pitch) * z
    forward, up = forward - forward.mean(), up - up.mean()
    return [forward, up, forward**2, forward * up, up**2, pitch - pitch.mean()]


def _require_turning(times: Array, angle: Array) -> None:
    count = abs(angle[-1] - angle[0]) / _TURN
    if count < LEAST_TURNS:
        raise InputError(
            f"the rotor turns {count:.1f} times in the {np.ptp(times):.1f} s that count; a speed "
            f"needs {LEAST_TURNS:g} turns. Where it did not stall, drive it longer"
        )
    begin, turned = _progress(times, angle)
    slowest = int(np.argmin(turned))
    if turned[slowest] < STALLED:
        raise InputError(
            f"the rotor stalls, or a turn was not counted: from {begin[slowest]:.1f} s on it makes "
            f"{turned[slowest]:.2f} turns in {np.ptp(times) / count:.2f} s, the time of a mean turn"
        )


def _progress(times: Array, angle: Array) -> tuple[Array, Array]:
    """Return times (m,) [s] and how many turns the rotor makes in one mean turn's time after."""
    turn = _TURN * np.ptp(times) / abs(angle[-1] - angle[0])
    begin = times[times <= times[-1] - turn]
    moved = np.interp(begin + turn, times, angle) - np.interp(begin, times, angle)
    return begin, np.abs(moved) / _TURN


def _require_steady(times: Array, angle: Array) -> None:
    """Refuse a speed with a trend; what is uneven within a turn is none."""
    begin, turned = _progress(times, angle)
    change = float(np.polyfit(begin, turned, 1)[0] * np.ptp(times))
    if abs(change) > STEADY:
        raise InputError(
            f"the speed is not steady: it changes by {100 * change:+.1f} % over the "
            f"{np.ptp(times):.1f} s that count; let the motor warm up, or drive it longer"
        )


def _require_counted(times: Array, angle: Array) -> None:
    """Refuse a gap across which a steady rotor would have turned otherwise than was counted."""
    since = times - times.mean()
    residual = angle - np.polyval(np.polyfit(since, angle, 1), since)
    step = np.abs(np.diff(residual))
    worst = int(np.argmax(step))
    if step[worst] > MISCOUNTED_RAD:
        raise InputError(
            f"the rotor is not seen for {np.diff(times)[worst]:.2f} s at {times[worst]:.1f} s, and "
            f"the turns counted across it are off by {step[worst] / _TURN:.1f}"
        )
