"""What was filmed, judged against itself: bodies that are rigid, still or clamped, and their names.

A path of a body cannot jump, the rotor is a fixed way from T, a clamped foot stands still. Where T
rests is foretold by the model to some centimetres; axes or bodies that were exchanged put it
elsewhere. One run in which T rests otherwise than in its fellows is another robot.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from workbench.data_quality.facts import Fault
from workbench.fit import MeasuredRun
from workbench.motion import FOOT, ROTOR, TOP, position, seen_median

__all__ = ["Expected", "body_faults"]

Array = NDArray[np.float64]

_CLAMPED = ("clamped", "decay")
_FOOT_MOVES_M = 1e-3  # root mean square beyond what it is at rest
_FOOT_STANDS_M = 5e-4
_FOOT_SHOULD_M = 3e-3
_MISPLACED_M = 0.06  # more than sag, tilt and slope together move T
_MISNAMED_M = 0.025  # somewhat less than the rotor's arm
_EXPLAINED = 1 / 3  # of that: what an exchange of axes or bodies must leave at most
_OTHERWISE_M = 5e-3  # of T's place between runs of one robot
_FELLOWS = 3
_SIDE = 6  # samples on either side of a jump
_GLITCHES = 2  # samples beside a jump that may be off
_JUMP_M = 4e-3
_JUMP_TIMES = 10.0  # the noise: half as much again as the greatest in ten seconds of it
_ARM_SPREAD_M = 1.5e-3
_ARM_TIMES = 2.5  # the fellows' spread
_LATEST_SAMPLES = 6
_ALIGNED = 0.5  # of the spread, that may be left once the rotor is shifted
_TENTHS = 2.563  # standard deviations between the tenths at either end


@dataclass(frozen=True, eq=False)
class Expected:
    """What the model says of one run, before anything is fitted.

    Args:
        top: (2,) place of T from the foot before time zero, x and z [m].
        free: (2,) the same without a pull [m]; that of `top` where nothing pulls.
        foot_moves: root mean square way of the foot [m].
    """

    top: Array
    free: Array
    foot_moves: float


def body_faults(runs: Sequence[MeasuredRun], expected: Sequence[Expected]) -> list[Fault]:
    """Return the runs whose bodies are not where, or not what, they are said to be."""
    found: list[Fault] = []
    for k, (run, model) in enumerate(zip(runs, expected, strict=True)):
        texts = [*_foot(run, model), *_exchanged(run, model), *_jumps(run), *_late_rotor(run)]
        found += [Fault(k, text) for text in texts]
    faulty = {fault.run for fault in found}
    rest = [k for k in range(len(runs)) if k not in faulty]
    return [*found, *_elsewhere(runs, expected, rest), *_loose(runs, rest)]


def _foot(run: MeasuredRun, model: Expected) -> Iterator[str]:
    """Find a clamped foot that moves, and a free one that does not."""
    if FOOT[0] not in run.motion:
        return
    path = position(run.motion, FOOT)[:, [0, 2]]
    before, after = run.motion.times < 0, run.motion.times >= 0
    if not np.isfinite(path[before]).any() or not np.isfinite(path[after]).any():
        return
    rest = np.nanmedian(path[before], axis=0)
    still, moved = (_spread(path[part] - rest) for part in (before, after))
    way = float(np.sqrt(max(moved**2 - still**2, 0.0)))
    if run.mode in _CLAMPED and way > _FOOT_MOVES_M:
        yield (
            f"the foot is said to be clamped but moves by {1000 * way:.1f} mm (root mean square); "
            "was it a hop, or is the clamp loose?"
        )
    if run.mode == "hop" and model.foot_moves > _FOOT_SHOULD_M and way < _FOOT_STANDS_M:
        yield (
            f"it is said to hop but the foot moves by {1000 * way:.1f} mm only, where the model's "
            f"moves by {1000 * model.foot_moves:.0f} mm; was the foot clamped?"
        )


def _spread(path: Array) -> float:
    """Return the root mean square way, the farthest percent left out."""
    way = np.linalg.norm(path, axis=1)
    way = way[np.isfinite(way)]
    return float(np.sqrt(np.mean(way[way <= np.percentile(way, 99)] ** 2)))


def _at_rest(run: MeasuredRun, body: tuple[str, str, str]) -> Array:
    """Return the median place of a body before time zero, (3,) [m]; of a foot not filmed, zero."""
    if body[0] not in run.motion:
        return np.zeros(3)
    path = position(run.motion.between(-np.inf, 0.0), body)
    return np.array([seen_median(column) for column in path.T])


def _middle(run: MeasuredRun, body: tuple[str, str, str]) -> Array:
    """Return where a body rests without a pull, (3,) [m]: in a ring-down, what it swings about."""
    if run.mode != "decay":
        return _at_rest(run, body)
    path = position(run.motion.between(0.0, np.inf), body)
    return np.array([seen_median(column) for column in path.T])


def _exchanged(run: MeasuredRun, model: Expected) -> Iterator[str]:
    """Find T so far off that exchanged axes or bodies explain it better than any beam."""
    if run.mode == "drop":
        return  # a hand holds the robot at any tilt
    seen = _middle(run, TOP) - _at_rest(run, FOOT)
    off = float(np.linalg.norm(seen[[0, 2]] - model.free))
    if not off > _MISNAMED_M:
        return
    x, y, z = seen
    ways = {
        "x and z are exchanged": (z, x),
        "forward and sideways are exchanged": (y, z),
        "sideways and up are exchanged": (x, y),
        "forward is backward": (-x, z),
        "up is down": (x, -z),
        "foot and T are exchanged": (-x, -z),
    }
    if off < _MISPLACED_M:
        ways = {}
    if ROTOR[0] in run.motion:
        rotor = _middle(run, ROTOR) - _at_rest(run, FOOT)
        ways["T and rotor are exchanged"] = (rotor[0], rotor[2])
    left = {way: float(np.linalg.norm(np.array(place) - model.free)) for way, place in ways.items()}
    best = min(left, key=lambda way: left[way], default="")
    if best and left[best] < _EXPLAINED * off:
        yield (
            f"T rests {1000 * off:.0f} mm from where the model's does; if {best}, "
            f"{1000 * left[best]:.0f} mm are left. Look at axes and body names"
        )


def _jumps(run: MeasuredRun) -> Iterator[str]:
    """Find a path of T that goes on elsewhere from one picture to the next."""
    path = position(run.motion, TOP)[:, [0, 2]]
    if len(path) < 2 * _SIDE:
        return
    windows = sliding_window_view(path, 2 * _SIDE, axis=0)  # (n, 2, 12)
    jumps = np.linalg.norm(windows @ _steps().T, axis=1)  # (n, ways to leave samples out)
    size = np.nan_to_num(jumps).min(axis=1)
    worst = int(np.argmax(size))
    noise = float(run.noise()[[run.channels.index(TOP[axis]) for axis in (0, 2)]].max())
    if size[worst] > max(_JUMP_M, _JUMP_TIMES * noise):
        yield (
            f"T jumps by {1000 * size[worst]:.0f} mm or more at "
            f"{run.motion.times[worst + _SIDE]:.2f} s, "
            "from one picture to the next, and goes on there; did a marker slip, or were two "
            "bodies exchanged?"
        )


@cache
def _steps() -> Array:
    """Return weights (w, 12) that measure the step in the middle of a smooth path, beside a cubic.

    Each leaves out up to two of the samples: some of them are deaf to any two glitches.
    """
    at = np.arange(2 * _SIDE) - _SIDE + 0.5
    terms = np.column_stack([at**0, at, at**2, at**3, (at > 0).astype(float)])
    found = []
    for count in range(_GLITCHES + 1):
        for out in combinations(range(2 * _SIDE), count):
            kept = np.setdiff1d(np.arange(2 * _SIDE), out)
            weights = np.zeros(2 * _SIDE)
            weights[kept] = np.linalg.pinv(terms[kept])[-1]
            found.append(weights)
    return np.array(found)


def _arm(run: MeasuredRun, late: int = 0) -> Array:
    """Return the way from T to the rotor, (n,) [m], the rotor taken some samples earlier."""
    top, rotor = position(run.motion, TOP), position(run.motion, ROTOR)
    count = len(top) - abs(late)
    top, rotor = (top[:count], rotor[late:]) if late >= 0 else (top[-late:], rotor[:count])
    return np.linalg.norm(rotor - top, axis=1)


def _scatter(way: Array) -> float:
    """Return the standard deviation, deaf to glitches; NaN where unseen.

    From the tenths at either end: a slip in a fifth of a run is seen, a glitch now and then not.
    """
    seen = way[np.isfinite(way)]
    return float(np.ptp(np.percentile(seen, [10, 90]))) / _TENTHS if len(seen) else float("nan")


def _late_rotor(run: MeasuredRun) -> Iterator[str]:
    """Find a rotor that was filmed at other instants than T: its rigid arm would breathe."""
    if ROTOR[0] not in run.motion or len(run.motion) < 2 * _LATEST_SAMPLES:
        return
    now = _scatter(_arm(run))
    scatter = {n: _scatter(_arm(run, n)) for n in range(-_LATEST_SAMPLES, _LATEST_SAMPLES + 1)}
    late = min(scatter, key=lambda n: scatter[n])
    if late and now > _ARM_SPREAD_M and scatter[late] < _ALIGNED * now:
        step = float(np.median(np.diff(run.motion.times)))
        yield (
            f"the rotor is seen {abs(late)} picture(s) ({1000 * abs(late) * step:.0f} ms) "
            f"{'after' if late > 0 else 'before'} T: its way from T varies by "
            f"{1000 * now:.1f} mm, shifted by so much by {1000 * scatter[late]:.1f} mm"
        )


def _loose(runs: Sequence[MeasuredRun], chosen: Sequence[int]) -> Iterator[Fault]:
    """Find a run in which the way from T to the rotor varies more than in its fellows."""
    scatter = {k: _scatter(_arm(runs[k])) for k in chosen if ROTOR[0] in runs[k].motion}
    for driven in (True, False):
        group = {k: way for k, way in scatter.items() if runs[k].driven == driven}
        if len(group) < _FELLOWS:
            continue
        usual = float(np.median(list(group.values())))
        for k, way in group.items():
            if way > _ARM_TIMES * usual and way > usual + _ARM_SPREAD_M:
                yield Fault(
                    k,
                    f"the way from T to the rotor, which is rigid, varies by {1000 * way:.1f} "
                    f"mm, and by {1000 * usual:.1f} mm in the other runs; did a marker slip?",
                )


def _elsewhere(
    runs: Sequence[MeasuredRun], expected: Sequence[Expected], chosen: Sequence[int]
) -> Iterator[Fault]:
    """Find a run in which T rests otherwise than in its fellows; their common place is a cause."""
    for mode in ("clamped", "hop"):
        group = [k for k in chosen if runs[k].mode == mode]
        off = {}
        for k in group:
            seen = _at_rest(runs[k], TOP) - _at_rest(runs[k], FOOT)
            off[k] = seen[[0, 2]] - expected[k].top
        off = {k: way for k, way in off.items() if np.isfinite(way).all()}
        if len(off) < 2:
            continue
        nearest = min(off.values(), key=lambda way: float(np.linalg.norm(way)))
        usual = np.median(list(off.values()), axis=0) if len(off) >= _FELLOWS else nearest
        for k, way in off.items():
            apart = 1000 * float(np.linalg.norm(way - usual))
            if apart > 1000 * _OTHERWISE_M:
                yield Fault(
                    k,
                    f"T rests {apart:.1f} mm from where it rests in the other {mode} runs; was "
                    "the strip bent, the robot clamped anew or a marker moved?",
                )
