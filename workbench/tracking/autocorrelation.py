"""Covariance of a least-squares fit with autocorrelated residuals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["block_covariance", "correlation_time", "time_blocks"]

_MEMORY_END = 0.05


def time_blocks(times: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    """Return the number of the block of each time, (n,).

    Args:
        times: (n,) increasing [s].
        count: of blocks, of equal length.
    """
    share = (times - times[0]) / (times[-1] - times[0])
    return np.minimum((count * share).astype(np.intp), count - 1)


def block_covariance(
    terms: NDArray[np.float64], left: NDArray[np.float64], block: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Return a least-squares fit's covariance, (p, p) [units of its numbers squared], by blocks.

    Each block is left out in turn. It holds as long as residuals are uncorrelated from block to
    block (the jackknife of clustered data). With ten blocks its errors are those of a Student t
    with few degrees of freedom: twice the standard error covers nine times out of ten.

    Args:
        terms: (n, p) of the fit [unit of the residuals by that of each number].
        left: (n,) residuals [any unit].
        block: (n,) block of each sample; no block may determine a term alone.
    """
    whole = terms.T @ terms
    moved = []
    for number in np.unique(block):
        part = terms[block == number]
        moved.append(np.linalg.solve(whole - part.T @ part, part.T @ left[block == number]))
    apart = np.array(moved)
    return apart.T @ apart * (len(apart) - 1) / len(apart)


def correlation_time(t: NDArray[np.float64], left: NDArray[np.float64]) -> float:
    """Return the integrated autocorrelation time of residuals [s].

    The sum ends where the correlation first falls below 0.05. Gaps do no harm.

    Args:
        t: (n,) increasing [s], on an even grid but for gaps.
        left: (n,) residuals [any unit].
    """
    period = float(np.median(np.diff(t)))
    slot = np.rint((t - t[0]) / period).astype(int)
    series, seen = np.zeros(slot[-1] + 1), np.zeros(slot[-1] + 1)
    series[slot], seen[slot] = left - left.mean(), 1.0
    size = 2 * len(series)
    power = np.fft.irfft(np.abs(np.fft.rfft(series, size)) ** 2)[: len(series) // 2]
    pairs = np.fft.irfft(np.abs(np.fft.rfft(seen, size)) ** 2)[: len(series) // 2]
    memory = (power / np.maximum(pairs, 1.0)) / (power[0] / pairs[0])
    gone = np.flatnonzero(memory < _MEMORY_END)
    stop = int(gone[0]) if len(gone) else len(memory)
    return period * float(1 + 2 * memory[1:stop].sum())
