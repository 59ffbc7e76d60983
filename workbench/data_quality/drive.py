"""The drive judged on its own: the speed that was asked for beside the rotor as it was seen.

The mean speed is where the rotor's angle, taken as a direction, agrees best with a steady turn:
turns that were counted wrongly, gaps and glitches do not move it. A motor may turn faster than
asked by a share and a constant, and slower under load, in all runs alike: those are causes, left to
the engine. A run that no such line joins with the others was not driven as its sheet says.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.data_quality.facts import Fault
from workbench.data_quality.onset import late_by
from workbench.fit import MeasuredRun, commanded_angle
from workbench.motion import ROTOR_ANGLE, TOP, position

__all__ = ["drive_faults"]

Array = NDArray[np.float64]

_START_UP_S = 1.0  # after the last change of the command
_WINDOW_S = 2.0
_LEAST_WINDOW_S = 0.8
_LEAST_SAMPLES = 30
_FASTEST_RAD_S = 150.0
_GRID_RAD_S = 0.5  # a quarter of what a window of two seconds separates
_STANDS_RAD_S = 0.5
_STALLED = 0.5  # of the usual speed
_APART = 0.02  # of the speed: what lines, unsteady motion and tilt of the tip leave of a sound run
_MOST_SHARE = 0.25  # of the speed: a line that is off by more is another unit
_MOST_OFFSET_RAD_S = 1.0
_ALONE = 0.05  # of the speed: a motor may be off by so much where no other run vouches for it
_LATE_S = 0.1
_AWAY_RAD = 0.15
_LEAST_STILL = 5  # samples
_REST_S = 0.3
_LAG_S = 0.05
_UNITS: Mapping[float, str] = {
    60 / (2 * np.pi): "revolutions a minute and rad/s",
    2 * np.pi: "revolutions a second and rad/s",
    180 / np.pi: "degrees and radians",
}
_SAME_UNIT = 0.03


class _Spin(NamedTuple):
    """How a rotor turned in one run.

    Args:
        run: its index.
        said: commanded speed [rad/s].
        windows: (w,) speeds, one after the other [rad/s].
        load: mean square speed of T over the rotor's [m^2/s]; the torque that swinging takes grows
            with it.
    """

    run: int
    said: float
    windows: Array
    load: float

    @property
    def speed(self) -> float:
        return float(np.median(self.windows))


@dataclass(frozen=True)
class _Line:
    """What a motor turns where a speed is asked for: (1 + share) asked + offset - droop load."""

    share: float = 0.0
    offset: float = 0.0
    droop: float = 0.0

    def at(self, spin: _Spin) -> float:
        return (1 + self.share) * spin.said + self.offset - self.droop * spin.load

    def joins(self, spin: _Spin) -> bool:
        return abs(spin.speed - self.at(spin)) < _APART * abs(spin.said)

    @property
    def possible(self) -> bool:
        within = abs(self.share) < _MOST_SHARE and abs(self.offset) < _MOST_OFFSET_RAD_S
        return within and self.droop >= 0

    @property
    def size(self) -> float:
        off = abs(self.share) / _MOST_SHARE + abs(self.offset) / _MOST_OFFSET_RAD_S
        return off + (self.droop > 0)


def drive_faults(runs: Sequence[MeasuredRun]) -> list[Fault]:
    """Return the runs that were not driven as they are said to be."""
    faults: list[Fault] = []
    turning: list[_Spin] = []
    for k, run in enumerate(runs):
        if not run.driven:
            continue
        faults += [Fault(k, text) for text in _late(run)]
        spin = _spin(k, run)
        if spin is None:
            continue
        wrong = _wrong_way(spin)
        if wrong:
            faults.append(Fault(k, wrong))
        else:
            turning.append(spin)
    return faults + list(_contradicted(turning))


def _spin(k: int, run: MeasuredRun) -> _Spin | None:
    """Return how a rotor turned; None where it is seen too little for that."""
    rises = [t for t, speed in run.steps if speed]
    if not rises:
        return None
    said = next(speed for _, speed in reversed(run.steps) if speed)
    ends = [t for t, speed in run.steps if not speed and t > rises[-1]]
    stop = min([*ends, float(run.motion.times[-1])])
    begin = min(rises[-1] + _START_UP_S, stop - _LEAST_WINDOW_S)
    if begin < rises[-1] or stop - begin < _LEAST_WINDOW_S:
        return None
    least = 2 if stop - begin > 2 * _LEAST_WINDOW_S else 1  # one window cannot show a stall
    count = max(least, round((stop - begin) / _WINDOW_S))
    edges = np.linspace(begin, stop, count + 1)
    part = run.motion.between(begin, stop)
    angle = np.where(part.validity(ROTOR_ANGLE), part[ROTOR_ANGLE], np.nan)
    windows = []
    for low, high in pairwise(edges):
        inside = (part.times >= low) & (part.times < high) & np.isfinite(angle)
        if inside.sum() >= _LEAST_SAMPLES:
            windows.append(_speed(part.times[inside], angle[inside]))
    if not windows:
        return None
    velocity = np.gradient(position(part, TOP)[:, [0, 2]], part.times, axis=0)
    square = np.nanmedian(np.sum(velocity**2, axis=1)) if np.isfinite(velocity).any() else 0.0
    return _Spin(k, said, np.array(windows), float(square) / abs(said))


def _speed(times: Array, angle: Array) -> float:
    """Return the steady speed that a direction follows best [rad/s]."""
    since, seen = times - times.mean(), np.exp(1j * angle)

    def against(speed: float) -> float:
        return -abs(complex(np.mean(seen * np.exp(-1j * speed * since))))

    grid = np.arange(-_FASTEST_RAD_S, _FASTEST_RAD_S, _GRID_RAD_S)
    agreement = np.abs(np.exp(-1j * np.outer(grid, since)) @ seen)
    best = float(grid[int(np.argmax(agreement))])
    return float(
        np.asarray(scipy.optimize.fminbound(against, best - _GRID_RAD_S, best + _GRID_RAD_S))
    )


def _wrong_way(spin: _Spin) -> str:
    """Return what shows that a motor did not run, or not that way; nothing where it did."""
    if abs(spin.speed) < _STANDS_RAD_S:
        return (
            f"the sheet says {spin.said:g} rad/s, but the rotor never turns; was the motor "
            "connected, or was this another run?"
        )
    if spin.speed * spin.said < 0:
        return (
            f"the rotor turns at {spin.speed:.2f} rad/s where {spin.said:+g} rad/s was commanded: "
            "the other way. Are the motor's wires or the camera axes turned round?"
        )
    usual = float(spin.windows[np.argmax(np.abs(spin.windows))])
    slow = np.flatnonzero(np.abs(spin.windows) < _STALLED * abs(usual))
    if len(slow):
        return (
            f"the rotor turns at {usual:.2f} rad/s, but in {len(slow)} of {len(spin.windows)} "
            f"parts of the run at {spin.windows[slow[0]]:.2f} rad/s: it stalled"
        )
    return ""


def _contradicted(spins: Sequence[_Spin]) -> Iterator[Fault]:
    """Find the runs that no line of a motor joins with the others."""
    if not spins:
        return
    line = _line(spins)
    joined = [spin for spin in spins if line.joins(spin)]
    for spin in spins:
        if spin not in joined:
            yield Fault(spin.run, _lie(spin, line, len(joined)))


def _line(spins: Sequence[_Spin]) -> _Line:
    """Return the line that joins most runs, of those the one least off the sheet."""
    if len(spins) == 1:
        share = spins[0].speed / spins[0].said - 1
        return _Line(share) if abs(share) < _ALONE else _Line()
    plain = [_Line(), *(_Line(share=one.speed / one.said - 1) for one in spins)]
    plain += [_Line(offset=one.speed - one.said) for one in spins]
    for one, other in combinations(spins, 2):
        if abs(one.said - other.said) > _APART * abs(one.said):
            slope = (one.speed - other.speed) / (one.said - other.said)
            plain.append(_Line(slope - 1, one.speed - slope * one.said))
    loaded = [
        _Line(line.share, line.offset, (line.at(one) - one.speed) / one.load)
        for line in plain
        if line.possible
        for one in spins
        if one.load > 0
    ]
    possible = [line for line in (*plain, *loaded) if line.possible]
    best = max(possible, key=lambda line: (sum(map(line.joins, spins)), -line.size))
    if 2 * sum(map(best.joins, spins)) > len(spins):
        return best
    return _Line()  # no line holds for most of them: the sheet itself is what they are held to


def _lie(spin: _Spin, line: _Line, joined: int) -> str:
    words = (
        f"the sheet says {spin.said:g} rad/s, but the rotor turned at {spin.speed:.2f} rad/s "
        f"({100 * (spin.speed / spin.said - 1):+.1f} %)"
    )
    if joined:
        words += (
            f"; {joined} other driven run(s) agree with each other, and the same motor would turn "
            f"at {line.at(spin):.2f} rad/s"
        )
    for ratio, units in _UNITS.items():
        for times in (ratio, 1 / ratio):
            if abs(spin.speed / spin.said / times - 1) < _SAME_UNIT:
                return f"{words}; {units} seem to be exchanged"
    return f"{words}. Is it another run's line of the sheet, or another voltage?"


def _late(run: MeasuredRun) -> Iterator[str]:
    """Find a time zero that is not the rotor's first motion."""
    angle = np.where(run.motion.validity(ROTOR_ANGLE), run.motion[ROTOR_ANGLE], np.nan)
    seen = np.isfinite(angle)
    times, direction = run.motion.times[seen], np.exp(1j * angle[seen])
    still = times < times[0] + _REST_S if len(times) else seen[:0]
    if still.sum() < _LEAST_STILL or times[0] > -_REST_S / 2:
        return
    rest = complex(np.median(np.real(direction[still])), np.median(np.imag(direction[still])))
    away = np.abs(np.angle(direction / rest)) > _AWAY_RAD
    fine = np.linspace(0, _WINDOW_S, round(_WINDOW_S / _LATE_S) * 10)
    meant = np.abs(commanded_angle(fine, run.steps, 1.0, _LAG_S, 0.0)) > _AWAY_RAD
    if not meant.any():
        return
    late = late_by(times, away, float(fine[int(np.argmax(meant))]))
    if late is not None and abs(late) > _LATE_S:
        yield (
            f"the rotor begins to turn {abs(late):.2f} s {'after' if late > 0 else 'before'} time "
            "zero; is its first motion in the take, and is the rest of the sheet right?"
        )
