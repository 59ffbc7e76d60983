"""The way from minimum to minimum of linear neighbourhoods, to that of the true problem.

What is minimised is the sum of squares of whitened residuals and of the distances of unknowns from
what is expected of them, in deviations of their priors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.layout import Layout
from workbench.diagnose.minimum import Prior, Step, step_from
from workbench.diagnose.problem import Linear, Problem
from workbench.progress import Progress

__all__ = ["ENOUGH", "TRIALS", "Fit", "fit", "renewed"]

ENOUGH = 0.5
"""Of the cost: what noise alone moves it by."""

_ROUGH = 0.01
"""Share of the cost beyond noise: a model that is far off need not be fitted closer."""

TRIALS = 24
"""Most steps of a fit, also of those that do not pay."""

_RENEWALS = 2
_MISLED = 5  # trials not believed: a neighbourhood that was taught so often is taken anew
_TRUST = 3.0  # times: a step is believed while the true gain is a third of the expected one
_HARDER, _EASIER = 2.0, 1 / 3  # times the damping, after a step that was not believed or was
_UNDAMPED = 0.01  # of what is expected of an unknown
_RENEWED = 0.01  # of the damping: some of it came of derivatives that were wrong
_ABSURD = 100.0  # times the cost: a robot that cannot stand teaches nothing of one that does


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a fit ended.

    Args:
        linear: the neighbourhood used last, with the residuals where the fit ended.
        cost: half the sum of squares, priors included.
        damping: of its last step.
        arrived: whether nothing more was foretold; not, where its trials were used up.
    """

    linear: Linear
    cost: float
    damping: float = 0.0
    arrived: bool = True

    @property
    def z(self) -> NDArray[np.float64]:
        """Return the scaled unknowns, (u,)."""
        return self.linear.z

    @property
    def residuals(self) -> list[NDArray[np.float64]]:
        """Return measured less predicted by run, (m_k,) whitened."""
        return self.linear.residuals

    def apart(self, other: Fit, samples: int) -> float:
        """Return by how many noise deviations two fits' predictions differ, root mean square."""
        return float(np.sqrt(self.linear.apart(other.linear) / samples))


def fit(
    problem: Problem,
    z: NDArray[np.float64],
    prior: Prior,
    until: float = np.inf,
    linear: Linear | None = None,
    refresh: NDArray[np.int_] | None = None,
    enough: float = ENOUGH,
    rough: float = _ROUGH,
    trials: int = TRIALS,
    settle: bool = True,
    damping: float = 0.0,
    tell: Progress = lambda text: None,
) -> Fit:
    """Find the minimum of the true problem near a place.

    By damped steps (Levenberg and Marquardt, unknowns in deviations of what is expected), whose
    neighbourhood learns from every trial what it foretold wrongly (Broyden; the secant version in
    Madsen, Nielsen and Tingleff, Methods for non-linear least squares problems, 2004, 3.5). A trial
    simulates every run once, derivatives ten times. The valleys of a lightly damped beam are
    curved: steps that were only cut short stopped on the way down (`tests/diagnose/test_solve.py`).

    Trials are simulated in coarse steps beside a place whose residuals are known; where nothing
    more is foretold, the true residuals are taken, and the fit goes on from there. Where they cost
    more than before, it goes back and on in fine steps.

    Args:
        problem: with its runs.
        z: (u,) where to begin.
        prior: of the unknowns.
        until: how much of each run counts [s].
        linear: a neighbourhood taken nearby.
        refresh: which columns are taken anew; None takes those that are free.
        enough: expected gain of the cost that is worth no further step.
        rough: the same as a share of the cost beyond noise.
        trials: most steps, also of those that do not pay.
        settle: whether to take derivatives anew where nothing more is foretold, and go on once.
        damping: of the first step.
        tell: is told each trial.
    """
    columns = prior.free if refresh is None else refresh
    way = _Descent(problem, z, prior, columns, until, linear, damping)
    noise, renewals = problem.samples(until) / 2, _RENEWALS
    while True:
        step = way.step()
        ended = step.gain < max(enough, rough * (way.cost - noise))
        stale = way.learnt and settle if ended else way.misled >= _MISLED
        if stale and renewals > 0 and trials > 0:
            way.renew()
            renewals, settle = renewals - 1, settle and not ended
        elif not ended and trials > 0:
            way.attempt(step, tell)
            trials -= 1
        elif way.known:
            return Fit(way.linear, way.cost, way.damping, ended)
        else:
            way.confirm()


