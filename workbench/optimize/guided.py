"""A search that learns from few evaluations what makes candidates good: Bayesian optimisation.

A Gaussian process over descriptors, cheap numbers that say more about a candidate than its
variables do, predicts the fitness of candidates that nobody has evaluated, with its sigma. Each
generation is chosen where mean plus some standard deviations are greatest (upper confidence bounds:
Srinivas et al., ICML 2010), one candidate after the other, each as if those before it had come out
as predicted (Desautels et al., JMLR 15, 2014).

Good candidates may be of several kinds. A third of each generation goes on around the best; for
each of the others a niche is drawn first, by its best so far and how seldom it was tried (UCB1:
Auer, Cesa-Bianchi and Fischer, Machine Learning 47, 2002). So no search is caught by the first good
kind that it meets.
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
_PARENTS, _NEWCOMERS = 12, 6  # of an island: the best of its niche, and points that nobody tried
_ROUNDS, _CHILDREN, _KEPT = 7, 30, 8  # of an island
_BOLDNESS = (0.0, 0.5, 1.0, 2.0)  # standard deviations above the mean, islands and picks in turn
_BETWEEN = (0.5, 1.0)  # where less than three candidates of a niche are asked for
_LEARNT_AT = (1, 2, 4, 8, 16, 24, 32)  # generation of learning; after that each 16th
_CLOSED = 1e6  # taken from the promise of what lies in another niche
_NEVER = 1e-3  # of the mean variance, as noise of a pick that is taken as it is predicted


@dataclass(frozen=True)
class GuidedOptions:
    """Options of the search.

    Args:
        population_size: candidates a generation; a third of them stay around the best.
        first: generations that are drawn before anything is learnt.
        niches: kinds of candidates that are distinguished.
        curiosity: how much a niche that was seldom tried is liked, in units of what the best is
            above the first candidates' median.
    """

    population_size: int = 12
    first: int = 3
    niches: int = 8
    curiosity: float = 2.0

    def __post_init__(self) -> None:
        """Refuse options that leave no search."""
        if min(self.population_size, self.first, self.niches) < 1 or self.curiosity < 0:
            raise InputError(
                f"population size {self.population_size}, first {self.first} and niches "
                f"{self.niches} are at least 1, curiosity {self.curiosity:g} at least 0"
            )


class Guided(Algorithm):
    """Bayesian optimisation over descriptors, in all niches at once.

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
        surrogate = Surrogate(self._described, self._scores(), self._scales)
        niches = self._drawn_niches()
        return self._picked(surrogate, self._islands(surrogate, niches), niches)

    def tell(self, candidates: Points, fitness: NDArray[np.float64]) -> None:
        """Learn from a generation."""
        self._told.append((candidates.copy(), fitness.copy()))
        self._candidates = np.vstack([self._candidates, candidates])
        self._fitness = np.append(self._fitness, fitness)
        self._described = np.nan_to_num(self._niches.standard(self._candidates))

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
        self._scales: list[float] = []

    @property
    def _niches(self) -> Niches:
        """Made at first use, by a generator of its own: a search that goes on has the same."""
        if self._made is None:
            rng = np.random.default_rng([self.seed, 1])
            self._made = Niches(
                self.space, self._describe, self._possible, self._likely, self._chosen.niches, rng
            )
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
        """Return what was told, more is better, (n,); a failure is as bad as the best is good.

        Seen from the median of the first candidates: of penalties far below all else the process
        would learn nothing but them.
        """
        middle = float(np.median(self._fitness[: self._first_count]))
        return -np.minimum(self._fitness, 2 * middle - self._fitness.min())

    def _space_filling(self) -> Points:
        """Return candidates of one niche after the other, far from those before, (n, d)."""
        niches, before = self._niches, len(self._fitness)
        known = self._described if self._told else niches.described[:1]
        points: list[Points] = [] if self._told else [niches.points[0]]
        for turn in range(before + len(points), before + self._chosen.population_size):
            rows = niches.members(turn % len(niches))
            apart = _distances(niches.described[rows], known).min(axis=1)
            row = rows[np.argsort(-apart, kind="stable")[len(rows) // _NEAR_FARTHEST]]
            points.append(niches.points[row])
            known = np.vstack([known, niches.described[row]])
        return np.array(points)

    def _drawn_niches(self) -> list[int]:
        """Return the niches of the candidates that do not stay around the best."""
        scores, count = self._scores(), len(self._niches)
        niche_of = self._niches.of(self._described)
        best = np.array([scores[niche_of == k].max(initial=scores.min()) for k in range(count)])
        tried = np.bincount(niche_of, minlength=count)
        scale = scores.max() - float(np.median(scores[: self._first_count])) or 1.0
        drawn: list[int] = []
        for _ in range(self._chosen.population_size - self._around_best):
            seldom = np.sqrt(np.log(tried.sum()) / (tried + 1))
            drawn.append(int(np.argmax(best / scale + self._chosen.curiosity * seldom)))
            tried[drawn[-1]] += 1
        return drawn

    @property
    def _around_best(self) -> int:
        """How many of a generation stay around the best of all."""
        return self._chosen.population_size // 3

    def _islands(self, surrogate: Surrogate, drawn: list[int]) -> Points:
        """Return what promises most around the best and in each niche drawn, (n, d)."""
        islands: list[tuple[int | None, float]] = [(None, bold) for bold in _BOLDNESS]
        for niche in sorted(set(drawn)):
            several = drawn.count(niche) > 2
            islands += [(niche, bold) for bold in (_BOLDNESS if several else _BETWEEN)]
        kept = [self._parents(niche) for niche, _ in islands]
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

    def _parents(self, niche: int | None) -> Points:
        ranked = np.argsort(-self._scores(), kind="stable")
        if niche is None:
            return self._candidates[ranked[:_PARENTS]]
        inside = ranked[self._niches.of(self._described[ranked]) == niche]
        members = self._niches.members(niche)
        new = members[self.generator.integers(len(members), size=_NEWCOMERS)]
        return np.vstack([self._candidates[inside[:_PARENTS]], self._niches.points[new]])

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
        home = np.array([-1 if niche is None else niche for niche, _ in islands])[island]
        promise[(home >= 0) & (self._niches.of(described) != home)] -= _CLOSED
        promise[~usable] = -np.inf
        return np.split(promise, ends[:-1])

    def _picked(self, surrogate: Surrogate, pool: Points, drawn: list[int]) -> Points:
        """Return a generation: each pick the most promising one, given the picks before it."""
        described = self._niches.standard(pool)
        usable = np.isfinite(described).all(axis=1)
        pool, described = pool[usable], described[usable]
        mean, covariance = surrogate.together(described)
        niche_of = self._niches.of(described)
        noise = _NEVER * float(np.trace(covariance)) / len(pool)
        untried = np.ones(len(pool), dtype=bool)
        picks: list[Points] = []
        for k, niche in enumerate([None] * self._around_best + drawn):
            deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
            promise = mean + _BOLDNESS[k % len(_BOLDNESS)] * deviation
            if niche is not None:
                promise = promise - _CLOSED * (niche_of != niche)
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
