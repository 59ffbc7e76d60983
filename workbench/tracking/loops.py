"""Compiled loops of cleaning over the samples of markers and paths.

Samples run along the last, fast axis. The loops run without the interpreter's lock, so that the
bodies of a take are cleaned in parallel. Importing numba takes most of a second: readers of a take
do not import this module.
"""

from __future__ import annotations

import numba
import numpy as np

__all__ = ["fit", "median_of_five", "smooth", "steady", "visible", "whole"]

_MOST_STEPS = 30  # Newton's; three or four are usual
_CONVERGED = 1e-14
_COMPILED = {"cache": True, "nogil": True, "error_model": "numpy"}


@numba.njit(**_COMPILED)
def visible(cloud, placed):
    """Return which markers each sample shows, (n,): bit k of the k-th one.

    Args:
        cloud: (m, 3, n), NaN where not seen.
        placed: (m,) False for a marker that is left out.
    """
    pattern = np.zeros(cloud.shape[2], dtype=np.int64)
    for k in range(cloud.shape[0]):
        if placed[k]:
            x, y, z = cloud[k, 0], cloud[k, 1], cloud[k, 2]
            for i in range(len(pattern)):
                pattern[i] |= np.int64(np.isfinite(x[i] + y[i] + z[i])) << k
    return pattern


@numba.njit(**_COMPILED)
def whole(cloud):
    """Find the samples (n,) that show all markers (m, 3, n), NaN where not seen."""
    shown = np.ones(cloud.shape[2], dtype=np.bool_)
    for k in range(cloud.shape[0]):
        x, y, z = cloud[k, 0], cloud[k, 1], cloud[k, 2]
        for i in range(len(shown)):
            shown[i] &= np.isfinite(x[i] + y[i] + z[i])
    return shown


@numba.njit(**_COMPILED)
def steady(cloud, limit):
    """Find the samples (n,) whose markers all moved by less than a limit since the sample before.

    Args:
        cloud: (m, 3, n) [m], NaN where not seen; such a marker may have moved.
        limit: [m].
    """
    count, square = cloud.shape[2], limit**2
    near = np.ones(count, dtype=np.bool_)
    near[0] = False
    for k in range(cloud.shape[0]):
        x, y, z = cloud[k, 0], cloud[k, 1], cloud[k, 2]
        for i in range(1, count):
            dx, dy, dz = x[i] - x[i - 1], y[i] - y[i - 1], z[i] - z[i - 1]
            near[i] &= dx * dx + dy * dy + dz * dz < square
    return near


@numba.njit(**_COMPILED)
def fit(places, weights, cloud, pattern, out):
    """Fit poses by FOAM: fill `out` (13, n) with origin, matrix row by row and misfit.

    Args:
        places: (m, 3) markers in the body's frame [m].
        weights: (m,) above 0.
        cloud: (m, 3, n) the same markers seen [m].
        pattern: (n,) as `visible` gives it; 0 for a sample that has no pose.
        out: filled, NaN where there is no pose.
    """
    last, used = np.int64(0), 0
    shown, share = np.empty(len(places), dtype=np.intp), np.empty(len(places))
    body, seen = np.empty_like(places), np.empty_like(places)
    middle, centre, extent = np.zeros(3), np.zeros(3), 0.0
    b, turn = np.empty((3, 3)), np.empty((3, 3))
    for i in range(len(pattern)):
        if pattern[i] == 0:
            out[:, i] = np.nan
            continue
        if pattern[i] != last:
            last, used, total, extent = pattern[i], 0, 0.0, 0.0
            for k in range(len(places)):
                if last >> k & 1:
                    shown[used], share[used] = k, weights[k]
                    total += weights[k]
                    used += 1
            middle[:] = 0.0
            for k in range(used):
                share[k] /= total
                middle += share[k] * places[shown[k]]
            for k in range(used):
                body[k] = places[shown[k]] - middle
                extent += share[k] * np.sum(body[k] ** 2)
        centre[:], b[:] = 0.0, 0.0
        for k in range(used):
            for j in range(3):
                seen[k, j] = cloud[shown[k], j, i]
                centre[j] += share[k] * seen[k, j]
        size = 0.0
        for k in range(used):
            for j in range(3):
                seen[k, j] -= centre[j]
                size += share[k] * seen[k, j] ** 2
                part = share[k] * seen[k, j]
                for axis in range(3):
                    b[j, axis] += part * body[k, axis]
        _rotation(b, np.sqrt(size * extent), turn)
        misfit = 0.0
        for k in range(used):
            for j in range(3):
                at = turn[j, 0] * body[k, 0] + turn[j, 1] * body[k, 1] + turn[j, 2] * body[k, 2]
                misfit += share[k] * (seen[k, j] - at) ** 2
        for j in range(3):
            at = turn[j, 0] * middle[0] + turn[j, 1] * middle[1] + turn[j, 2] * middle[2]
            out[j, i] = centre[j] - at
            for axis in range(3):
                out[3 + 3 * j + axis, i] = turn[j, axis]
        out[12, i] = np.sqrt(misfit)


