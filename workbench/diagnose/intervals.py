"""How surely a fit tells the quantities of a cause.

Four things move them. Noise, by the curvature of what is minimised. The clutter of all causes that
the fit does not have: it holds them at zero, so what they really contribute is taken up by what is
free, along the lines of the neighbourhood. And what nothing explains, told from how much single
runs pull: all runs together pull nowhere at a minimum, and where each pulls its own way, a draw of
other runs would have ended elsewhere. That is the bootstrap over runs in closed form (turning the
signs of each run's pull as a whole, Wu 1986, doi:10.1214/aos/1176350142, gives this variance for a
neighbourhood of straight lines), told from as few runs as there are.

A robot that differs from the model in the same way in all runs pulls them together, so no run
tells of it. But it seldom differs only by what the cause imitates: what the fit leaves, and hangs
together in time, tells how large it is. As much of it as is left may have gone into the cause, any
share of that being as likely.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose.judging import Hypothesis
from workbench.diagnose.minimum import prior_of

__all__ = ["Spread", "spread"]

_TAIL = 0.05  # beyond either end of a 90 % interval
_ANY_SHARE = 1 / 3  # variance of what lies anywhere between -1 and 1


class Spread(NamedTuple):
    """How far the quantities of a cause may be off, scaled.

    Args:
        deviation: (q,) standard errors.
        within90: (q,) to either end of a 90 % interval.
    """

    deviation: NDArray[np.float64]
    within90: NDArray[np.float64]


def spread(one: Hypothesis, cause: str, doubt: float) -> Spread:
    """Return how far the quantities of a cause may be off in the fit of a hypothesis.

    Args:
        one: that has the cause.
        cause: its name.
        doubt: standard error of the square of what is left and hangs together.
    """
    layout, linear = one.near.layout, one.fit.linear
    prior, curvature = prior_of(layout, one.causes), linear.curvature
    free = prior.free
    own = np.searchsorted(free, layout.of_cause[cause])
    answers = np.linalg.inv(prior.added_to(curvature))[own]  # to a pull, (q, f)
    chance = np.diag(answers[:, own])
    seen = np.einsum("qf,fg,qg->q", answers, curvature[np.ix_(free, free)], answers)
    clutter = one.near.clutter.copy()
    clutter[layout.quantities(one.causes)] = 0.0
    hidden = np.sum((answers @ curvature[free] * clutter) ** 2, axis=1)
    pairs = zip(linear.jacobians, linear.residuals, strict=True)
    pulls = np.array([answers @ (slope[:, free].T @ left) for slope, left in pairs])  # (runs, q)
    runs = len(pulls)
    foreign = np.maximum(np.sum(pulls**2, axis=0) * runs / max(runs - 1, 1) - seen, 0.0)
    strange = max(one.left**2 - doubt, 0.0)
    taken_up = chance * one.near.samples * strange * _ANY_SHARE
    return _together(chance + hidden + taken_up, foreign, runs)


def _together(known: NDArray[np.float64], foreign: NDArray[np.float64], runs: int) -> Spread:
    """Return the spread by a known variance and one that so many runs tell.

    Degrees of freedom by Satterthwaite (Biometrics Bulletin 2, 1946, doi:10.2307/3002019).
    """
    deviation = np.sqrt(known + foreign)
    share = np.maximum(foreign / (known + foreign), 1e-6)
    return Spread(deviation, deviation * scipy.stats.t.isf(_TAIL, max(runs - 1, 1) / share**2))
