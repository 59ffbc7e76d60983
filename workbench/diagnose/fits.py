"""Hypotheses fitted: the base within its tolerances, and it with candidates released.

A hypothesis is the base model with some priors released. All are fitted by one recipe and weighed
at the process noise that makes each most likely, so that a cause which is found is paid for by
the forces that are no longer missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.rigs import Rig
from workbench.diagnose.rules import RULES, Rules
from workbench.fit import (
    Estimator,
    Innovations,
    Parameter,
    ParameterVector,
    Scope,
    fit_system,
    minimised,
)
from workbench.fit.estimator import REFUSED, ROBUST
from workbench.fit.fitting import refined
from workbench.fit.minimise import ROUGH, soft
from workbench.fit.process import likeliest
from workbench.progress import Progress

__all__ = ["Fits", "Hypothesis", "Promise"]

Array = NDArray[np.float64]

_BLOCK_S = 1.0
_FEWEST = 4  # blocks of a run
_FREED = 1e-2  # of the curvature of a prior, for what is released
_STEPS = 6  # evaluations of one refit
_OFF = 0.1


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """The base with some candidates released, as fitted.

    Args:
        names: of the candidates; none is the base.
        estimator: of the fitted runs, with its process noise.
        x: (p,) numbers of its parameters.
        blocks: -2 ln L of each second of the fitted runs, one array a run.
        held: the same of the runs held out.
        prior: sum of squares of the numbers that have a prior.
        jacobian: (m, p) of the residuals at the end of the fit, or near it.
    """

    names: tuple[str, ...]
    estimator: Estimator
    x: Array
    blocks: tuple[Array, ...]
    held: tuple[Array, ...]
    prior: float
    jacobian: Array

    @property
    def cost(self) -> float:
        """Return -2 ln of the posterior of the fitted runs."""
        return self.prior + sum(float(one.sum()) for one in self.blocks)

    @property
    def values(self) -> dict[str, float]:
        """Return the value of each parameter by its name."""
        vector = self.estimator.vector
        return {one.name: value for one, value in vector.values(self.x).items()}


@dataclass(frozen=True, eq=False)
class Promise:
    """What a candidate promises in the neighbourhood of a fit, without a simulation of its own.

    Args:
        name: of the candidate.
        gain: by which the cost would fall, were the residuals straight.
        sure: that gain over its own scatter from second to second.
        numbers: parameter's name -> number there.
        reach: length of the step [prior deviations].
    """

    name: str
    gain: float
    sure: float
    numbers: dict[str, float]
    reach: float


class Fits:
    """Fits hypotheses to the runs of a rig.

    Args:
        rig: with its runs.
        rules: of the diagnosis.
        tell: is told each stage.
        threads: 0 takes all cores.
    """

    def __init__(
        self, rig: Rig, rules: Rules = RULES, tell: Progress = lambda text: None, threads: int = 0
    ) -> None:
        self.rig, self.rules, self.tell, self.threads = rig, rules, tell, threads
        runs = range(len(rig.roles))
        self.train = [k for k in runs if rig.roles[k] == "train"]
        self.held = [k for k in runs if rig.roles[k] != "train"]
        self.candidates = {one.name: one for one in rig.candidates}
        self._held: Estimator | None = None

    def base(self) -> Hypothesis:
        """Fit the base within its tolerances."""
        system = self.rig.system(self.train, self.rig.base)
        fit = fit_system(
            system, ParameterVector(system.parameters), progress=self.tell, threads=self.threads
        )
        return self._hypothesis((), fit.estimator, fit.x, fit.jacobian)

    def promises(self, at: Hypothesis) -> list[Promise]:
        """Return what every candidate promises beside those of a hypothesis, greatest gain first."""
        every = [p for one in self.candidates.values() for p in one.quantities.values()]
        estimator, x = self._estimator(at, [*self.rig.base, *every])
        residuals, jacobian = estimator.residuals(x), estimator.jacobian(x)
        near = _Neighbourhood(estimator, x, residuals, jacobian)
        before = near.solved(self._moving(at.names))
        found = []
        for name in self.candidates:
            if name in at.names:
                continue
            after = near.solved(self._moving((*at.names, name)))
            gains = before.blocks - after.blocks
            scatter = float(np.std(gains)) * np.sqrt(len(gains))
            found.append(Promise(
                name, before.cost - after.cost, float(gains.sum()) / max(scatter, 1e-9),
                dict(zip(near.names, after.x, strict=True)), float(np.linalg.norm(after.x - x)),
            ))  # fmt: skip
        return sorted(found, key=lambda one: -one.gain)

    def refit(self, names: Sequence[str], near: Hypothesis, promise: Promise) -> Hypothesis:
        """Fit a hypothesis from a neighbour and what was promised there."""
        released = self._released(names)
        estimator, x = self._estimator(near, released)
        goal = np.array([promise.numbers[p.name] for p in estimator.vector.parameters])
        low, high = estimator.vector.bounds
        goal = np.clip(goal, low + _OFF, high - _OFF)
        x = np.clip(x, low + _OFF, high - _OFF)
        starts = [x, goal, x + (goal - x) / 3]
        costs = [float(np.sum(soft(estimator.residuals(one), ROBUST))) for one in starts]
        x = starts[int(np.argmin(costs))]
        found = minimised(estimator, x, most=_STEPS, near=ROUGH)
        for _ in range(2):
            weighed = likeliest(estimator, found.x)
            if weighed.noise == estimator.noise:
                break
            estimator = weighed
            found = minimised(estimator, found.x, most=_STEPS, near=ROUGH)
        return self._hypothesis(tuple(names), estimator, found.x, found.jacobian)

    def _released(self, names: Sequence[str]) -> list[Parameter]:
        """Return the parameters of a hypothesis; those that are released have no prior."""
        freed = {free for name in names for free in self.candidates[name].frees}
        base = [replace(p, flat=True) if p.name in freed else p for p in self.rig.base]
        more = [p for name in names for p in self.candidates[name].quantities.values()]
        return [*base, *(replace(p, flat=True) for p in more)]

    def _moving(self, names: Sequence[str]) -> dict[str, bool]:
        """Return the shared parameters that may move -> whether they have a prior."""
        return {p.name: not p.flat for p in self._released(names)}

    def _estimator(
        self, near: Hypothesis, parameters: Sequence[Parameter]
    ) -> tuple[Estimator, Array]:
        """Return a neighbour's estimator with other parameters, and its numbers."""
        before = near.estimator
        system = self.rig.system(self.train, parameters, before.system)
        vector = ParameterVector(system.parameters)
        values = near.values
        x = np.array([p.number(values.get(p.name, p.nominal)) for p in vector.parameters])
        estimator = Estimator.of(system, vector, before.noise, before.masks, self.threads)
        return estimator, x

    def _hypothesis(
        self, names: tuple[str, ...], estimator: Estimator, x: Array, jacobian: Array
    ) -> Hypothesis:
        found = estimator.innovations(x, keep=True)
        blocks = tuple(_blocks(one, estimator.system.sample_s) for one in found)
        prior = float(np.sum(x[estimator.vector.weighted] ** 2))
        held = self._judged(estimator, x)
        return Hypothesis(names, estimator, x, blocks, held, prior, jacobian)

    def _judged(self, fitted: Estimator, x: Array) -> tuple[Array, ...]:
        """Return -2 ln L of each second of the runs held out; only what is theirs alone is fitted."""
        if not self.held:
            return ()
        shared = [p for p in fitted.vector.parameters if p.scope is not Scope.RUN]
        like = None if self._held is None else self._held.system
        system = self.rig.system(self.held, shared, like)
        vector = ParameterVector(system.parameters)
        values = {p.name: v for p, v in fitted.vector.values(x).items()}
        numbers = np.array([p.number(values.get(p.name, p.nominal)) for p in vector.parameters])
        masks = () if self._held is None else self._held.masks
        estimator = Estimator.of(system, vector, fitted.noise, masks, self.threads)
        if self._held is None:
            estimator = self._held = refined(estimator, numbers)
        own = np.array([p.scope is Scope.RUN for p in vector.parameters])
        found = minimised(estimator, numbers, own, 3, ROUGH)
        return tuple(
            _blocks(one, system.sample_s) for one in estimator.innovations(found.x, keep=True)
        )