@numba.njit(**_COMPILED)
def _rotation(b, most, turn):
    """Write into `turn` (3, 3) the rotation that maximises the trace of its product with `b`.

    Args:
        b: (3, 3) sum of weighted outer products, bench times body.
        most: upper bound of that trace, where Newton's iteration starts.
        turn: filled.
    """
    square, cofactors, determinant = 0.0, 0.0, 0.0
    for i in range(3):
        for j in range(3):
            # indices below zero count from the end
            turn[i, j] = b[i - 2, j - 2] * b[i - 1, j - 1] - b[i - 2, j - 1] * b[i - 1, j - 2]
            square += b[i, j] ** 2
            cofactors += turn[i, j] ** 2
    for j in range(3):
        determinant += b[0, j] * turn[0, j]
    trace = most
    for _ in range(_MOST_STEPS):
        over = trace**2 - square
        slope = 4 * trace * over - 8 * determinant
        if not slope > 0:
            break
        step = (over**2 - 8 * trace * determinant - 4 * cofactors) / slope
        trace -= step
        if abs(step) <= _CONVERGED * trace:
            break
    half = (trace**2 - square) / 2
    scale = 1 / (half * trace - determinant)  # not finite where all markers coincide
    for i in range(3):
        g0 = b[i, 0] * b[0, 0] + b[i, 1] * b[0, 1] + b[i, 2] * b[0, 2]
        g1 = b[i, 0] * b[1, 0] + b[i, 1] * b[1, 1] + b[i, 2] * b[1, 2]
        g2 = b[i, 0] * b[2, 0] + b[i, 1] * b[2, 1] + b[i, 2] * b[2, 2]
        for j in range(3):
            gram = g0 * b[0, j] + g1 * b[1, j] + g2 * b[2, j]
            turn[i, j] = ((half + square) * b[i, j] + trace * turn[i, j] - gram) * scale


@numba.njit(**_COMPILED)
def smooth(values, seen, penalty):
    """Return the curve (d, n) of `smoothing`: L D L' of its banded equations, forth and back.

    Args:
        values: (d, n), ignored at samples not seen.
        seen: (n,).
        penalty: lambda of the squared third differences.
    """
    count = len(seen)
    out = np.empty(values.shape)
    lower, pivots = np.zeros((count, 3)), np.zeros(count)
    band, entry = np.zeros(4), np.zeros(4)
    for i in range(count):
        if i < 4 or i > count - 4:  # between the ends it is the same for all
            _roughness(i, count, band)
        diagonal = penalty * band[0] + seen[i]
        for apart in range(min(3, i), 0, -1):
            entry[apart] = penalty * band[apart]
            for further in range(apart + 1, min(3, i) + 1):
                entry[apart] -= entry[further] * lower[i - apart, further - apart - 1]
            lower[i, apart - 1] = entry[apart] / pivots[i - apart]
            diagonal -= lower[i, apart - 1] * entry[apart]
        pivots[i] = diagonal
        for d in range(len(values)):
            rest = values[d, i] if seen[i] else 0.0
            for apart in range(1, min(3, i) + 1):
                rest -= lower[i, apart - 1] * out[d, i - apart]
            out[d, i] = rest
    for i in range(count - 1, -1, -1):
        for d in range(len(values)):
            rest = out[d, i] / pivots[i]
            for apart in range(1, min(3, count - 1 - i) + 1):
                rest -= lower[i + apart, apart - 1] * out[d, i + apart]
            out[d, i] = rest
    return out


@numba.njit(**_COMPILED)
def _roughness(i, count, band):
    """Write row i of D'D, 0 to 3 columns before its diagonal; D takes third differences."""
    difference = (-1.0, 3.0, -3.0, 1.0)
    band[:] = 0.0
    for apart in range(4):
        for first in range(4 - apart):
            if 0 <= i - apart - first < count - 3:
                band[apart] += difference[first] * difference[first + apart]


@numba.njit(**_COMPILED)
def median_of_five(values):
    """Return the running medians of five, (d, n), the ends repeated; faster than a sort."""
    out, last = np.empty(values.shape), values.shape[1] - 1
    for d in range(len(values)):
        own, medians = values[d], out[d]
        for i in range(last + 1):
            a, b = own[max(i - 2, 0)], own[max(i - 1, 0)]
            c, e = own[min(i + 1, last)], own[min(i + 2, last)]
            low, high = max(min(a, b), min(c, e)), min(max(a, b), max(c, e))
            medians[i] = max(min(low, high), min(max(low, high), own[i]))
    return out
