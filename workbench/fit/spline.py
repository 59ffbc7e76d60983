"""Smoothing splines of many strengths at once, compiled: Whittaker's, with a band of five.

For each strength s (W'W + s D'D) x = g is solved by L d L', with W the whitening of residuals and D
second differences.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["left_of", "rests_of"]

Array = NDArray[np.float64]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def left_of(
    strength: float, bands: Array, square: Array, beside: Array, every: Array, goal: Array
) -> Array:
    """Return what a smooth of a strength leaves of some columns, (n, c) [unit of the columns].

    Args:
        strength: of the penalty [1].
        bands: (3, n) of D'D by their distance from the diagonal, each at its later row [1].
        square: (n,) diagonal of W'W [1].
        beside: (n,) of W'W beside the diagonal, at its later row [1].
        every: (n, c) columns.
        goal: (n, c) W'W of the columns.
    """
    count, columns = every.shape
    pivot, one, two = np.empty(count), np.zeros(count + 2), np.zeros(count + 2)
    smooth = goal.copy()
    for k in range(count):
        pivot[k] = strength * bands[0, k] + square[k]
        if k > 1:
            two[k] = strength * bands[2, k] / pivot[k - 2]
            pivot[k] -= two[k] * two[k] * pivot[k - 2]
        if k > 0:
            along = strength * bands[1, k] + beside[k]
            if k > 1:
                along -= two[k] * pivot[k - 2] * one[k - 1]
            one[k] = along / pivot[k - 1]
            pivot[k] -= one[k] * one[k] * pivot[k - 1]
        for c in range(columns):
            if k > 0:
                smooth[k, c] -= one[k] * smooth[k - 1, c]
            if k > 1:
                smooth[k, c] -= two[k] * smooth[k - 2, c]
    for k in range(count - 1, -1, -1):
        for c in range(columns):
            smooth[k, c] /= pivot[k]
            if k + 1 < count:
                smooth[k, c] -= one[k + 1] * smooth[k + 1, c]
            if k + 2 < count:
                smooth[k, c] -= two[k + 2] * smooth[k + 2, c]
    return every - smooth


@numba.njit(cache=True, nogil=True, error_model="numpy")
def rests_of(
    strengths: Array, bands: Array, square: Array, beside: Array, every: Array, goal: Array
) -> Array:
    """Return the products of columns with what each strength leaves of them, (s, c, c).

    Args:
        strengths: (s,) of the penalty [1].
        bands: of `left_of`, as all that follows.
        square: (n,) [1].
        beside: (n,) [1].
        every: (n, c).
        goal: (n, c).
    """
    count, columns = every.shape
    rests = np.zeros((len(strengths), columns, columns))
    for i in range(len(strengths)):
        left = left_of(strengths[i], bands, square, beside, every, goal)
        for k in range(count):
            for a in range(columns):
                for b in range(columns):
                    rests[i, a, b] += goal[k, a] * left[k, b]
    return rests
