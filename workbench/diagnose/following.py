"""Windows of hops predicted from the stances that fit best.

How a window begins is not known, only what was seen in it. So each is predicted from the stance
that makes the prediction fit best, whatever the model: what no stance makes up for is what the
model gets wrong (variable projection; Golub and Pereyra 1973, doi:10.1137/0710036). Models that
differ a little are followed by one step of straight lines from where the first of them stands
(Kaufman 1975, doi:10.1007/BF01932995).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.windows import Windows
from workbench.sim import STANCE, Standing
from workbench.timeseries import TimeSeries

__all__ = ["Followed", "Hop", "Look", "best", "followable", "followed", "moved"]

Array = NDArray[np.float64]
Look = Callable[[TimeSeries], Array]
"""What cameras see of a motion, (n, c)."""

_WIDE = np.array([5e-3, 1e-3, 0.02, 0.1, 0.1, 0.02, 1.0, 2.0, 2.4, 0.1])
"""How far a stance may be from rest, and foot and rotor from where they are seen, in the units of
`STANCE`: what hops of the thesis' robot reach."""
_STEPS = np.array([1e-4, 5e-5, 2e-4, 2e-4, 2e-4, 2e-4, 4e-3, 4e-3, 4e-3, 1e-3])
"""Of differences: in all its samples together a window changes by 0.2 to 1 noise deviations."""
_TRIALS, _TURNS = 6, 8  # steps in all, and in a search from rest with derivatives taken anew
_ENOUGH, _ARRIVED = 0.05, 0.5  # of the cost of a window that a step is said to gain
_CAREFUL = 1.0, 30.0  # damping of the first step from rest; the better way counts
_HARDER, _EASIER = 8.0, 0.2  # times the damping, after a step that did not pay or did
_LEAST, _MOST_DAMPING = 1e-3, 100.0  # less is none
_SHORT = 1.0  # of the sum of squares: a step that changes less tells of jumps, not of slopes
_LOST = 1.5  # noise deviations that a model leaves of a window
_SHORTER = (0.75, 0.5)
_FARTHER, _ALIKE = 4.0, 0.3  # times the steps of derivatives, which change by a smaller share
_ABSURD = 100.0  # times the cost: what leads there teaches nothing


