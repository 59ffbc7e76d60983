"""The statistical model, and the residuals and derivatives that follow from it.

For a run with samples k, theta the parameters:

    x[k+1] = F(x[k], u[k]; theta) + w[k],   w ~ N(0, Q),   F: MuJoCo over one sample
    y[k]   = h(x[k]; theta) + v[k],         v ~ N(0, R)
    e[k]   = y[k] - h(xp[k]),               S[k] = H P H' + R
    xp: the predicted state; it is corrected by P H' S^-1 e before the next sample

    -2 log L = sum over k of (e' S^-1 e + log det S)
               + sum over priors of ((theta - nominal) / deviation)^2

The innovations e are one-step prediction errors: their sum is smooth in theta where a free
simulation dephases or becomes chaotic (Ljung, System Identification, 1999, chapter 7). Q is the
process noise per group of joints, what the model misses in N m sqrt(s) and N sqrt(s); with Q = 0
they are simulation errors. P stays the same while theta changes, so derivatives are plain
differences.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import accumulate
from operator import is_

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.gain import Gain, Modes, stationary
from workbench.fit.minimise import soft
from workbench.fit.observer import Innovations, Job, observe
from workbench.fit.parameters import ParameterVector
from workbench.fit.system import System

__all__ = ["NEAREST", "REFUSED", "ROBUST", "Estimator", "counted", "reaches"]

Array = NDArray[np.float64]

ROBUST = 4.0
"""Innovations beyond so many deviations pull less: glitches are not the robot."""

NEAREST = 0.1
"""Prior deviations that a parameter is moved for a difference where nothing is known of it."""
_FARTHEST = 0.5
"""The same at most, where it does little: over less, landings and slips that come a sample sooner
or later make the slope of a hop a chance. Of sticking friction in four hops it was 132 residuals'
deviations over 0.02, 64 over 0.7, and only steps by the wider ones lowered the cost."""

_SHARES = (1.0, 0.1, 0.01)  # of a difference: as much of it as can be simulated
_REMEMBERED = 2  # a minimiser ends at its last numbers, or at those before
_COARSE = 8  # the same in coarse steps, of all that were made of one estimator
REFUSED = 1e3
"""Residual of a run that cannot be simulated."""


@dataclass(frozen=True, eq=False)
class Estimator:
    """The innovations of a system's runs as a function of its parameters.

    Args:
        system: with its runs.
        vector: of the parameters.
        noise: process noise of each group of joints.
        modes: of each run, about the rest of the nominal system.
        gains: of each run.
        masks: of each run, (n, c): samples that are left out.
        threads: 0 takes all cores.
        window: how much of each run is observed, from its first sample [s].
        defect: (m,) what the residuals of full steps are beyond those of coarse ones, near some
            parameters [1]; None where residuals are of full steps.
    """

    system: System
    vector: ParameterVector
    noise: Mapping[str, float]
    modes: tuple[Modes, ...]
    gains: tuple[Gain, ...]
    masks: tuple[NDArray[np.bool_], ...]
    threads: int = 0
    window: float = np.inf
    defect: Array | None = None
    _found: list[tuple[Array, list[Innovations]]] = field(default_factory=list, init=False)
    _kept: list[tuple[tuple[object, ...], Array, list[Array]]] = field(default_factory=list)

    @classmethod
    def of(
        cls,
        system: System,
        vector: ParameterVector,
        noise: Mapping[str, float],
        threads: int = 0,
        masks: Sequence[NDArray[np.bool_]] = (),
    ) -> Estimator:
        """Return the estimator of a system with a process noise.

        Args:
            system: with its runs.
            vector: of the parameters.
            noise: process noise of each group of joints.
            threads: 0 takes all cores.
            masks: of each run, (n, c): samples that are left out; none where left out.
        """
        runs = range(len(system.names))
        modes = tuple(system.modes(k) for k in runs)
        given = tuple(masks) or tuple(np.zeros(system.seen(k).shape, dtype=np.bool_) for k in runs)
        gains = _gains(system, modes, noise)
        return cls(system, vector, noise, modes, gains, given, threads)

    def with_noise(self, noise: Mapping[str, float]) -> Estimator:
        """Return the estimator with another process noise."""
        gains = _gains(self.system, self.modes, noise)
        return replace(self, noise=dict(noise), gains=gains)

    def uncorrected(self) -> Estimator:
        """Return the estimator without correction: its innovations are simulation errors."""
        system, runs = self.system, range(len(self.modes))
        nothing = dict.fromkeys(system.groups, 0.0)
        gains = tuple(
            stationary(self.modes[k], system.process(k, nothing), system.sigma(k), system.sample_s)
            for k in runs
        )
        return replace(self, noise=nothing, gains=gains)

    def depends_on(self, group: str) -> bool:
        """Return whether a group's process noise acts in any run."""
        probe = dict.fromkeys(self.system.groups, 0.0) | {group: 1.0}
        return any(self.system.process(k, probe).any() for k in range(len(self.system.names)))

    def log_likelihood(self, x: Array) -> float:
        """Return log L at parameters (p,), without the priors and what does not depend on them.

        Innovations count as in a robust fit: far beyond the noise they count in proportion.

        Args:
            x: (p,) the minimiser's numbers [1].
        """
        total = 0.0
        for one in self.innovations(x, keep=True):
            total += float(np.sum(soft(counted(one), ROBUST))) + float(np.sum(one.information))
        return -total / 2

    def job(self, run: int, x: Array, coarse: bool = False) -> Job:
        """Return the observer's job of a run at parameters (p,).

        Args:
            run: its number.
            x: (p,) the minimiser's numbers [1].
            coarse: whether the steps may be coarser than the model's own.

        Raises:
            InputError: when they cannot be simulated.
        """
        start = self.system.start(run, self.vector.values(x), coarse)
        seen = np.where(self.masks[run], np.nan, self.system.seen(run))[: self.samples(run)]
        return Job.of(start, seen, self.gains[run])

    def _felt(self, run: int) -> list[int]:
        parameters = self.vector.parameters
        return [i for i in self.vector.touching(run) if self.system.feels(run, parameters[i])]

    def samples(self, run: int) -> int:
        """Return how many samples of a run are observed."""
        return int(min(len(self.system.seen(run)), self.window / self.system.sample_s + 0.5))

    def innovations(self, x: Array, keep: bool = False) -> list[Innovations]:
        """Return the innovations of every run.

        Args:
            x: (p,) the minimiser's numbers [1].
            keep: whether the states are kept, and the answer for whoever asks for it again.
        """
        for at, found in self._found:
            if np.array_equal(at, x):
                return found
        found = observe((self.job(k, x) for k in range(len(self.masks))), self.threads, keep)
        if keep:
            self._found[:] = [(x.copy(), found), *self._found[: _REMEMBERED - 1]]
        return found

    def near(self, x: Array) -> Estimator:
        """Return the estimator whose residuals are cheap, and those of full steps at numbers (p,).

        What coarse steps do otherwise hardly changes with the parameters: they are corrected by
        what they were off there (defect correction; Stetter, Numer. Math. 29, 1978, 425).

        Args:
            x: (p,) the minimiser's numbers [1].
        """
        return replace(self, defect=self.residuals(x) - self.coarse(x))

    def coarse(self, x: Array) -> Array:
        """Return `residuals` of coarse steps, (m,) [1].

        Args:
            x: (p,) the minimiser's numbers [1].
        """
        try:
            return np.concatenate([*self._coarse(x), self.vector.priors(x)])
        except InputError:
            return self._refused(x)

    def _refused(self, x: Array) -> Array:
        return np.concatenate([np.full(self.edges[-2], REFUSED), self.vector.priors(x)])

    def _coarse(self, x: Array) -> list[Array]:
        """Return how each run's innovations count in coarse steps, (n c,) [1]; the last are kept.

        A minimiser asks where it begins, and where it takes derivatives, once more.
        """
        whose = (self.system, self.vector, self.gains, self.masks)
        sizes = np.diff(self.edges[:-1]).tolist()
        for owner, at, found in self._kept:
            same = all(map(is_, owner, whose)) and [len(one) for one in found] == sizes
            if same and np.array_equal(at, x):
                return found
        jobs = (self.job(k, x, coarse=True) for k in range(len(self.masks)))
        found = [counted(one).ravel() for one in observe(jobs, self.threads)]
        self._kept[:] = [(whose, x.copy(), found), *self._kept[: _COARSE - 1]]
        return found

    def residuals(self, x: Array) -> Array:
        """Return the whitened innovations of all runs, then the priors, (m,) [1].

        Args:
            x: (p,) the minimiser's numbers [1].
        """
        try:
            if self.defect is not None:
                return np.concatenate([*self._coarse(x), self.vector.priors(x)]) + self.defect
            found = self.innovations(x, keep=True)
        except InputError:
            return self._refused(x)
        return self.residuals_of(found, x)

    def residuals_of(self, found: Sequence[Innovations], x: Array) -> Array:
        """Return the residuals, (m,) [1], of innovations that were observed.

        Args:
            found: innovations of each run.
            x: (p,) the minimiser's numbers that they were observed at [1].
        """
        return np.concatenate([*(counted(one).ravel() for one in found), self.vector.priors(x)])

    def jacobian(
        self,
        x: Array,
        asked: Sequence[int] | NDArray[np.int64] | None = None,
        steps: Array | None = None,
        central: bool = False,
    ) -> Array:
        """Return the derivatives of the residuals, (m, p) [1], by differences of coarse steps.

        Args:
            x: (p,) the minimiser's numbers [1].
            asked: (k,) columns that are wanted, the others stay zero; all where left out.
            steps: (p,) how far each is moved, of `reaches` [1]; the nearest where left out.
            central: whether differences that are long go to both sides: twice the cost, and
                directions that do nothing are seen to do nothing.
        """
        steps = np.full(len(x), NEAREST) if steps is None else steps
        runs = range(len(self.system.names))
        central = central and not self.short
        wanted = set(range(len(x)) if asked is None else map(int, asked))
        moves = [(k, i) for k in runs for i in self._felt(k) if i in wanted]
        low, high = self.vector.bounds
        below = np.clip(x - steps, low, high)
        if central:
            ahead, behind = np.minimum(x + steps, high), below
        else:
            inside = (low <= x + steps) & (x + steps <= high)
            ahead, behind = np.where(inside, x + steps, below), x

        lengths = list[float]()

        def jobs() -> Iterator[Job]:
            for k, i in moves:
                ends = [end[i] for end in ((ahead, behind) if central else (ahead,))]
                share, moved = self._towards(k, x, i, ends)
                lengths.append(share * (ahead[i] - behind[i]))
                yield from moved

        base = [] if central else self._coarse(x)
        found = [counted(one).ravel() for one in observe(jobs(), self.threads)]
        if central:
            changes = [a - b for a, b in zip(found[::2], found[1::2], strict=True)]
        else:
            changes = [one - base[k] for (k, _), one in zip(moves, found, strict=True)]
        edges = self.edges
        jacobian = np.zeros((edges[-1], len(x)))
        for (k, i), change, length in zip(moves, changes, lengths, strict=True):
            jacobian[edges[k] : edges[k + 1], i] = change / length
        jacobian[edges[-2] :] = self.vector.prior_slopes(x)
        return jacobian

    def _towards(
        self, run: int, x: Array, number: int, ends: Sequence[float]
    ) -> tuple[float, list[Job]]:
        """Return coarse jobs with a number moved to each end, and how much of the way it went."""

        def jobs(share: float) -> list[Job]:
            found = []
            for end in ends:
                moved = x.copy()
                moved[number] += share * (end - x[number])
                found.append(self.job(run, moved, coarse=True))
            return found

        *shares, least = (one * self._length(run) for one in _SHARES)
        for share in shares:
            with suppress(InputError):
                return share, jobs(share)
        return least, jobs(least)

    def _length(self, run: int) -> float:
        return 1.0 if self.system.lands(run) else self.system.difference

    @property
    def short(self) -> bool:
        """Return whether all differences are short, so that derivatives are those of the cost."""
        return all(self._length(k) < 1 for k in range(len(self.system.names)))

    @property
    def edges(self) -> tuple[int, ...]:
        """Return between which residuals each run's lie, and the priors at the end."""
        runs = range(len(self.system.names))
        sizes = [self.samples(k) * self.system.seen(k).shape[1] for k in runs]
        return tuple(accumulate([*sizes, int(self.vector.weighted.sum())], initial=0))

    @property
    def robust(self) -> Array:
        """Return beyond which size each residual pulls less, (m,); infinite for the priors."""
        data, every = self.edges[-2:]
        return np.repeat([ROBUST, np.inf], [data, every - data])


def reaches(jacobian: Array) -> Array:
    """Return how far to move each parameter for the next difference, (p,) [prior deviations].

    No farther than where the residuals change by as much as they are: beyond, a strong parameter
    makes another motion.

    Args:
        jacobian: (m, p) of the residuals [1].
    """
    norms = np.linalg.norm(jacobian, axis=0)
    return np.sqrt(len(jacobian)) / np.maximum(norms, np.sqrt(len(jacobian)) / _FARTHEST)


def _gains(system: System, modes: Sequence[Modes], noise: Mapping[str, float]) -> tuple[Gain, ...]:
    return tuple(
        stationary(
            one, system.process(k, noise), system.sigma(k), system.sample_s, system.memory(k)
        )
        for k, one in enumerate(modes)
    )


def counted(one: Innovations) -> Array:
    """Return whitened innovations as they count, (n, c) [sigma]: a run that blew up is refused."""
    white = one.white.copy()
    white[one.sane :] = REFUSED
    return np.nan_to_num(white, nan=REFUSED)
