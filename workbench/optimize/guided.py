"""A search that learns from few evaluations what makes candidates good: Bayesian optimisation.

A Gaussian process over descriptors, cheap numbers that say more about a candidate than its
variables do, tells what candidates that nobody has evaluated are worth and how sure that is. Each
generation is chosen where mean plus some standard deviations are greatest (upper confidence bounds:
Srinivas et al., ICML 2010), one candidate after the other, each as if those before it had come out
as predicted (Desautels et al., JMLR 15, 2014).

Where the best of a region no longer gets better, the region is settled: half of each generation
then has to be described otherwise, the other half goes on around the best of all. So one search
finds several kinds of good candidates and is not caught by the first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.optimize.algorithm import Algorithm, State
from workbench.optimize.space import Space
from workbench.optimize.surrogate import Surrogate, learn_scales

__all__ = ["Describe", "Guided", "GuidedOptions", "Possible"]

Points = NDArray[np.float64]
Describe = Callable[[Points], Points]
"""Candidates (n, d) to what describes them, (n, f); NaN where one can surely not be evaluated."""
Possible = Callable[[Points], bool]
"""Whether a candidate (d,) can be evaluated at all: asked of each before it is chosen."""

_POOL = 2000  # points of the space that the first candidates are chosen from, and variations
_TRIES = 400  # for one candidate that is possible
_LEAST_STEP, _GREATEST_STEP = 0.01, 0.25  # of a variation, of the bounds' widths
_MIXED = 0.3  # of the variations that mix two parents

_AROUND_BEST, _OPEN_BEST, _OPEN_ONE, _ISLANDS = 6, 9, 12, 16  # islands end with these numbers
_ROUNDS, _CHILDREN, _KEPT, _PARENTS = 7, 30, 8, 15  # of an island
_BOLDNESS = (0.0, 0.5, 1.0, 2.0)  # standard deviations above the mean, islands and picks in turn
_LEARNT_AT = (1, 2, 4, 8, 16, 24, 32)  # generation of learning; after that each 16th
_CLOSED = 1e6  # taken from the promise of what lies in a settled region
_NEVER = 1e-3  # of the mean variance, as noise of a pick that is taken as it is predicted


@dataclass(frozen=True)
class GuidedOptions:
    """Options of the search.

    Args:
        population_size: candidates a generation, even: half of them stay around the best.
        first: generations that are drawn before anything is learnt.
        patience: generations without a gain until a region is settled.
        gain: what counts as one, as a part of what the best is above the first ones' median.
        apart: how far from a settled region's best the next region begins, in standard deviations
            of the first candidates' descriptors.
    """

    population_size: int = 12
    first: int = 3
    patience: int = 2
    gain: float = 0.02
    apart: float = 2.5

    def __post_init__(self) -> None:
        """Refuse options that leave no search."""
        if self.population_size < 2 or self.population_size % 2:
            raise InputError(
                f"population size {self.population_size} is not even and at least 2: half of a "
                "generation stays around the best"
            )
        if self.first < 1 or self.patience < 1 or self.gain < 0 or self.apart < 0:
            raise InputError(
                f"first {self.first} and patience {self.patience} are at least 1, gain "
                f"{self.gain:g} and apart {self.apart:g} at least 0"
            )


class Guided(Algorithm):
    """Bayesian optimisation over descriptors, region after region.

    Args:
        space: what is searched; its start is the first candidate.
        seed: of the random generator.
        describe: what the process learns over; the variables themselves where not given.
        possible: what is left out before it is asked for; where not given, nothing.
        options: those of the default search where not given.
    """

    name = "guided"

    def __init__(
        self,
        space: Space,
        seed: int,
        describe: Describe | None = None,
        possible: Possible | None = None,
        options: GuidedOptions | None = None,
    ) -> None:
        super().__init__(space, seed)
        self._describe = describe or self._scaled
        self._possible = possible or (lambda _: True)
        self._chosen = options or GuidedOptions()
        self._forget()

    @property
    def options(self) -> State:
        """The options and the seed."""
        return {"seed": self.seed} | asdict(self._chosen)

    def ask(self) -> Points:
        """Return candidates far apart at first, then such as promise most."""
        if self._generations < self._chosen.first:
            return self._spread_out()
        if self._is_time_to_learn():
            self._scales = learn_scales(self._described, self._worth(), self._scales)
        surrogate = Surrogate(self._described, self._worth(), self._scales)
        return self._picked(surrogate, np.vstack([*self._islands(surrogate)]))

    def tell(self, candidates: Points, fitness: NDArray[np.float64]) -> None:
        """Learn from a generation; settle the region where it got no better."""
        self._take(candidates, fitness)
        if self._generations <= self._chosen.first:
            return
        worth = self._worth()
        inside = np.where(self._is_open(self._described), worth, -np.inf)
        counts = self._chosen.gain * (worth.max() - float(np.median(worth[: self._first_count])))
        if inside.max() > self._record + counts:
            self._record, self._stalled = float(inside.max()), 0
            return
        self._stalled += 1
        if self._stalled >= self._chosen.patience and np.isfinite(inside.max()):
            self._settled.append(int(np.argmax(inside)))
            self._record, self._stalled = -np.inf, 0

    def state(self) -> State:
        """Return the generator, what was told, what was learnt and which regions are settled."""
        return {
            "generator": self._generator_state(),
            "told": [[c.tolist(), f.tolist()] for c, f in self._told],
            "scales": list(self._scales),
            "settled": list(self._settled),
            "record": None if np.isinf(self._record) else self._record,
            "stalled": self._stalled,
        }

    def restore(self, state: State) -> None:
        """Take up what `state` gave."""
        self._forget()
        for candidates, fitness in state["told"]:
            self._take(np.array(candidates, dtype=np.float64), np.array(fitness, dtype=np.float64))
        self._scales = [float(scale) for scale in state["scales"]]
        self._settled = [int(row) for row in state["settled"]]
        self._record = -np.inf if state["record"] is None else float(state["record"])
        self._stalled = int(state["stalled"])
        self._restore_generator(state["generator"])

    def _forget(self) -> None:
        self._told: list[tuple[Points, NDArray[np.float64]]] = []
        self._candidates = np.empty((0, len(self.space)))
        self._fitness = np.empty(0)
        self._described = np.empty((0, 0))
        self._scales: list[float] = []
        self._settled: list[int] = []
        self._record, self._stalled = -np.inf, 0

    def _take(self, candidates: Points, fitness: NDArray[np.float64]) -> None:
        self._told.append((candidates.copy(), fitness.copy()))
        self._candidates = np.vstack([self._candidates, candidates])
        self._fitness = np.append(self._fitness, fitness)
        self._centre, self._spread = _measure(self._describe(self._candidates[: self._first_count]))
        self._described = np.nan_to_num(self._standard(self._candidates))

    @property
    def _generations(self) -> int:
        return len(self._told)

    @property
    def _first_count(self) -> int:
        return self._chosen.first * self._chosen.population_size

    def _is_time_to_learn(self) -> bool:
        since = self._generations - self._chosen.first + 1
        return since in _LEARNT_AT or (since > _LEARNT_AT[-1] and since % 16 == 0)

    def _standard(self, candidates: Points) -> Points:
        """Return descriptors in units of the first candidates' spread, (n, f)."""
        return (self._describe(candidates) - self._centre) / self._spread

    def _worth(self) -> NDArray[np.float64]:
        """Return what was told, more is better, (n,); a failure is as bad as the best is good.

        Seen from the median of the first candidates: of penalties far below all else the process
        would learn nothing but them.
        """
        middle = float(np.median(self._fitness[: self._first_count]))
        return -np.minimum(self._fitness, 2 * middle - self._fitness.min())

    def _spread_out(self) -> Points:
        """Return candidates as far as can be from each other and from those before, (n, d).

        They are chosen from points of the whole space and variations of its start.
        """
        start = self.space.start[None]
        pool = np.vstack([self._varied(start, _POOL), self.space.sample(self.generator, _POOL)])
        described = self._describe(pool)
        usable = np.isfinite(described).all(axis=1)
        pool, described = pool[usable], described[usable]
        centre, spread = _measure(described)
        known = self._candidates if self._told else start
        picks = [] if self._told else [self.space.start]
        scaled = (described - centre) / spread
        apart = _distances(scaled, (self._describe(known) - centre) / spread).min(axis=1)
        while len(picks) < self._chosen.population_size and apart.max(initial=0.0) > 0:
            row = int(np.argmax(apart))
            apart[row] = 0.0
            if self._possible(pool[row]):
                picks.append(pool[row])
                apart = np.minimum(apart, _distances(scaled, scaled[row, None])[:, 0])
        return self._filled(picks)

    def _filled(self, picks: list[Points]) -> Points:
        """Return a whole generation, points from anywhere where picks are missing."""
        for _ in range(self._chosen.population_size - len(picks)):
            drawn = self.space.sample(self.generator, 1)[0]
            for _ in range(_TRIES):
                if self._possible(drawn):
                    break
                drawn = self.space.sample(self.generator, 1)[0]
            picks.append(drawn)
        return np.array(picks)

    def _varied(self, parents: Points, count: int) -> Points:
        """Return variations: some mix two parents, each is stepped off by a length of its own."""
        first, second = self._scaled(parents)[
            self.generator.integers(len(parents), size=(2, count))
        ]
        mixed = self.generator.random((count, 1)) < _MIXED
        base = np.where(mixed & (self.generator.random(first.shape) < 0.5), second, first)
        low, high = np.log([_LEAST_STEP, _GREATEST_STEP])
        steps = np.exp(self.generator.uniform(low, high, (count, 1)))
        moved = base + steps * self.generator.normal(size=first.shape)
        return self.space.project(self.space.lower + self.space.widths * moved)

    def _islands(self, surrogate: Surrogate) -> list[Points]:
        """Return what promises most on each island, evolved from parents of its own."""
        kept = [self._parents(island) for island in range(_ISLANDS)]
        for _ in range(_ROUNDS):
            families = [np.vstack([own, self._varied(own, _CHILDREN)]) for own in kept]
            promises = self._promises(surrogate, families)
            kept = [
                family[np.argsort(-promise, kind="stable")[:_KEPT]]
                for family, promise in zip(families, promises, strict=True)
            ]
        return kept

    def _parents(self, island: int) -> Points:
        ranked = np.argsort(-self._worth(), kind="stable")
        if island < _AROUND_BEST:
            return self._candidates[ranked[:_PARENTS]]
        free = ranked[self._is_open(self._described[ranked])]
        if island < _OPEN_BEST and len(free):
            return self._candidates[free[:_PARENTS]]
        if island < _OPEN_ONE and len(free):
            return self._candidates[free[self.generator.integers((len(free) + 1) // 2, size=1)]]
        drawn = self.space.sample(self.generator, 64)
        usable = np.isfinite(self._describe(drawn)).all(axis=1)
        return drawn[[int(np.argmax(usable))]]

    def _promises(self, surrogate: Surrogate, families: list[Points]) -> list[NDArray[np.float64]]:
        """Return the upper bound of each member of each island's family."""
        described = self._standard(np.vstack(families))
        usable = np.isfinite(described).all(axis=1)
        described[~usable] = 0.0
        mean, deviation = surrogate.predict(described)
        ends = np.cumsum([len(family) for family in families])
        island = np.searchsorted(ends, np.arange(len(described)), side="right")
        promise = mean + np.array(_BOLDNESS)[island % len(_BOLDNESS)] * deviation
        promise[(island >= _AROUND_BEST) & ~self._is_open(described)] -= _CLOSED
        promise[~usable] = -np.inf
        return np.split(promise, ends[:-1])

    def _picked(self, surrogate: Surrogate, pool: Points) -> Points:
        """Return a generation: each pick the most promising one, given the picks before it."""
        described = self._standard(pool)
        usable = np.isfinite(described).all(axis=1)
        pool, described = pool[usable], described[usable]
        mean, covariance = surrogate.together(described)
        closed = _CLOSED * ~self._is_open(described)
        noise = _NEVER * float(np.trace(covariance)) / len(pool)
        left = np.ones(len(pool), dtype=bool)
        picks: list[Points] = []
        for k in range(self._chosen.population_size):
            deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
            promise = mean + _BOLDNESS[k % len(_BOLDNESS)] * deviation
            if k >= self._chosen.population_size // 2:
                promise = promise - closed
            row = self._best_possible(pool, promise, left)
            if row is None:
                break
            picks.append(pool[row])
            known = covariance[row, row] + noise
            covariance = covariance - np.outer(covariance[:, row], covariance[row]) / known
        return self._filled(picks)

    def _best_possible(
        self, pool: Points, promise: NDArray[np.float64], left: NDArray[np.bool_]
    ) -> int | None:
        """Return the row that promises most of those left and possible; those tried are not."""
        for row in np.argsort(-promise, kind="stable"):
            if left[row]:
                left[row] = False
                if self._possible(pool[row]):
                    return int(row)
        return None

    def _is_open(self, described: Points) -> NDArray[np.bool_]:
        """Tell which of (n, f) lie in no settled region, (n,)."""
        if not self._settled:
            return np.ones(len(described), dtype=bool)
        centres = self._described[self._settled]
        return np.all(_distances(described, centres) > self._chosen.apart, axis=1)

    def _scaled(self, points: Points) -> Points:
        return (points - self.space.lower) / self.space.widths


def _measure(described: Points) -> tuple[Points, Points]:
    """Return mean and standard deviation of each descriptor, (f,); 1 where all are the same."""
    whole = described[np.isfinite(described).all(axis=1)]
    spread = whole.std(axis=0)
    return whole.mean(axis=0), np.where(spread > 0, spread, 1.0)


def _distances(points: Points, others: Points) -> Points:
    return np.sqrt(np.sum((points[:, None] - others[None]) ** 2, axis=2))