@dataclass(frozen=True, eq=False)
class Hop:
    """A robot that windows may be predicted of.

    Args:
        standing: the robot.
        look: what is seen of it.
        lead: samples of its command before the run begins.
    """

    standing: Standing
    look: Look
    lead: int

    def told(self, windows: Windows, stances: Array) -> Array:
        """Return what is predicted from stances, (k w, n, c), k of them for each window."""
        return np.array([self.look(one) for one in self.motions(windows, stances)])

    def motions(self, windows: Windows, stances: Array) -> list[TimeSeries]:
        """Return how it moves from stances, k of them for each window."""
        begins = np.tile(np.array(windows.begins), len(stances) // len(windows)) + self.lead
        return self.standing.go_on(begins.tolist(), stances, windows.count)


@dataclass(frozen=True, eq=False)
class Followed:
    """Windows as a model follows them best.

    Args:
        stances: (w, s) where they begin.
        told: (w, n, c) predicted from there.
        slopes: (w, n, c, s) how that changes with the stance.
        damping: (w,) of the steps towards the best.
    """

    stances: Array
    told: Array
    slopes: Array
    damping: Array

    def chosen(self, at: NDArray[np.int_]) -> Followed:
        """Return some of them."""
        every = (self.stances, self.told, self.slopes, self.damping)
        return Followed(*(one[at] for one in every))


def followed(windows: Windows, hop: Hop, begin: Followed | None = None) -> Followed:
    """Return windows predicted from the stances that fit best.

    By damped steps, a damping for each window; derivatives learn from each trial (Broyden).

    Args:
        windows: of a hop.
        hop: of the robot that they are of.
        begin: where a model like it stood; None begins at rest, with derivatives taken anew.
    """
    if begin is None:
        bold, careful = (_found(windows, hop, damping) for damping in _CAREFUL)
        better = np.flatnonzero(_cost(windows, careful) < _cost(windows, bold))
        return _with(bold, better, careful.chosen(better))
    told = hop.told(windows, begin.stances)
    return _descended(windows, hop, replace(begin, told=told))


def followable(windows: Windows, hop: Hop) -> tuple[Windows, Followed]:
    """Return windows as long as a model follows them from some stance, and how it does.

    One that is not followed, or only to a jump, ends earlier; where that does not help, it is left
    out.
    """
    found: list[tuple[Windows, Followed]] = []
    left = windows
    for share in (1.0, *_SHORTER):
        left = left.cut(round(share * windows.count))
        there = followed(left, hop)
        held, there = _held(left, hop, there)
        found.append((left.chosen(np.flatnonzero(held)), there.chosen(np.flatnonzero(held))))
        left = left.chosen(np.flatnonzero(~held))
        if not len(left):
            break
    return _joined(found)


def _held(windows: Windows, hop: Hop, there: Followed) -> tuple[NDArray[np.bool_], Followed]:
    """Tell which windows are followed, and change smoothly; return derivatives by short steps."""
    short, long = (
        _taken(windows, hop, there.stances, there.damping, share) for share in (1.0, _FARTHER)
    )
    one, other = (windows.white(taken.slopes) for taken in (short, long))
    apart, size = (np.linalg.norm(part, axis=1) for part in (one - other, one))
    alike = np.all(apart < _ALIKE * size, axis=1)
    return alike & (windows.left(best(windows, there)) < _LOST), short


def _joined(parts: Sequence[tuple[Windows, Followed]]) -> tuple[Windows, Followed]:
    """Return windows that were found in parts, in the order of their times."""
    begins = np.concatenate([np.array(one.begins, dtype=int) for one, _ in parts])
    order = np.argsort(begins)
    values, seen, expected = (
        np.concatenate([getattr(one, name) for one, _ in parts])[order]
        for name in ("values", "seen", "expected")
    )
    told = (
        np.concatenate([getattr(one, name) for _, one in parts])[order]
        for name in ("stances", "told", "slopes", "damping")
    )
    found = Windows(tuple(begins[order].tolist()), values, seen, expected, parts[0][0].noise)
    return found, Followed(*told)


def _found(windows: Windows, hop: Hop, damping: float) -> Followed:
    """Return windows followed from what is seen of their stances, derivatives taken anew."""
    careful = np.full(len(windows), damping)
    there = _taken(windows, hop, windows.expected, careful)
    for _ in range(_TURNS):
        there = _descended(windows, hop, there)
        left = np.flatnonzero(_step(windows, there)[1] > _ARRIVED)
        if not len(left):
            break
        some = windows.chosen(left)
        anew = _taken(some, hop, there.stances[left], there.damping[left])
        there = _with(there, left, _descended(some, hop, anew))
    return there


def _with(there: Followed, at: NDArray[np.int_], by: Followed) -> Followed:
    """Return the same with some of them as they are elsewhere."""
    stances, told, slopes, damping = (
        one.copy() for one in (there.stances, there.told, there.slopes, there.damping)
    )
    stances[at], told[at], slopes[at], damping[at] = by.stances, by.told, by.slopes, by.damping
    return Followed(stances, told, slopes, damping)


def moved(windows: Windows, hop: Hop, looks: Sequence[Look], beside: Followed) -> list[Array]:
    """Return what a model like the one that was followed tells by straight lines, (w, n, c) each.

    Args:
        windows: of a hop.
        hop: of that model.
        looks: what is seen of it, in several ways.
        beside: where the other one stood.
    """
    motions, told = hop.motions(windows, beside.stances), best(windows, beside)
    changes = [np.array([look(one) for one in motions]) - beside.told for look in looks]
    return [told + _unmade(windows, beside, change) for change in changes]


def _unmade(windows: Windows, there: Followed, change: Array) -> Array:
    """Return what is left of a change, (w, n, c), once the stances make up for what they can."""
    step, _ = _step(windows, Followed(
        windows.expected, windows.values + change, there.slopes, np.zeros(len(windows))
    ))  # fmt: skip
    return change + np.einsum("wncs,ws->wnc", there.slopes, step)


def best(windows: Windows, there: Followed) -> Array:
    """Return what the best stance tells, by straight lines as far as they held, (w, n, c)."""
    step, _ = _step(windows, there)
    return there.told + np.einsum("wncs,ws->wnc", there.slopes, step)


def _descended(windows: Windows, hop: Hop, there: Followed) -> Followed:
    """Return where damped steps lead."""
    cost = _cost(windows, there)
    for _ in range(_TRIALS):
        step, gain = _step(windows, there)
        moving = gain >= _ENOUGH
        if not moving.any():
            break
        step[~moving] = 0.0
        stances = there.stances + step
        told = hop.told(windows, stances)
        after = _cost(windows, replace(there, stances=stances, told=told))
        foretold = np.einsum("wncs,ws->wnc", there.slopes, step)
        missed = told - there.told - foretold
        scaled = step / _WIDE**2
        along = scaled / np.maximum(np.sum(scaled * step, axis=1), 1e-12)[:, None]
        short = np.sum(windows.white(foretold) ** 2, axis=1) < _SHORT
        along[short | (after > _ABSURD * cost)] = 0.0
        slopes = there.slopes + np.einsum("wnc,ws->wncs", missed, along)
        better, damping = after < cost, there.damping
        held = better & (2 * (cost - after) > gain)
        damping = np.where(
            better, damping * np.where(held, _EASIER, 1.0), np.maximum(damping, _LEAST) * _HARDER
        )
        damping = np.where(moving, damping, there.damping)
        there = Followed(
            np.where(better[:, None], stances, there.stances),
            np.where(better[:, None, None], told, there.told),
            slopes,
            np.where(damping < _LEAST, 0.0, np.minimum(damping, _MOST_DAMPING)),
        )
        cost = np.minimum(cost, after)
    return there


def _cost(windows: Windows, there: Followed) -> Array:
    """Return half the sum of squares of each window, (w,): what is left, and the stance's own."""
    left = windows.white(windows.values - there.told)
    beyond = (there.stances - windows.expected) / _WIDE
    return (np.sum(left**2, axis=1) + np.sum(beyond**2, axis=1)) / 2


def _step(windows: Windows, there: Followed) -> tuple[Array, Array]:
    """Return the step of each window's stance and the gain that it is said to have."""
    left = windows.white(windows.values - there.told)
    slopes = windows.white(there.slopes) * _WIDE
    beyond = (there.stances - windows.expected) / _WIDE
    curvature = np.einsum("wms,wmt->wst", slopes, slopes)
    gradient = np.einsum("wms,wm->ws", slopes, left) - beyond
    matrix = curvature + np.eye(len(_WIDE))
    diagonal = np.einsum("wss->ws", matrix)
    damped = matrix + (there.damping[:, None] * diagonal)[:, :, None] * np.eye(len(_WIDE))
    step = np.linalg.solve(damped, gradient[:, :, None])[:, :, 0]
    gain = np.sum(gradient * step, axis=1) - np.einsum("ws,wst,wt->w", step, matrix, step) / 2
    return step * _WIDE, gain


def _taken(
    windows: Windows,
    hop: Hop,
    stances: Array,
    damping: Array,
    share: float = 1.0,
) -> Followed:
    """Return windows from some stances, with derivatives by a share of the usual differences."""
    width, steps = len(STANCE), share * _STEPS
    many = np.concatenate([stances, *(stances + steps * axis for axis in np.eye(width))])
    told = hop.told(windows, many)
    told = told.reshape(width + 1, len(windows), *told.shape[1:])
    slopes = np.moveaxis((told[1:] - told[0]) / steps[:, None, None, None], 0, -1)
    return Followed(stances, told[0], slopes, damping)
