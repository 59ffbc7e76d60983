"""The base, fitted as far as it follows the runs."""

from __future__ import annotations

import numpy as np

from workbench.diagnose.hypotheses import Hypothesis, judged, left_together
from workbench.diagnose.problem import Problem
from workbench.diagnose.screen import Neighbourhood
from workbench.diagnose.solve import fit, prior_of

__all__ = ["FAR", "ROUGH", "fit_base", "windows_of"]

_WINDOWS_S = (1.0, 2.5, 5.0)
"""How much of each run the first fits see: a lightly damped beam forgets nothing, and a fit of
whole runs that starts far off falls into a wrong valley."""
ROUGH = 1.0  # of the cost: enough for a fit that only leads to the next
FAR = 1.0  # noise deviations that a fit leaves: the minimum lies in no neighbourhood of it
_ROUNDS = 8
_FAR_ROUNDS = 2  # of a base that cannot follow the runs anyway


def fit_base(problem: Problem) -> tuple[Hypothesis, float]:
    """Return the base with all causes around it, and how much of each run those are seen in [s].

    Where it leaves too much for any neighbourhood to reach the truth, they are seen around its fit
    of the longest window that it still follows, or of the first.
    """
    layout = problem.layout
    prior, every = prior_of(layout), np.arange(len(layout))
    z, far, rounds, windows = np.zeros(len(layout)), False, _ROUNDS, windows_of(problem)
    place, window = z, windows[0] if windows else np.inf
    for until in windows:
        found = fit(problem, z, prior, until, enough=ROUGH)
        z = found.z
        far = left_together(problem, problem.runs, found.residuals) > FAR
        if not far or until == window:
            place, window = z, until
        if far:
            break
        problem.look_again(z)
        twice = found.cost > problem.samples(until)  # what noise leaves
        rounds = _FAR_ROUNDS if twice else _ROUNDS
    whole = fit(problem, z, prior, enough=ROUGH, rounds=_FAR_ROUNDS) if far else None
    if whole is None or left_together(problem, problem.runs, whole.residuals) <= FAR:
        linear = problem.linear(z if whole is None else whole.z, every)
        whole = fit(problem, linear.z, prior, linear=linear, refresh=prior.free, rounds=rounds)
        base = judged(problem, (), whole, None)
        if base.left <= FAR:
            return base, np.inf
    left = left_together(problem, problem.runs, whole.residuals)
    linear = problem.linear(place, every, window)
    close = Neighbourhood(layout, linear, problem.samples(window))
    return Hypothesis((), whole, whole.cost, 0.0, left, left, close), window


def windows_of(problem: Problem) -> list[float]:
    """Return how much of each run is fitted before whole runs, shorter ones first [s]."""
    longest = max(float(problem.rig.runs[k].times[-1]) for k in problem.runs)
    return [window for window in _WINDOWS_S if window < longest]
