"""The kinds of candidates that there are, known before any is evaluated.

Points drawn from the space are mostly alike in what describes them. So isolated ones are
kept and varied, round after round, until rare kinds are there as well as common ones (novelty
search: Lehman and Stanley, Evolutionary Computation 19, 2011); k-means then cuts them into niches.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.optimize.space import Space

__all__ = ["Describe", "Likely", "Niches", "Possible", "varied"]

Points = NDArray[np.float64]
Describe = Callable[[Points], Points]
"""Candidates (n, d) to what describes them, (n, f); NaN where one can surely not be evaluated."""
Possible = Callable[[Points], bool]
"""Whether a candidate (d,) can be evaluated at all: asked of each before it is chosen."""
Likely = Callable[[Points], NDArray[np.bool_]]
"""Which of (n, f) descriptors are of the kind that good candidates surely are, (n,)."""

_DRAWN = 2500  # from the space, and as many variations of its start
_ROUNDS, _CHILDREN, _KEPT = 12, 1500, 600
_NEIGHBOURS = 5  # whose distance shows how isolated a point is
_LIKING = 3  # power of that distance, as the chance to be kept
_RESTARTS = 5  # of k-means
_LEAST_STEP, _GREATEST_STEP = 0.01, 0.25  # of a variation, of the bounds' widths
_MIXED = 0.3  # of the variations that mix two parents


class Niches:
    """Points all over what candidates can be, in units of their own spread.

    Args:
        space: what is searched.
        describe: what distinguishes candidates.
        likely: what is kept, where there is any.
        count: niches at most.
        generator: of all that is random.

    Attributes:
        points: (n, d); the start is the first.
        described: (n, f), standard.
    """

    def __init__(
        self,
        space: Space,
        describe: Describe,
        likely: Likely,
        count: int,
        generator: np.random.Generator,
    ) -> None:
        self._describe = describe
        self.points = np.vstack([space.start, _all_over(space, describe, likely, generator)])
        described = describe(self.points)
        known = np.nan_to_num(described)  # the start alone may be without what describes it
        deviation = known.std(axis=0)
        self._centre, self._scale = known.mean(axis=0), np.where(deviation > 0, deviation, 1.0)
        self.described = np.nan_to_num((described - self._centre) / self._scale)
        self._centres, _ = scipy.cluster.vq.kmeans(
            self.described, min(count, len(self.points)), iter=_RESTARTS, rng=generator
        )
        self._index = self.of(self.described)

    def __len__(self) -> int:
        """Return how many niches there are."""
        return len(self._centres)

    def standard(self, candidates: Points) -> Points:
        """Return what describes candidates, (n, f) [spreads of the points].

        Args:
            candidates: (n, d) [unit of each variable].
        """
        return (self._describe(candidates) - self._centre) / self._scale

    def of(self, described: Points) -> NDArray[np.intp]:
        """Return the niche of each, (n,).

        Args:
            described: (n, f) of `standard` [spreads of the points].
        """
        return scipy.cluster.vq.vq(described, self._centres)[0].astype(np.intp)

    def members(self, niche: int) -> NDArray[np.intp]:
        """Return the rows of `points` that lie in a niche, (k,)."""
        return np.flatnonzero(self._index == niche)


def varied(space: Space, generator: np.random.Generator, parents: Points, count: int) -> Points:
    """Return variations, (count, d) [unit of each variable].

    Some mix two parents, each is stepped off by a length of its own.

    Args:
        space: that they are of.
        generator: of all that is random.
        parents: (n, d) [unit of each variable].
        count: how many are wanted.
    """
    scaled = (parents - space.lower) / space.widths
    first, second = scaled[generator.integers(len(parents), size=(2, count))]
    mixed = generator.random((count, 1)) < _MIXED
    base = np.where(mixed & (generator.random(first.shape) < 0.5), second, first)
    low, high = np.log([_LEAST_STEP, _GREATEST_STEP])
    steps = np.exp(generator.uniform(low, high, (count, 1)))
    moved = base + steps * generator.normal(size=first.shape)
    return space.project(space.lower + space.widths * moved)


def _all_over(
    space: Space, describe: Describe, likely: Likely, generator: np.random.Generator
) -> Points:
    """Return points that can be described and are not alike, (n, d)."""
    drawn = varied(space, generator, space.start[None], _DRAWN)
    found = np.vstack([drawn, space.sample(generator, _DRAWN)])
    for turn in range(_ROUNDS):
        if turn:
            found = np.vstack([found, varied(space, generator, found, _CHILDREN)])
        described = describe(found)
        usable = np.isfinite(described).all(axis=1)
        found, described = found[usable], described[usable]
        if not len(found):
            break
        liked = likely(described)
        if np.count_nonzero(liked) > _NEIGHBOURS:
            found, described = found[liked], described[liked]
        if len(found) > _KEPT:
            found = found[_lonely(described, generator)]
    return found


def _lonely(described: Points, generator: np.random.Generator) -> NDArray[np.intp]:
    """Return the rows to keep, drawn by how far their neighbours are."""
    deviation = described.std(axis=0)
    scaled = described / np.where(deviation > 0, deviation, 1.0)
    distances, _ = scipy.spatial.KDTree(scaled).query(scaled, _NEIGHBOURS + 1)
    chance = distances[:, 1:].mean(axis=1) ** _LIKING
    # the greatest of chance / exponential are a draw without replacement by chance
    order = np.argsort(-chance / generator.exponential(size=len(chance)), kind="stable")
    return order[:_KEPT]
