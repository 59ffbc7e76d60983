"""Measured less predicted for all runs, and how it changes with each unknown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.layout import Layout
from workbench.diagnose.noise import Noise, coloured, whitened
from workbench.diagnose.rig import Forgetful, Rig, Windowed
from workbench.tracking.glitches import spikes

__all__ = ["Anchor", "Linear", "Problem", "Slope"]

Vectors = list[NDArray[np.float64]]

_WANTED = 0.3  # of the noise: what a finite difference of a base number moves the prediction by
_LONGEST_STEP = 0.5  # of a tolerance
_OVER_JUMPS = 5.0  # times the step where runs forget: landings make them answer in little jumps
_GLITCH = 8.0  # deviations of the noise from the median of the samples around


@dataclass(frozen=True, eq=False)
class Slope:
    """How the prediction of one run changes with each unknown.

    Args:
        jacobian: (m, u) of the whitened prediction.
        seen: (n, c) which of the n c = m values count.
        noise: of the run.
    """

    jacobian: NDArray[np.float64]
    seen: NDArray[np.bool_]
    noise: Noise

    @cached_property
    def curvature(self) -> NDArray[np.float64]:
        """Return J^T J, (u, u)."""
        return self.jacobian.T @ self.jacobian

    @cached_property
    def squares(self) -> NDArray[np.float64]:
        """Return the same of the prediction as it is, in noise deviations, not whitened."""
        plain = self.coloured(self.jacobian)
        return plain.T @ plain

    def coloured(self, white: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return whitened changes of the prediction, (m,) or (m, k), as they are."""
        if not self.noise.memory.any():
            return white
        shape = (*self.seen.shape, *white.shape[1:])
        return coloured(white.reshape(shape), self.seen, self.noise).reshape(white.shape)

    def with_jacobian(self, jacobian: NDArray[np.float64]) -> Slope:
        """Return the slope with other derivatives, (m, u)."""
        return Slope(jacobian, self.seen, self.noise)


@dataclass(frozen=True, eq=False)
class Linear:
    """The runs in the neighbourhood of a point.

    Args:
        z: (u,) where the residuals are.
        runs: which ones, in this order.
        residuals: by run, (m_k,) whitened.
        slopes: by run.
    """

    z: NDArray[np.float64]
    runs: tuple[int, ...]
    residuals: Vectors
    slopes: tuple[Slope, ...]

    @property
    def jacobians(self) -> Vectors:
        """Return how the whitened prediction changes, by run, (m_k, u)."""
        return [slope.jacobian for slope in self.slopes]

    @property
    def curvature(self) -> NDArray[np.float64]:
        """Return the sum of J^T J over the runs, (u, u)."""
        return sum((slope.curvature for slope in self.slopes), np.zeros((len(self.z),) * 2))

    def curvature_of(self, columns: NDArray[np.int_]) -> NDArray[np.float64]:
        """Return the same, (u, u), zero but for some unknowns: a step asks for those that move."""
        found = np.zeros((len(self.z),) * 2)
        parts = [matrix[:, columns] for matrix in self.jacobians]
        found[np.ix_(columns, columns)] = sum(part.T @ part for part in parts)
        return found

    @property
    def squares(self) -> NDArray[np.float64]:
        """Return the same of the predictions as they are, in noise deviations, not whitened."""
        return sum((slope.squares for slope in self.slopes), np.zeros((len(self.z),) * 2))

    @property
    def gradient(self) -> NDArray[np.float64]:
        """Return the sum of J^T r over the runs, (u,): where the prediction should go."""
        pairs = zip(self.jacobians, self.residuals, strict=True)
        return sum((slope.T @ residual for slope, residual in pairs), np.zeros(len(self.z)))

    def at(self, z: NDArray[np.float64], residuals: Vectors) -> Linear:
        """Return the same neighbourhood with the residuals of another point in it."""
        return Linear(z, self.runs, residuals, self.slopes)

    def with_jacobians(self, jacobians: Vectors) -> Linear:
        """Return the same place with other derivatives."""
        pairs = zip(self.slopes, jacobians, strict=True)
        slopes = tuple(slope.with_jacobian(jacobian) for slope, jacobian in pairs)
        return Linear(self.z, self.runs, self.residuals, slopes)

    def without(self, run: int) -> Linear:
        """Return the same of all other runs."""
        kept = [at for at, k in enumerate(self.runs) if k != run]
        return Linear(
            self.z,
            tuple(self.runs[at] for at in kept),
            [self.residuals[at] for at in kept],
            tuple(self.slopes[at] for at in kept),
        )

    def apart(self, other: Linear) -> float:
        """Return the sum of squares by which the predictions at two places differ, not whitened.

        Args:
            other: the same runs, in noise deviations too.
        """
        rows = zip(self.slopes, self.residuals, other.residuals, strict=True)
        return sum(float(np.sum(slope.coloured(a - b) ** 2)) for slope, a, b in rows)


