"""The fit, from a far start to its intervals: one recipe for every system.

Strong correction and the first seconds bring a far start near; whole runs follow, and the process
noise is weighed by the likelihood until it stays. Between stages the drive's angles are made anew
from states observed with strong correction: within a stage nothing changes, so that the cost is
smooth (`minimise`). Residuals are always those of full steps; only derivatives are of coarse ones.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from workbench.fit.carried import Transitions
from workbench.fit.estimator import NEAREST, Estimator, reaches
from workbench.fit.minimise import CLOSE, ROUGH, Minimum, minimum, soft
from workbench.fit.observer import Innovations, observe
from workbench.fit.parameters import ParameterVector, Scope
from workbench.fit.process import likeliest
from workbench.fit.system import System
from workbench.progress import Progress

__all__ = ["Fit", "fit_near", "fit_system", "minimised", "refined", "settled"]

Array = NDArray[np.float64]

_FIRST_S = 3.0
_FAR = 5.0  # times the strong process noise, where nothing is known

_MOST = 20  # evaluations of the residuals in one stage
_ROUNDS = 4  # of weighing noise and fitting, if the noise has not settled before
_FIRST_ROUNDS = 2  # the same in the first seconds, which only bring near
_PASSES = 3  # with coarse steps corrected anew
_STILL = 1.0  # squared step in standard errors over which that correction does not change
_OFF = 0.1  # prior deviations between a start and its bounds


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a fit ended.

    Args:
        estimator: with the process noise that was chosen.
        x: (p,) the minimiser's numbers [1].
        innovations: of each run there.
        jacobian: (m, p) of the residuals there [1].
        evaluations: how often all runs were observed for residuals.
        converged: whether the minimiser came to rest.
    """

    estimator: Estimator
    x: Array
    innovations: tuple[Innovations, ...]
    jacobian: Array
    evaluations: int
    converged: bool

    @property
    def vector(self) -> ParameterVector:
        """Return the parameters."""
        return self.estimator.vector

    @property
    def residuals(self) -> Array:
        """Return whitened innovations and priors, (m,) [1], as the Jacobian's rows."""
        return self.estimator.residuals_of(self.innovations, self.x)

    @property
    def ratios(self) -> Mapping[str, float]:
        """Return of each run the innovations over what noise and process noise allow."""
        return {
            name: float(np.sqrt(np.mean(one.white[np.isfinite(one.error)] ** 2)))
            for name, one in zip(self.estimator.system.names, self.innovations, strict=True)
        }


def fit_system(
    system: System,
    vector: ParameterVector,
    *,
    start: Array | None = None,
    late: Collection[str] = (),
    progress: Progress = lambda text: None,
    threads: int = 0,
    central: bool = True,
) -> Fit:
    """Fit parameters to all runs of a system.

    Args:
        system: with its runs.
        vector: of the parameters; those of single runs are held in the first stage.
        start: (p,) the minimiser's numbers to begin at [1]; nominal where left out.
        late: names of parameters that stay at their start in the first stage, too.
        progress: called at each stage.
        threads: 0 takes all cores.
        central: whether the Jacobian at the end is taken anew, by differences to both sides.

    Raises:
        InputError: when the start cannot be simulated.
    """
    x = _inside(vector, np.zeros(len(vector)) if start is None else start)
    progress("observe the runs with strong correction")
    estimator = refined(Estimator.of(system, vector, _far(system), threads=threads), x)
    every = vector.parameters
    first = np.array([p.scope is not Scope.RUN and p.name not in late for p in every])
    found = minimised(replace(estimator, window=_FIRST_S), x, first, _MOST, ROUGH)
    count, whole = found.evaluations, estimator.window
    short = replace(estimator.with_noise(system.strong), window=_FIRST_S)
    if any(short.samples(k) < estimator.samples(k) for k in range(len(system.names))):
        short, found, count = _weighed(short, found, progress, count, _FIRST_ROUNDS)[:3]
    return _rounds(replace(short, window=whole), found, progress, count, central)


def fit_near(estimator: Estimator, x: Array, progress: Progress = lambda text: None) -> Fit:
    """Return the fit from a place that is near, weighing the process noise anew.

    Args:
        estimator: with the process noise to begin with.
        x: (p,) the minimiser's numbers there [1].
        progress: called at each stage.
    """
    x = _inside(estimator.vector, x)
    begin = Minimum(x, np.zeros(0), np.zeros((0, len(x))), 0, False, np.inf)
    return _rounds(estimator, begin, progress, 0)


def settled(estimator: Estimator, x: Array) -> Fit:
    """Return the fit that ends near a place, with the estimator's process noise.

    Args:
        estimator: of the residuals.
        x: (p,) the minimiser's numbers there [1].
    """
    found = minimised(estimator, _inside(estimator.vector, x), None, _MOST)
    return _ended(estimator, found, found.evaluations)


def _rounds(
    estimator: Estimator, found: Minimum, progress: Progress, count: int, central: bool = True
) -> Fit:
    """Fit whole runs and weigh the process noise in turn, until it stays."""
    before = found._replace(jacobian=np.zeros((0, len(found.x))))
    progress("weigh correction against noise")
    estimator = likeliest(estimator, found.x)
    estimator, found, count, same = _weighed(estimator, before, progress, count)
    progress("fit whole runs")
    found = minimised(estimator, found.x, None, _MOST, CLOSE, found.jacobian, known=same)
    return _ended(estimator, found, count + found.evaluations, central)


