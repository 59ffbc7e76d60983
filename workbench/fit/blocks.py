"""A Jacobian in blocks of rows: a run depends on the shared parameters and on its own alone.

Products cost a fraction of those of the whole matrix. Brought up to date block by block it keeps
its zeros (Schubert, Math. Comp. 24, 1970, 27): what one run does otherwise than predicted changes
no other run's derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

__all__ = ["Blocks"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Blocks:
    """The blocks of a matrix (m, p).

    Args:
        edges: (b + 1,) rows between which the blocks lie.
        columns: (k,) of each block, those that are not all zero.
        parts: (rows, k) derivatives of each block [1].
        width: p.
    """

    edges: tuple[int, ...]
    columns: tuple[NDArray[np.intp], ...]
    parts: tuple[Array, ...]
    width: int

    @classmethod
    def of(cls, matrix: Array, edges: Sequence[int] = ()) -> Blocks:
        """Return the blocks of a matrix.

        Args:
            matrix: (m, p) [1].
            edges: (b + 1,) rows between which the blocks lie; all are one where none are given.
        """
        edges = tuple(edges) or (0, len(matrix))
        rows = [matrix[a:b] for a, b in pairwise(edges)]
        columns = tuple(np.flatnonzero(one.any(axis=0)) for one in rows)
        parts = tuple(one[:, chosen] for one, chosen in zip(rows, columns, strict=True))
        return cls(edges, columns, parts, matrix.shape[1])

    def dense(self) -> Array:
        """Return the matrix, (m, p) [1]."""
        matrix = np.zeros((self.edges[-1], self.width))
        for (a, b), columns, part in self._rows():
            matrix[a:b, columns] = part
        return matrix

    def normal(self, residuals: Array, weights: Array) -> tuple[Array, Array]:
        """Return J' W r, (p,) [1], and J' W J, (p, p) [1].

        Args:
            residuals: (m,) r [1].
            weights: (m,) diagonal of W [1].
        """
        gradient, curvature = np.zeros(self.width), np.zeros((self.width, self.width))
        for (a, b), columns, part in self._rows():
            weighted = part * weights[a:b, None]
            gradient[columns] += weighted.T @ residuals[a:b]
            curvature[np.ix_(columns, columns)] += weighted.T @ part
        return gradient, curvature

    def updated(self, change: Array, step: Array) -> Blocks:
        """Return Broyden's update of the blocks after a step.

        Args:
            change: (m,) by how much the residuals changed [1].
            step: (p,) that was taken [1].
        """
        parts = []
        for (a, b), columns, part in self._rows():
            own = step[columns]
            square = float(own @ own)
            if square > 0:
                part = part + np.outer(change[a:b] - part @ own, own / square)
            parts.append(part)
        return Blocks(self.edges, self.columns, tuple(parts), self.width)

    def _rows(self) -> zip[tuple[tuple[int, int], NDArray[np.intp], Array]]:
        return zip(pairwise(self.edges), self.columns, self.parts, strict=True)