@dataclass(frozen=True, eq=False)
class _Solved:
    """The least cost where some parameters move and the residuals are straight."""

    x: Array
    blocks: Array
    cost: float


class _Neighbourhood:
    """Residuals and derivatives of all candidates around a fit."""

    def __init__(self, estimator: Estimator, x: Array, residuals: Array, jacobian: Array) -> None:
        vector = estimator.vector
        self.x, self.names = x, [p.name for p in vector.parameters]
        self.own = [p.scope is Scope.RUN for p in vector.parameters]
        count = len(residuals) - int(vector.weighted.sum())
        self.residuals, self.jacobian = residuals[:count], jacobian[:count]
        weights = 1 / np.sqrt(1 + (self.residuals / ROBUST) ** 2)
        self.curvature = self.jacobian.T @ (self.jacobian * weights[:, None])
        self.gradient = self.jacobian.T @ (weights * self.residuals)
        system, edges = estimator.system, [0]
        for k in range(len(system.names)):
            pieces = _pieces(len(system.seen(k)), system.sample_s)
            channels = system.seen(k).shape[1]
            edges += list(edges[-1] + channels * pieces[1:])
        self.edges = np.array(edges)

    def solved(self, moving: dict[str, bool]) -> _Solved:
        """Return the least cost where shared parameters move -> whether they have a prior."""
        chosen = [
            i for i, (name, own) in enumerate(zip(self.names, self.own, strict=True))
            if own or name in moving
        ]  # fmt: skip
        prior = np.array([1.0 if moving.get(self.names[i], True) else _FREED for i in chosen])
        x = self.x[chosen]
        curvature = self.curvature[np.ix_(chosen, chosen)] + np.diag(prior)
        step = -np.linalg.solve(curvature, self.gradient[chosen] + prior * x)
        moved = self.x.copy()
        moved[chosen] += step
        costs = soft(self.residuals + self.jacobian[:, chosen] @ step, ROBUST)
        blocks = np.add.reduceat(costs, self.edges[:-1])
        kept = prior == 1.0
        return _Solved(moved, blocks, float(blocks.sum() + np.sum(moved[chosen][kept] ** 2)))


def _pieces(count: int, sample_s: float) -> NDArray[np.int64]:
    """Return the edges of a run's blocks of about a second, in samples."""
    pieces = max(_FEWEST, round(count * sample_s / _BLOCK_S))
    return np.linspace(0, count, pieces + 1).round().astype(np.int64)


def _blocks(one: Innovations, sample_s: float) -> Array:
    white = one.white.copy()
    white[one.sane :] = REFUSED
    costs = soft(np.nan_to_num(white, nan=REFUSED), ROBUST).sum(axis=1) + one.information
    edges = _pieces(len(costs), sample_s)
    return np.array([float(costs[a:b].sum()) for a, b in pairwise(edges)])