class _Descent:
    """A fit on its way.

    Args:
        problem: with its runs.
        z: (u,) where it begins.
        prior: of the unknowns.
        columns: of the derivatives that are taken anew.
        until: how much of each run counts [s].
        linear: a neighbourhood taken nearby, if there is one.
        damping: of the first step.

    Attributes:
        linear: where it is.
        cost: there, as far as it is known.
        learnt: whether the derivatives were taken elsewhere, or were taught by trials.
        misled: trials that were not believed, since derivatives were taken.
    """

    def __init__(
        self,
        problem: Problem,
        z: NDArray[np.float64],
        prior: Prior,
        columns: NDArray[np.int_],
        until: float,
        linear: Linear | None,
        damping: float,
    ) -> None:
        self._problem, self._prior, self._columns, self._until = problem, prior, columns, until
        self.learnt = linear is not None and not np.array_equal(linear.z, z)
        if linear is None:
            linear = problem.linear(z, columns, until)
        elif self.learnt:
            linear = linear.at(z, problem.residuals(z, until))
        self.linear, self.damping, self.misled = linear, damping, 0
        self.cost = self._least = self._cost(linear.residuals, z)
        self._harder, self._fine = _HARDER, False
        self._anchor = problem.anchor(linear.z, linear.residuals, until)
        self._curvature = linear.curvature_of(prior.free)

    @property
    def known(self) -> bool:
        """Tell whether the residuals are those of fine steps."""
        return self._fine or self.linear.z is self._anchor.z

    def step(self) -> Step:
        """Return the step that the neighbourhood asks for."""
        z, gradient, layout = self.linear.z, self.linear.gradient, self._problem.layout
        return step_from(layout, z, self._curvature, gradient, self._prior, self.damping)

    def attempt(self, step: Step, tell: Progress) -> None:
        """Simulate where a step leads, learn from it, and go there if it is cheaper."""
        if self._fine:
            residuals = self._problem.residuals(step.z, self._until)
        else:
            residuals = self._problem.beside(self._anchor, step.z)
        less = self._cost(residuals, step.z)
        tell(f"{less:.1f}, expected {self.cost - step.gain:.1f}, damping {self.damping:.2g}")
        if less < _ABSURD * self.cost:
            layout, arrived = self._problem.layout, less < self.cost
            self.linear, change = _taught(layout, self.linear, step.z, residuals, arrived)
            self._curvature, self.learnt = self._curvature + change, True
        kept = (self.cost - less) / step.gain
        self.cost = min(self.cost, less)
        if kept * _TRUST > 1:
            damping = self.damping * max(_EASIER, 1 - (2 * min(kept, 1.0) - 1) ** 3)
            self.damping, self._harder = damping if damping > _UNDAMPED else 0.0, _HARDER
        else:
            self.damping = max(self.damping, 1.0) * self._harder
            self._harder, self.misled = 2 * self._harder, self.misled + 1

    def renew(self) -> None:
        """Take the derivatives anew, and the residuals in fine steps."""
        linear = renewed(self._problem, self.linear.z, self._columns, self._until, self.linear)
        self.damping, self._harder = _RENEWED * self.damping, _HARDER
        self._curvature = linear.curvature_of(self._prior.free)
        self.learnt, self.misled = False, 0
        self._ascertain(linear)

    def confirm(self) -> None:
        """Take the residuals in fine steps."""
        z = self.linear.z
        self._ascertain(self.linear.at(z, self._problem.residuals(z, self._until)))

    def _ascertain(self, linear: Linear) -> None:
        """Go on from true residuals, or back to the last ones where coarse steps led uphill."""
        self.cost = self._cost(linear.residuals, linear.z)
        if self.cost > self._least:
            linear, self._fine = linear.at(self._anchor.z, self._anchor.residuals), True
            self.cost = self._least
        elif not self._fine and linear.z is not self._anchor.z:
            self._anchor = self._problem.anchor(linear.z, linear.residuals, self._until)
        self.linear, self._least = linear, self.cost

    def _cost(self, residuals: list[NDArray[np.float64]], z: NDArray[np.float64]) -> float:
        return sum(float(part @ part) for part in residuals) / 2 + self._prior.cost(z)


def _taught(
    layout: Layout,
    linear: Linear,
    z: NDArray[np.float64],
    residuals: list[NDArray[np.float64]],
    arrive: bool,
) -> tuple[Linear, NDArray[np.float64]]:
    """Return a neighbourhood that foretells a trial: each run's derivatives changed the least.

    A change of rank one changes the curvature by what costs no more than a gradient; the product
    of the derivatives, anew after each trial, took as long as the trial. That change is returned as
    well, (u, u); it holds for the unknowns that move.

    Args:
        layout: tells which unknowns a run depends on.
        linear: neighbourhood that the trial was taken from.
        z: (u,) place of the trial.
        residuals: there, by run.
        arrive: whether the trial is the new place, or only taught something of the old one.
    """
    move, matrices = z - linear.z, []
    change = np.zeros((len(z), len(z)))
    parts = zip(linear.runs, linear.residuals, residuals, linear.jacobians, strict=True)
    for k, before, after, matrix in parts:
        own = np.flatnonzero((move != 0) & ((layout.run < 0) | (layout.run == k)))
        taught = matrix.copy()
        if len(own):
            missed = before - after - matrix[:, own] @ move[own]
            way = np.zeros(len(z))
            way[own] = move[own] / (move[own] @ move[own])
            taught[:, own] += np.outer(missed, way[own])
            half = np.outer(matrix.T @ missed + (missed @ missed) / 2 * way, way)
            change += half + half.T
        matrices.append(taught)
    return (linear.at(z, residuals) if arrive else linear).with_jacobians(matrices), change


def renewed(
    problem: Problem,
    z: NDArray[np.float64],
    columns: NDArray[np.int_],
    until: float,
    before: Linear,
) -> Linear:
    """Return a neighbourhood with some columns taken anew and the others kept."""
    taken = problem.linear(z, columns, until)
    matrices = []
    for old, new in zip(before.jacobians, taken.jacobians, strict=True):
        mixed = old.copy()
        mixed[:, columns] = new[:, columns]
        matrices.append(mixed)
    return taken.with_jacobians(matrices)
