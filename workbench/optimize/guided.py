"""A search that learns from few evaluations what makes candidates good: Bayesian optimisation.

A Gaussian process over descriptors, cheap numbers that say more about a candidate than its
variables do, predicts the fitness of candidates that nobody has evaluated, with its sigma. Each
generation is chosen where mean plus some standard deviations are greatest (upper confidence bounds:
Srinivas et al., ICML 2010), one candidate after the other, each as if those before it had come out
as predicted (Desautels et al., JMLR 15, 2014).

Good candidates may be of several kinds. So most of a generation goes on around candidates that are
drawn by their score and by how few others are near (UCB1: Auer, Cesa-Bianchi and Fischer, Machine
Learning 47, 2002): a summit that was searched well gives way to slopes that were not climbed yet.
The others may be from anywhere.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.optimize.algorithm import Algorithm, State
from workbench.optimize.niches import Describe, Likely, Niches, Possible, varied
from workbench.optimize.space import Space
from workbench.optimize.surrogate import Surrogate, learn_scales

__all__ = ["Guided", "GuidedOptions"]

Points = NDArray[np.float64]

_TRIES = 400  # for one candidate that is possible
_NEAR_FARTHEST = 4  # the first candidates are farther from those known than all but a part of 1 / 4
_PARENTS = 12  # of an island: the best near its centre, or points from anywhere
_NEAR = 1.0  # of the descriptors' spread: how far an island reaches from its centre
_ANYWHERE = (1.0, 2.0)  # boldness of the islands, and picks, that may be from anywhere
_ROUNDS, _CHILDREN, _KEPT = 7, 30, 8  # of an island
_BOLDNESS = (0.0, 0.5, 1.0, 2.0)  # standard deviations above the mean, islands and picks in turn
_BETWEEN = (0.5, 1.0)  # where less than three candidates near a centre are asked for
_LEARNT_AT = (1, 2, 4, 8, 16, 24, 32)  # generation of learning; after that each 16th
_PREDICTED_FROM = 480  # candidates, those nearest the centres: as many as a default search has
_CLOSED = 1e6  # taken from the promise of what is far from its centre
_NEVER = 1e-3  # of the mean variance, as noise of a pick that is taken as it is predicted


@dataclass(frozen=True)
class GuidedOptions:
    """Options of the search.

    Args:
        population_size: candidates a generation.
        first: generations that are drawn before anything is learnt.
        niches: kinds of candidates that the first are drawn from.
        curiosity: how much a candidate with few others near it is liked, in units of what the best
            is above the first candidates' median.
    """

    population_size: int = 12
    first: int = 3
    niches: int = 8
    curiosity: float = 0.5

    def __post_init__(self) -> None:
        """Refuse options that leave no search."""
        if min(self.population_size, self.first, self.niches) < 1 or self.curiosity < 0:
            raise InputError(
                f"population size {self.population_size}, first {self.first} and niches "
                f"{self.niches} are at least 1, curiosity {self.curiosity:g} at least 0"
            )


class Guided(Algorithm):
    """Bayesian optimisation over descriptors, around several good candidates at once.

    Args:
        space: what is searched; its start is the first candidate.
        seed: of the random generator.
        describe: what the process learns over; the variables themselves where not given.
        possible: what is left out before it is asked for; where not given, nothing.
        likely: of which kind the candidates are that it begins with and tries anew; where not
            given, of any.
        options: those of the default search where not given.
    """

    name = "guided"

    def __init__(
        self,
        space: Space,
        seed: int,
        describe: Describe | None = None,
        possible: Possible | None = None,
        likely: Likely | None = None,
        options: GuidedOptions | None = None,
    ) -> None:
        super().__init__(space, seed)
        self._describe = describe or (lambda points: (points - space.lower) / space.widths)
        self._possible = possible or (lambda _: True)
        self._likely = likely or (lambda described: np.ones(len(described), dtype=bool))
        self._chosen = options or GuidedOptions()
        self._made: Niches | None = None
        self._forget()

    @property
    def options(self) -> State:
        """The options and the seed."""
        return {"seed": self.seed} | asdict(self._chosen)

    def ask(self) -> Points:
        """Return candidates of every niche at first, then such as promise most.

        Returns:
            (n, d) [unit of each variable].
        """
        if self._generations < self._chosen.first:
            return self._space_filling()
        if self._is_time_to_learn():
            self._scales = learn_scales(self._described, self._scores(), self._scales)
        centres = self._drawn_centres()
        rows = self._nearest(centres)
        surrogate = Surrogate(self._described[rows], self._scores()[rows], self._scales)
        return self._picked(surrogate, self._islands(surrogate, centres), centres)

    def tell(self, candidates: Points, fitness: NDArray[np.float64]) -> None:
        """Learn from a generation."""
        self._told.append((candidates.copy(), fitness.copy()))
        self._candidates = np.vstack([self._candidates, candidates])
        self._fitness = np.append(self._fitness, fitness)
        new = np.nan_to_num(self._niches.standard(candidates))
        self._described = np.vstack([self._described.reshape(-1, new.shape[1]), new])
        near = _distances(new, self._described) < _NEAR
        tried = np.append(self._tried, np.zeros(len(new), dtype=np.intp)) + near.sum(axis=0)
        tried[-len(new) :] = near.sum(axis=1)
        self._tried = tried

    def state(self) -> State:
        """Return the generator, what was told and what was learnt."""
        return {
            "generator": self._generator_state(),
            "told": [[c.tolist(), f.tolist()] for c, f in self._told],
            "scales": list(self._scales),
        }

    def restore(self, state: State) -> None:
        """Take up what `state` gave."""
        self._forget()
        for candidates, fitness in state["told"]:
            self.tell(np.array(candidates, dtype=np.float64), np.array(fitness, dtype=np.float64))
        self._scales = [float(scale) for scale in state["scales"]]
        self._restore_generator(state["generator"])

    def _forget(self) -> None:
        self._told: list[tuple[Points, NDArray[np.float64]]] = []
        self._candidates = np.empty((0, len(self.space)))
        self._fitness = np.empty(0)
        self._described = np.empty((0, 0))
        self._tried = np.empty(0, dtype=np.intp)  # how many are near each, itself among them
        self._scales: list[float] = []

    @property
    def _niches(self) -> Niches:
        """Made at first use, by a generator of its own: a search that goes on has the same."""
        if self._made is None:
            rng = np.random.default_rng([self.seed, 1])
            self._made = Niches(self.space, self._describe, self._likely, self._chosen.niches, rng)
        return self._made

    @property
    def _generations(self) -> int:
        return len(self._told)

    @property
    def _first_count(self) -> int:
        return self._chosen.first * self._chosen.population_size

    def _is_time_to_learn(self) -> bool:
        since = self._generations - self._chosen.first + 1
        return since in _LEARNT_AT or (since > _LEARNT_AT[-1] and since % 16 == 0)

    def _scores(self) -> NDArray[np.float64]:
        """Return what was told, more is better, (n,), at least the first candidates' median.

        It is asked where good candidates are, not how bad the others are: of failures and of hops
        backward the process would learn little else.
        """
        return -np.minimum(self._fitness, float(np.median(self._fitness[: self._first_count])))

    def _space_filling(self) -> Points:
        """Return candidates of one niche after the other, far from those before, (n, d)."""
        niches, before = self._niches, len(self._fitness)
        known = self._described if self._told else niches.described[:1]
        points: list[Points] = [] if self._told else [niches.points[0]]
        for turn in range(before + len(points), before + self._chosen.population_size):
            rows = niches.members(turn % len(niches))
            apart = _distances(niches.described[rows], known).min(axis=1)
            order = rows[np.argsort(-apart, kind="stable")[len(rows) // _NEAR_FARTHEST :]]
            row = next((k for k in order if self._possible(niches.points[k])), 0)
            points.append(niches.points[row])
            known = np.vstack([known, niches.described[row]])
        return np.array(points)

    def _drawn_centres(self) -> list[int]:
        """Return the rows of the candidates around which a generation goes on."""
        scores, tried = self._scores(), self._tried.copy()
        scaled = scores / (np.ptp(scores) or 1.0)
        drawn: list[int] = []
        for _ in range(self._chosen.population_size - len(_ANYWHERE)):
            seldom = np.sqrt(np.log(len(scores)) / tried)
            drawn.append(int(np.argmax(scaled + self._chosen.curiosity * seldom)))
            tried[~self._is_far(self._described, drawn[-1])] += 1
        return drawn

    def _nearest(self, centres: list[int]) -> NDArray[np.intp]:
        """Return the rows of the candidates that are predicted from: all, in a short search."""
        rows = np.arange(len(self._described))
        if len(rows) <= _PREDICTED_FROM:
            return rows
        apart = _distances(self._described, self._described[sorted(set(centres))]).min(axis=1)
        return np.sort(np.argsort(apart, kind="stable")[:_PREDICTED_FROM])

    def _islands(self, surrogate: Surrogate, drawn: list[int]) -> Points:
        """Return what promises most anywhere and around each centre drawn, (n, d)."""
        islands: list[tuple[int | None, float]] = [(None, bold) for bold in _ANYWHERE]
        for centre in sorted(set(drawn)):
            several = drawn.count(centre) > 2
            islands += [(centre, bold) for bold in (_BOLDNESS if several else _BETWEEN)]
        kept = [self._parents(centre) for centre, _ in islands]
        for _ in range(_ROUNDS):
            families = [np.vstack([parents, self._varied(parents)]) for parents in kept]
            promises = self._promises(surrogate, families, islands)
            kept = [
                family[np.argsort(-promise, kind="stable")[:_KEPT]]
                for family, promise in zip(families, promises, strict=True)
            ]
        return np.vstack(kept)

    def _varied(self, parents: Points) -> Points:
        return varied(self.space, self.generator, parents, _CHILDREN)

    def _parents(self, centre: int | None) -> Points:
        if centre is None:
            count = len(self._niches.points)
            return self._niches.points[self.generator.integers(count, size=_PARENTS)]
        ranked = np.argsort(-self._scores(), kind="stable")
        near = ranked[~self._is_far(self._described[ranked], centre)]
        return self._candidates[near[:_PARENTS]]

    def _promises(
        self, surrogate: Surrogate, families: list[Points], islands: list[tuple[int | None, float]]
    ) -> list[NDArray[np.float64]]:
        """Return the upper bound of each member of each island's family."""
        described = self._niches.standard(np.vstack(families))
        usable = np.isfinite(described).all(axis=1)
        described[~usable] = 0.0
        mean, deviation = surrogate.predict(described)
        ends = np.cumsum([len(family) for family in families])
        island = np.searchsorted(ends, np.arange(len(described)), side="right")
        promise = mean + np.array([bold for _, bold in islands])[island] * deviation
        for k, (centre, _) in enumerate(islands):
            own = np.flatnonzero(island == k)
            promise[own] -= _CLOSED * self._is_far(described[own], centre)
        promise[~usable] = -np.inf
        return np.split(promise, ends[:-1])

    def _is_far(self, described: Points, centre: int | None) -> NDArray[np.bool_]:
        if centre is None:
            return np.zeros(len(described), dtype=bool)
        return _distances(described, self._described[centre, None])[:, 0] >= _NEAR

    def _picked(self, surrogate: Surrogate, pool: Points, drawn: list[int]) -> Points:
        """Return a generation: each pick the most promising one, given the picks before it."""
        described = self._niches.standard(pool)
        usable = np.isfinite(described).all(axis=1)
        pool, described = pool[usable], described[usable]
        mean, covariance = surrogate.together(described)
        noise = _NEVER * float(np.trace(covariance)) / len(pool)
        untried = np.ones(len(pool), dtype=bool)
        picks: list[Points] = []
        wanted: list[tuple[int | None, float]] = [
            (centre, _BOLDNESS[k % len(_BOLDNESS)]) for k, centre in enumerate(drawn)
        ]
        wanted += [(None, bold) for bold in _ANYWHERE]
        for centre, bold in wanted[: self._chosen.population_size]:
            deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
            promise = mean + bold * deviation - _CLOSED * self._is_far(described, centre)
            row = self._best_possible(pool, promise, untried)
            if row is None:
                break
            picks.append(pool[row])
            known = covariance[row, row] + noise
            covariance = covariance - np.outer(covariance[:, row], covariance[row]) / known
        return self._filled(picks)

    def _best_possible(
        self, pool: Points, promise: NDArray[np.float64], untried: NDArray[np.bool_]
    ) -> int | None:
        """Return the row that promises most of those left and possible; those tried are not."""
        for row in np.argsort(-promise, kind="stable"):
            if untried[row]:
                untried[row] = False
                if self._possible(pool[row]):
                    return int(row)
        return None

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


def _distances(points: Points, others: Points) -> Points:
    return np.sqrt(np.sum((points[:, None] - others[None]) ** 2, axis=2))