def _weighed(
    estimator: Estimator, found: Minimum, progress: Progress, count: int, rounds: int = _ROUNDS
) -> tuple[Estimator, Minimum, int, bool]:
    """Return the fit at the likeliest process noise, and whether that stayed the same at last."""
    estimator = refined(estimator, found.x)
    transitions, same = Transitions(), False
    slopes, known = found.jacobian if len(found.jacobian) else None, False
    words = "fit whole runs" if np.isinf(estimator.window) else "fit the first seconds"
    for _ in range(rounds):
        progress(words)
        found = minimised(estimator, found.x, None, _MOST, ROUGH, slopes, known=known)
        count += found.evaluations
        progress("weigh correction against noise")
        weighed = likeliest(estimator, found.x)
        same = weighed.noise == estimator.noise
        if same:
            break
        slopes, known = transitions.carried(found.jacobian, found.x, estimator, weighed)
        estimator = refined(weighed, found.x)
    return estimator, found, count, same


def _ended(estimator: Estimator, found: Minimum, count: int, central: bool = True) -> Fit:
    innovations = tuple(estimator.innovations(found.x, keep=True))
    jacobian = found.jacobian
    if central:
        jacobian = estimator.jacobian(found.x, steps=reaches(found.jacobian), central=True)
    return Fit(estimator, found.x, innovations, jacobian, count, found.converged)


def minimised(
    estimator: Estimator,
    x: Array,
    free: NDArray[np.bool_] | None = None,
    most: int = 10,
    near: float = CLOSE,
    jacobian: Array | None = None,
    radius: float = 1.0,
    known: bool = True,
) -> Minimum:
    """Return the least cost of an estimator as it is; columns of held numbers are zero.

    A pass that ends costlier in full steps than it began is not taken: coarse steps may find a way
    that a hop does not take.

    Args:
        estimator: of the residuals.
        x: (p,) the minimiser's numbers at the start [1].
        free: (p,) which are moved; all where left out.
        most: evaluations of the residuals, of all passes.
        near: of `minimum`.
        jacobian: (m, p) of the residuals near the start [1], where one is known: it says how far
            differences may reach.
        radius: of `minimum`.
        known: whether it is of these residuals, not of an earlier stage.
    """
    moved = np.arange(len(x)) if free is None else np.flatnonzero(free)
    steps = np.full(len(x), NEAREST) if jacobian is None else reaches(jacobian)
    low, high = estimator.vector.bounds
    slopes = jacobian[:, moved] if known and jacobian is not None else None
    count = passes = 0

    def whole(part: Array) -> Array:
        full = x.copy()
        full[moved] = part
        return full

    def derivative(part: Array) -> Array:
        nonlocal steps
        found = estimator.jacobian(whole(part), moved, steps)
        steps = reaches(found)
        return found[:, moved]

    def cost(residuals: Array) -> float:
        return float(np.sum(soft(residuals, estimator.robust)))

    begun = estimator.residuals(x)
    while True:
        cheap = estimator.near(x)
        found = minimum(
            lambda part, cheap=cheap: cheap.residuals(whole(part)), derivative,
            x[moved], (low[moved], high[moved]), estimator.robust, most - count, near, slopes,
            radius, estimator.edges,
        )  # fmt: skip
        step, slopes = found.x - x[moved], found.jacobian
        count, passes, ended = count + found.evaluations, passes + 1, whole(found.x)
        residuals = estimator.residuals(ended)
        if worse := cost(residuals) > cost(begun):
            break
        x, begun = ended, residuals
        still = float(np.sum((slopes @ step) ** 2)) < max(near, _STILL)
        if still or passes == _PASSES or count >= most:
            break
    columns = np.zeros((len(begun), len(x)))
    columns[:, moved] = slopes
    return Minimum(x, begun, columns, count, found.converged and not worse, cost(begun))


def _far(system: System) -> dict[str, float]:
    """Return the process noise of the strongest correction."""
    return {group: _FAR * noise for group, noise in system.strong.items()}


def _inside(vector: ParameterVector, x: Array) -> Array:
    """Move numbers off their bounds: the minimiser would stay on one."""
    low, high = vector.bounds
    return np.clip(x, low + _OFF, np.maximum(high - _OFF, low + _OFF))


def refined(estimator: Estimator, x: Array) -> Estimator:
    """Return the estimator with its inputs made from the states observed.

    The states are those of the strongest correction, which are what was seen whatever the
    parameters: with a weak one near a resonance a wrong input makes the turn of T that makes it.

    Args:
        estimator: of the runs.
        x: (p,) the minimiser's numbers that they are observed at [1].
    """
    system = estimator.system
    whole = replace(estimator.with_noise(_far(system)), window=np.inf)
    jobs = [whole.job(k, x, coarse=True) for k in range(len(system.names))]
    found = observe(jobs, whole.threads, keep=True)
    return replace(estimator, system=system.refined([one.qpos for one in found]))
