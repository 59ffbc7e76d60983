"""Ring-downs and drops judged on their own: what was pulled or lifted beside what was seen.

How far T is held from the middle of its swings shows the pull, by the model's own static sag. A
model that is too soft shows that in all ring-downs alike, which is a cause; one run that disagrees
with the others was pulled otherwise than its sheet says.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.data_quality.bodies import Expected
from workbench.data_quality.facts import Fault
from workbench.data_quality.onset import late_by
from workbench.fit import MeasuredRun
from workbench.motion import FOOT, RELEASED, ROTOR_ANGLE, TOP, position, seen_median

__all__ = ["release_faults"]

Array = NDArray[np.float64]

_PULL_APART = 0.25  # of the pull, between ring-downs of one robot
_PULL_TIMES = 2.0  # what no model is off by in all of them
_CENTRE_M = 3e-3  # a strip that creeps or has play swings about a middle that is off by as much
_FELLOWS = 3
_LEAST_SWING_M = 1.5e-3
_GROWS = 1.3  # times: two modes that beat make less of it
_TURNS_RAD = 1.0
_LATE_S = 0.15  # the release of a weak pull is found within 0.09 s, in noise that lasts
_USUAL_S = 0.03  # from a release to a fifth of the way
_WAY_SHARE = 0.2
_LEAST_SAMPLES = 15
_REST_S = 0.3
_LANDED_S = 0.5
_FALL_APART_M, _FALL_APART = 0.01, 0.25
_NOTHING_M = 1e-4


def release_faults(
    runs: Sequence[MeasuredRun], expected: Sequence[Expected], chosen: Sequence[int]
) -> list[Fault]:
    """Return those of the chosen ring-downs and drops that are not what they are said to be."""
    found = [Fault(k, text) for k in chosen if runs[k].mode in RELEASED for text in _alone(runs[k])]
    faulty = {fault.run for fault in found}
    pulls = {
        k: _pull_share(runs[k], expected[k])
        for k in chosen
        if runs[k].mode == "decay" and k not in faulty
    }
    known = {k: share for k, share in pulls.items() if np.isfinite(share)}
    ways = {k: float(np.linalg.norm(expected[k].top - expected[k].free)) for k in known}
    return [*found, *_pulls(runs, known, ways)]


def _alone(run: MeasuredRun) -> Iterator[str]:
    """Find what one run shows without the others; a rotor that turns explains all the rest."""
    turns = list(_turns(run))
    yield from turns or (*_no_swing(run), *_late(run), *_fall(run))


def _turns(run: MeasuredRun) -> Iterator[str]:
    if ROTOR_ANGLE not in run.motion:
        return
    after = run.motion.between(0.0, np.inf)
    angle = after[ROTOR_ANGLE][after.validity(ROTOR_ANGLE) & np.isfinite(after[ROTOR_ANGLE])]
    apart = np.abs(np.angle(np.exp(1j * (angle - seen_median(angle))))) if len(angle) else angle
    if len(apart) and np.percentile(apart, 75) > _TURNS_RAD:
        yield f"the rotor turns, though the robot is said to {run.mode}; was the motor running?"


def _no_swing(run: MeasuredRun) -> Iterator[str]:
    """Find a ring-down in which nothing swings, or swings more and more."""
    if run.mode != "decay":
        return
    after = run.motion.between(0.0, np.inf)
    path = position(after, TOP)[:, [0, 2]]
    seen = np.isfinite(path).all(axis=1)
    if seen.sum() < _LEAST_SAMPLES:
        return
    path = path[seen]
    way = np.linalg.norm(path - np.median(path, axis=0), axis=1)
    first, _, last = (float(np.median(part)) for part in np.array_split(way, 3))
    if np.percentile(way, 75) < _LEAST_SWING_M:
        yield (
            f"T swings by {1000 * np.percentile(way, 75):.1f} mm only after its release; was it "
            "let go while the cameras recorded?"
        )
    elif last > _GROWS * first:
        yield (
            f"T swings ever more, {1000 * first:.1f} mm in the first and {1000 * last:.1f} mm in "
            "the last third, where a ring-down fades; was the motor running?"
        )


def _late(run: MeasuredRun) -> Iterator[str]:
    """Find a time zero that is not the release."""
    path = position(run.motion, RELEASED[run.mode])
    seen = np.isfinite(path).all(axis=1)
    times, path = run.motion.times[seen], path[seen]
    if len(times) < _LEAST_SAMPLES or times[0] > -_REST_S:
        return
    rest = np.median(path[times < times[0] + _REST_S], axis=0)
    way = np.linalg.norm(path - rest, axis=1)
    far = max(float(np.percentile(way, 75)), _LEAST_SWING_M)
    late = late_by(times, way > _WAY_SHARE * far, _USUAL_S)
    if late is not None and abs(late) > _LATE_S:
        yield (
            f"it is let go {abs(late):.2f} s {'after' if late > 0 else 'before'} time zero; does "
            "the take begin at rest, and did anybody touch the robot before?"
        )


def _fall(run: MeasuredRun) -> Iterator[str]:
    """Find a drop from another height than the sheet says."""
    if run.mode != "drop":
        return
    height = position(run.motion, FOOT)[:, 2]
    held = seen_median(height[run.motion.times < 0])
    landed = seen_median(height[run.motion.times > _LANDED_S])
    fell = held - landed
    if abs(fell - run.height) > _FALL_APART_M + _FALL_APART * run.height:
        yield (
            f"the sheet says it fell by {1000 * run.height:.0f} mm, but the foot came down by "
            f"{1000 * fell:.0f} mm"
        )


def _pull_share(run: MeasuredRun, model: Expected) -> float:
    """Return how far T was held over how far the stated pull holds the model's, along it."""
    pulled = model.top - model.free
    way = float(np.linalg.norm(pulled))
    if not way > _NOTHING_M:
        return np.nan
    path = position(run.motion, TOP)[:, [0, 2]]
    before, after = run.motion.times < 0, run.motion.times >= 0
    held, centre = (np.array([seen_median(c) for c in path[part].T]) for part in (before, after))
    return float((held - centre) @ pulled) / way**2


def _pulls(
    runs: Sequence[MeasuredRun], shares: dict[int, float], ways: dict[int, float]
) -> Iterator[Fault]:
    """Report pulls that disagree with those of the other ring-downs, or with any model.

    Args:
        runs: all.
        shares: run -> how far T was held, over how far the stated pull holds the model's.
        ways: run -> the latter [m].
    """
    if not shares:
        return
    values = np.array(list(shares.values()))
    nearest = float(values[np.argmin(np.abs(values - 1))])
    usual = float(np.median(values)) if len(values) >= _FELLOWS else nearest
    if not 1 / _PULL_TIMES < usual < _PULL_TIMES:
        usual = 1.0
    for k, share in shares.items():
        alone = len(shares) == 1 and 1 / _PULL_TIMES < share < _PULL_TIMES
        apart = abs(share / usual - 1)
        if apart > _PULL_APART and apart * ways[k] > _CENTRE_M and not alone:
            yield Fault(
                k,
                f"the sheet says T was pulled by {runs[k].pull:g} N, but it was held as far out "
                f"as {share / usual * runs[k].pull:.2g} N would hold it, by "
                f"{'the other ring-downs' if len(shares) > 1 else 'the model'}",
            )
