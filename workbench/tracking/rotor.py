"""The rotor's angle across gaps, the speed of each turn, the mean speed and its error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.tracking.autocorrelation import block_covariance, time_blocks

__all__ = ["RotorAngle", "RotorSpeed", "Turns", "mean_speed", "turns", "unwrapped"]

_TURN = 2 * np.pi
_SURE_STEP_RAD = np.pi / 2  # a longer step between seen samples is resolved by the speed
_LOCAL_S = 0.5  # about a turn on either side of a gap, for the speed in it
_LEAST_LOCAL = 5
_SPEED_UNKNOWN = 0.25  # relative uncertainty of a speed known from the rest of the run only
_RIPPLE_RAD = 0.5  # what a turn's uneven speed may add
_PASSAGE_RAD = np.pi / 4  # between the samples about a passage
_HARMONICS = 2
_BLOCKS = 10
_LEAST_TURNS = 3


class RotorAngle(NamedTuple):
    """The angle of the rotor about T.

    Args:
        angle: (n,) unwrapped [rad], NaN where not known.
        resolved: gaps of half a turn or more whose turns follow from the speed beside them.
        unresolved_s: lengths of the other ones [s]; after each the angle may be wrong by whole
            turns.
    """

    angle: NDArray[np.float64]
    resolved: int
    unresolved_s: tuple[float, ...]


class Turns(NamedTuple):
    """Whole turns that were seen to begin and end, m of them.

    Args:
        starts: (m,) [s].
        stops: (m,) [s].
        speeds: (m,) [rad/s], negative where the angle falls.
    """

    starts: NDArray[np.float64]
    stops: NDArray[np.float64]
    speeds: NDArray[np.float64]


@dataclass(frozen=True)
class RotorSpeed:
    """The mean speed of the rotor over a part of a run.

    Args:
        value: [rad/s], negative where the angle falls.
        standard_error: [rad/s].
        turns: how many it is over.
    """

    value: float
    standard_error: float
    turns: float


def unwrapped(times: NDArray[np.float64], wrapped: NDArray[np.float64]) -> RotorAngle:
    """Count the turns of an angle, across gaps too.

    Steps of less than a quarter turn are taken the short way. In a longer one the rotor is expected
    to turn by the mean of the speeds on both sides. That determines the number of turns as long as
    no speed between the two allows another one.

    Args:
        times: (n,) increasing [s].
        wrapped: (n,) [rad], known up to whole turns; NaN where not seen.
    """
    known = np.flatnonzero(np.isfinite(wrapped))
    out = np.full(len(wrapped), np.nan)
    if len(known) == 0:
        return RotorAngle(out, 0, ())
    t, angle = times[known], np.unwrap(wrapped[known])
    steps, moved = np.diff(t), np.diff(angle)
    if len(steps) == 0:
        out[known] = angle
        return RotorAngle(out, 0, ())
    usual = float(np.median(steps))
    fast = float(np.percentile(np.abs(moved) / steps, 90))
    gaps = np.flatnonzero((steps > 1.5 * usual) & (fast * steps > _SURE_STEP_RAD))
    edges = np.concatenate(([0], gaps + 1, [len(t)]))
    drive = _drive(t, angle, steps <= 1.5 * usual)
    unresolved: list[float] = []
    for number, gap in enumerate(gaps):
        before = slice(edges[number], gap + 1)
        after = slice(gap + 1, edges[number + 2])
        missing, sure = _turns_between((t[before], angle[before]), (t[after], angle[after]), drive)
        angle[gap + 1 :] += _TURN * missing
        if not sure:
            unresolved.append(float(steps[gap]))
    out[known] = angle
    return RotorAngle(out, len(gaps) - len(unresolved), tuple(unresolved))


_Piece = tuple[NDArray[np.float64], NDArray[np.float64]]


def _drive(t: NDArray[np.float64], angle: NDArray[np.float64], sure: NDArray[np.bool_]) -> float:
    """Return the median speed of the steps that move [rad/s]."""
    speeds = (np.diff(angle) / np.diff(t))[sure]
    if len(speeds) == 0:
        return 0.0
    moving = np.abs(speeds) > 0.5 * np.percentile(np.abs(speeds), 90)
    return float(np.median(speeds[moving])) if moving.any() else 0.0


def _turns_between(before: _Piece, after: _Piece, drive: float) -> tuple[int, bool]:
    """Return the turns to add after a gap, and whether they are the only ones possible."""
    gap = float(after[0][0] - before[0][-1])
    moved = float(after[1][0] - before[1][-1])
    speeds = [_local_speed(before, -1), _local_speed(after, 0)]
    known = [speed for speed in speeds if speed is not None]
    speed = float(np.mean(known)) if known else drive
    doubt = 0.5 * abs(known[0] - known[1]) if len(known) == 2 else _SPEED_UNKNOWN * abs(speed)
    missing = round((speed * gap - moved) / _TURN)
    apart = abs(speed * gap - moved - _TURN * missing)
    explained = apart < doubt * gap + _RIPPLE_RAD
    return missing, explained and apart + doubt * gap < np.pi


def _local_speed(piece: _Piece, end: int) -> float | None:
    """Return the slope of the half second at one end of a piece [rad/s], None where too short."""
    t, angle = piece
    near = np.abs(t - t[end]) <= _LOCAL_S
    if np.count_nonzero(near) < _LEAST_LOCAL:
        return None
    return float(np.polyfit(t[near] - t[end], angle[near], 1)[0])


def turns(times: NDArray[np.float64], angle: NDArray[np.float64], at: float = 0.0) -> Turns:
    """Return the time of each whole turn, from one passage of an angle to the next.

    A passage is placed between the two seen samples about it; where they are more than an eighth
    of a turn apart it is left out, and the turns that it bounds with it.

    Args:
        times: (n,) increasing [s].
        angle: (n,) unwrapped [rad], NaN where not seen.
        at: the angle that is passed [rad].
    """
    seen = np.isfinite(angle)
    t, phi = times[seen], angle[seen] - at
    sense = 1.0 if len(phi) == 0 or phi[-1] >= phi[0] else -1.0
    ahead = np.maximum.accumulate(sense * phi / _TURN)  # noise never undoes a passage
    first = np.floor(ahead[:-1]) + 1
    passed = np.flatnonzero(ahead[1:] >= first)
    sharp = passed[np.diff(ahead)[passed] < _PASSAGE_RAD / _TURN]
    share = (first[sharp] - ahead[sharp]) / np.diff(ahead)[sharp]
    when = t[sharp] + share * np.diff(t)[sharp]
    whole = np.diff(first[sharp]) == 1
    starts, stops = when[:-1][whole], when[1:][whole]
    return Turns(starts, stops, sense * _TURN / (stops - starts))


def mean_speed(
    times: NDArray[np.float64],
    angle: NDArray[np.float64],
    start: float = -np.inf,
    stop: float = np.inf,
) -> RotorSpeed:
    """Return the mean speed by a line through the angle, and its error for correlated residuals.

    Two harmonics of the turn are fitted beside the line, so that uneven turning cannot tilt it. The
    residuals are not white: the standard error is that of `block_covariance` over ten blocks.

    Args:
        times: (n,) increasing [s].
        angle: (n,) unwrapped [rad], NaN where not seen.
        start: of the part to look at [s].
        stop: its end [s].

    Raises:
        InputError: the rotor is seen over less than three turns there.
    """
    inside = (times >= start) & (times <= stop) & np.isfinite(angle)
    t, phi = times[inside], angle[inside]
    count = abs(phi[-1] - phi[0]) / _TURN if len(phi) else 0.0
    if count < _LEAST_TURNS:
        raise InputError(
            f"the rotor is seen over {count:.1f} turns; a mean speed with its error needs "
            f"{_LEAST_TURNS}. Choose a longer part of the run."
        )
    middle, half = (t[0] + t[-1]) / 2, (t[-1] - t[0]) / 2
    slope, level = np.polyfit(t - middle, phi, 1)
    mean_phase = np.outer(level + slope * (t - middle), np.arange(1, _HARMONICS + 1))
    terms = np.column_stack(
        [(t - middle) / half, np.ones_like(t), np.cos(mean_phase), np.sin(mean_phase)]
    )
    solution = np.linalg.lstsq(terms, phi)[0]
    covariance = block_covariance(terms, phi - terms @ solution, time_blocks(t, _BLOCKS))
    error = float(np.sqrt(covariance[0, 0])) / half
    return RotorSpeed(float(solution[0] / half), error, float(count))
