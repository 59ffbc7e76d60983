"""Errors of a least-squares fit whose residuals hang together in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["block_covariance", "time_blocks"]


def time_blocks(times: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    """Return the number of the block of each time, (n,), of `count` blocks of equal length."""
    share = (times - times[0]) / (times[-1] - times[0])
    return np.minimum((count * share).astype(np.intp), count - 1)


def block_covariance(
    terms: NDArray[np.float64], left: NDArray[np.float64], block: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Return the covariance (p, p) of a least-squares fit, from leaving out each block in turn.

    It holds as long as what is left of the fit forgets itself within a block (the jackknife of
    clustered data). With ten blocks its errors are those of a Student t with few degrees of
    freedom: twice the standard error covers nine times out of ten.

    Args:
        terms: (n, p) of the fit.
        left: (n,) residuals.
        block: (n,) block of each sample; no block may determine a term alone.
    """
    whole = terms.T @ terms
    moved = []
    for number in np.unique(block):
        part = terms[block == number]
        moved.append(np.linalg.solve(whole - part.T @ part, part.T @ left[block == number]))
    apart = np.array(moved)
    return apart.T @ apart * (len(apart) - 1) / len(apart)
