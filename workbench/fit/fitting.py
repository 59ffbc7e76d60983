"""The fit, from a far start to its intervals: one recipe for every system.

Strong correction, the first seconds and coarse steps bring a far start near; whole runs follow, and
the process noise is weakened as far as the likelihood says. After every stage the drive's angles
are made anew from the observed states, and glitches are left out: within a stage nothing changes,
so that the cost is smooth. The minimiser is scipy's trust-region reflective method.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.fit.estimator import ROBUST, Estimator
from workbench.fit.observer import Innovations
from workbench.fit.parameters import ParameterVector, Scope
from workbench.fit.process import likeliest
from workbench.fit.system import System
from workbench.progress import Progress

__all__ = ["Fit", "fit_system", "minimised", "refined", "settled"]

Array = NDArray[np.float64]

_FIRST_S = 3.0
_FAR = 5.0  # times the strong process noise, where nothing is known
_GLITCH = 7.0  # deviations of one that is left out
_LONGEST = 3  # samples of a glitch; what lasts longer is not one
_FTOL, _XTOL = 3e-5, 1e-4
_OFF = 0.1  # prior deviations between a start and its bounds


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a fit ended.

    Args:
        estimator: with the process noise that was chosen.
        x: (p,) the minimiser's numbers.
        innovations: of each run there.
        jacobian: (m, p) of the residuals there.
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
        """Return whitened innovations and priors, (m,), as the Jacobian's rows."""
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
    progress: Progress = lambda text: None,
    threads: int = 0,
) -> Fit:
    """Fit parameters to all runs of a system.

    Args:
        system: with its runs.
        vector: of the parameters; those of single runs are held in the first stage.
        start: (p,) numbers to begin at; nominal where left out.
        progress: is told each stage.
        threads: 0 takes all cores.

    Raises:
        InputError: when the start cannot be simulated.
    """
    x = np.zeros(len(vector)) if start is None else start.copy()
    x = _inside(vector, x)
    strong = dict(system.strong)
    estimator = Estimator.of(system, vector, _far(system), threads=threads)
    estimator = replace(estimator, coarse=True)
    count = 0
    progress("observe the runs with strong correction")
    estimator = refined(estimator, x)
    held = np.array([p.scope is Scope.RUN for p in vector.parameters])
    near = replace(estimator, window=_FIRST_S)
    x, n, _ = minimised(near, x, free=~held, most=10)
    count += n
    progress("fit whole runs with strong correction")
    estimator = refined(estimator.with_noise(strong), x)
    x, n, _ = minimised(estimator, x, most=4)
    count += n
    estimator = refined(replace(estimator, coarse=False), x)
    progress("weigh correction against noise")
    estimator = likeliest(estimator, x)
    progress("fit whole runs")
    x, n, _ = minimised(estimator, x, most=5)
    estimator = likeliest(refined(estimator, x), x, down=2, up=1)
    count += n
    x, n, converged = minimised(estimator, x, most=6)
    return _ended(estimator, x, count + n, converged)


def settled(estimator: Estimator, x: Array) -> Fit:
    """Return the fit that ends near numbers (p,), with the estimator's process noise."""
    x, count, converged = minimised(estimator, _inside(estimator.vector, x), most=6)
    return _ended(estimator, x, count, converged)


def _ended(estimator: Estimator, x: Array, count: int, converged: bool) -> Fit:
    found = tuple(estimator.innovations(x, keep=True))
    return Fit(estimator, x, found, estimator.jacobian(x), count, converged)


def minimised(
    estimator: Estimator, x: Array, free: NDArray[np.bool_] | None = None, most: int = 10
) -> tuple[Array, int, bool]:
    """Return the numbers of the least cost, how many residuals that took, and whether it rests.

    Args:
        estimator: of the residuals.
        x: (p,) start.
        free: (p,) which are moved; all where left out.
        most: evaluations of the residuals.
    """
    moved = np.flatnonzero(np.ones(len(x), dtype=np.bool_) if free is None else free)
    if not len(moved):
        return x, 0, True

    def whole(part: Array) -> Array:
        full = x.copy()
        full[moved] = part
        return full

    low, high = estimator.vector.bounds
    found = scipy.optimize.least_squares(
        _remembered(lambda part: estimator.residuals(whole(part))), x[moved],
        jac=lambda part: estimator.jacobian(whole(part), moved)[:, moved],
        bounds=(low[moved], high[moved]), loss="soft_l1", f_scale=ROBUST, max_nfev=most,
        ftol=_FTOL, xtol=_XTOL, x_scale=1.0,
    )  # fmt: skip
    return whole(found.x), int(found.nfev), bool(found.status > 0)


def _far(system: System) -> dict[str, float]:
    """Return the process noise of the strongest correction."""
    return {group: _FAR * noise for group, noise in system.strong.items()}


def _inside(vector: ParameterVector, x: Array) -> Array:
    """Move numbers off their bounds: the minimiser would stay on one."""
    low, high = vector.bounds
    return np.clip(x, low + _OFF, np.maximum(high - _OFF, low + _OFF))


def _remembered(function: Callable[[Array], Array]) -> Callable[[Array], Array]:
    last: list[tuple[Array, Array]] = []

    def asked(x: Array) -> Array:
        if not last or not np.array_equal(last[0][0], x):
            last[:] = [(x.copy(), function(x))]
        return last[0][1]

    return asked


def refined(estimator: Estimator, x: Array) -> Estimator:
    """Return the estimator with its inputs and its glitches made from the states observed.

    The states are those of the strongest correction, which are what was seen whatever the
    parameters: with a weak one near a resonance a wrong input makes the turn of T that makes it.
    """
    system = estimator.system
    whole = replace(estimator.with_noise(_far(system)), window=np.inf)
    found = whole.innovations(x, keep=True)
    masks = tuple(_glitches(one.error) for one in found)
    return replace(estimator, system=system.refined([one.qpos for one in found]), masks=masks)


def _glitches(error: Array) -> NDArray[np.bool_]:
    """Return the samples, (n, c), that stand out of their channel for a moment."""
    size = 1.4826 * np.nanmedian(np.abs(error), axis=0)
    wild = np.nan_to_num(np.abs(error)) > _GLITCH * size
    lasting = scipy.ndimage.binary_opening(wild, np.ones((_LONGEST + 1, 1)))
    return wild & ~lasting