@dataclass(frozen=True, eq=False)
class Anchor:
    """A place beside which others are simulated in coarse steps.

    What coarse steps get wrong hardly changes from place to place (Alexandrov and others 2001,
    doi:10.2514/2.2877: a correction that makes a cheap model agree with the dear one).

    Args:
        z: (u,) the place.
        residuals: there, by run, (m_k,) whitened.
        coarse: what is predicted there in coarse steps, by run, (n, c).
        until: how much of each run counts [s].
    """

    z: NDArray[np.float64]
    residuals: Vectors
    coarse: Vectors
    until: float


class Problem:
    """What a fit of a rig minimises.

    Args:
        rig: with its runs.
        layout: of its unknowns.
        noise: by run.
        runs: that count here; their own unknowns and the shared ones may move.
    """

    def __init__(
        self, rig: Rig, layout: Layout, noise: Sequence[Noise], runs: Sequence[int]
    ) -> None:
        self.rig, self.layout, self.noise, self.runs = rig, layout, noise, tuple(runs)
        self.steps = layout.steps.copy()
        self.seen = {k: self._steady(k, run.values) for k, run in enumerate(rig.runs)}

    def look_again(self, z: NDArray[np.float64]) -> None:
        """Find glitches once more, in what is left of the runs where a model follows them.

        There the motion itself hides none; a glitch beside a gap is told from the way that the
        robot went unseen.
        """
        for k, predicted in zip(self.runs, self.predictions(z), strict=True):
            self.seen[k] = self._steady(k, self.rig.runs[k].values - predicted)

    def shortened(self, followed: Mapping[int, float]) -> Problem | None:
        """Return the same with runs that forget compared only for as long as a model follows them.

        Args:
            followed: by run [s]. Runs that do not count here end with the shortest of those that
                do.

        Returns:
            None where all are followed to their ends.
        """
        runs = self.rig.runs
        forgetting = [k for k, run in enumerate(runs) if run.forgets]
        ends = {k: followed[k] for k in forgetting
                if k in followed and followed[k] < runs[k].times[-1]}  # fmt: skip
        if not ends or not isinstance(self.rig, Forgetful):
            return None
        others = {k: min(ends.values()) for k in forgetting if k not in followed}
        return Problem(self.rig.shortened(ends | others), self.layout, self.noise, self.runs)

    def in_windows(self, z: NDArray[np.float64]) -> Problem | None:
        """Return the same with runs that forget compared in short windows too; None without any.

        Args:
            z: (u,) a place near what is true.
        """
        forgetting = [k for k in self.runs if self.rig.runs[k].forgets]
        if not forgetting or not isinstance(self.rig, Windowed):
            return None
        rig = self.rig.in_windows({k: self.layout.values(z, k) for k in forgetting})
        return None if rig is None else Problem(rig, self.layout, self.noise, self.runs)

    def samples(self, until: float = np.inf) -> int:
        """Return how many values are compared."""
        return sum(int(self.seen[k][self._rows(k, until)].sum()) for k in self.runs)

    def predictions(
        self, z: NDArray[np.float64], until: float = np.inf, coarse: bool = False
    ) -> Vectors:
        """Return what is predicted of each run, (n, c), in one batch."""
        return self.rig.predict([(k, self.layout.values(z, k)) for k in self.runs], until, coarse)

    def residuals(self, z: NDArray[np.float64], until: float = np.inf) -> Vectors:
        """Return measured less predicted by run, (m_k,) whitened."""
        found = []
        for k, predicted in zip(self.runs, self.predictions(z, until), strict=True):
            rows = self._rows(k, until)
            apart = self.rig.runs[k].values[rows] - predicted
            found.append(whitened(apart, self.seen[k][rows], self.noise[k]).ravel())
        return found

    def anchor(self, z: NDArray[np.float64], residuals: Vectors, until: float = np.inf) -> Anchor:
        """Return a place, whose residuals are known, as one to go on from in coarse steps."""
        return Anchor(z, residuals, self.predictions(z, until, coarse=True), until)

    def beside(self, anchor: Anchor, z: NDArray[np.float64]) -> Vectors:
        """Return the residuals of a place near an anchor, by run, (m_k,) whitened."""
        found = []
        places = self.predictions(z, anchor.until, coarse=True)
        rows = zip(self.runs, anchor.residuals, anchor.coarse, places, strict=True)
        for k, residual, before, after in rows:
            seen = self.seen[k][self._rows(k, anchor.until)]
            found.append(residual - whitened(after - before, seen, self.noise[k]).ravel())
        return found

    def linear(
        self, z: NDArray[np.float64], columns: NDArray[np.int_], until: float = np.inf
    ) -> Linear:
        """Return the neighbourhood of a place; columns that are not asked for are zero.

        Differences are simulated in one batch, in coarse steps where the rig allows them; those of
        unknowns that need the steps of the residuals, in another.
        """
        rows = {k: self._rows(k, until) for k in self.runs}
        jacobians = {k: np.zeros((self.seen[k][rows[k]].size, len(self.layout))) for k in self.runs}
        exact = self.layout.exact[columns]
        for some, coarse in ((columns[~exact], True), (columns[exact], False)):
            if len(some):
                self._add_differences(jacobians, z, some, until, coarse)
        self._adapt(jacobians)
        slopes = [Slope(jacobians[k], self.seen[k][rows[k]], self.noise[k]) for k in self.runs]
        return Linear(z, self.runs, self.residuals(z, until), tuple(slopes))

    def _add_differences(
        self,
        jacobians: dict[int, NDArray[np.float64]],
        z: NDArray[np.float64],
        columns: NDArray[np.int_],
        until: float,
        coarse: bool,
    ) -> None:
        """Put how the whitened prediction of each run changes into some columns."""
        layout, asked, moved = self.layout, [], []
        for k in self.runs:
            asked.append((k, layout.values(z, k)))
            moved.append((k, -1, 0.0))
            for i in columns:
                if layout.run[i] not in (-1, k):
                    continue
                step = self._step(int(i), z, k)
                there = z.copy()
                there[i] += step
                asked.append((k, layout.values(there, k)))
                moved.append((k, int(i), step))
        found = self.rig.predict(asked, until, coarse)
        base: NDArray[np.float64] = np.empty(0)
        for (k, i, step), predicted in zip(moved, found, strict=True):
            if i < 0:
                base = predicted
                continue
            seen = self.seen[k][self._rows(k, until)]
            change = whitened((predicted - base) / step, seen, self.noise[k])
            jacobians[k][:, i] = change.ravel()

    def _step(self, i: int, z: NDArray[np.float64], k: int) -> float:
        """Return the step of a difference in a run, away from a bound."""
        jumps = self.rig.runs[k].forgets and not self.layout.exact[i]
        step = float(self.steps[i]) * (_OVER_JUMPS if jumps else 1.0)
        return -step if z[i] + step > self.layout.high[i] + step / 2 else step

    def _adapt(self, jacobians: dict[int, NDArray[np.float64]]) -> None:
        """Choose the next steps of base and own numbers so that they move the prediction a bit."""
        total = sum(np.sum(matrix**2, axis=0) for matrix in jacobians.values())
        rows = sum(len(matrix) for matrix in jacobians.values())
        size = np.sqrt(np.asarray(total) / rows)
        plain = np.union1d(self.layout.base, self.layout.own())
        moving = plain[size[plain] > 0]
        self.steps[moving] = np.clip(_WANTED / size[moving], 1e-6, _LONGEST_STEP)

    def _steady(self, k: int, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which samples of a run count: seen, and no glitches alone or in pairs."""
        run = self.rig.runs[k]
        wild = [
            spikes(run.times, np.where(seen, column, np.nan)[:, None], _GLITCH * sigma)
            for column, seen, sigma in zip(values.T, run.valid.T, self.noise[k].sigma, strict=True)
        ]
        return run.valid & ~np.column_stack(wild)

    def _rows(self, k: int, until: float) -> NDArray[np.bool_]:
        return self.rig.runs[k].times <= until
