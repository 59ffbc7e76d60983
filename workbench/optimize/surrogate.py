"""What a search has learnt so far: a Gaussian process over what describes a candidate.

Rasmussen and Williams, "Gaussian processes for machine learning", 2006, through scikit-learn: a
Matern kernel of nu = 5/2 with a length for every descriptor, and white noise. Lengths and noise are
the most likely ones, learnt anew now and then; in between only the data grow.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Surrogate", "learn_scales"]

Array = NDArray[np.float64]

_MOST_TO_LEARN_FROM = 240  # candidates, the best ones: the effort grows with their cube
_LENGTHS = (1.0, 30.0)  # of the descriptors' spread; shorter ones follow single hops, not slopes
_VARIANCE = (1e-2, 1e2)  # of the scores' own
_NOISE = (1e-5, 0.5)  # of the scores' variance
_JITTER = 1e-9


def learn_scales(described: Array, scores: Array, begin: Sequence[float]) -> list[float]:
    """Return the most likely scales: logarithms of variance, lengths and noise.

    Args:
        described: (n, f) [spreads of the descriptors].
        scores: (n,) more is better [unit of the score].
        begin: where to look from beside the usual place, those learnt before; empty for none.
    """
    from sklearn.exceptions import ConvergenceWarning

    best = np.argsort(-scores, kind="stable")[:_MOST_TO_LEARN_FROM]
    kernel = _kernel(described.shape[1])
    begins = [kernel, *([kernel.clone_with_theta(np.array(begin))] if len(begin) else [])]
    with _one_thread(), warnings.catch_warnings():
        # a scale at its bound is an answer: it does not matter
        warnings.simplefilter("ignore", ConvergenceWarning)
        with ThreadPoolExecutor(len(begins)) as pool:
            fits = pool.map(lambda one: _process(one).fit(described[best], scores[best]), begins)
            found = list(fits)
    likeliest = max(found, key=lambda process: process.log_marginal_likelihood_value_)
    return [float(scale) for scale in likeliest.kernel_.theta]


class Surrogate:
    """Predicts the scores of candidates, and how sure that is.

    Args:
        described: (n, f) [spreads of the descriptors].
        scores: (n,) more is better [unit of the score].
        scales: as `learn_scales` gave them.
    """

    def __init__(self, described: Array, scores: Array, scales: Sequence[float]) -> None:
        kernel = _kernel(described.shape[1]).clone_with_theta(np.array(scales))
        with _one_thread():
            self._process = _process(kernel, optimizer=None).fit(described, scores)

    def predict(self, described: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation of the scores, each (m,) [unit of the score].

        Args:
            described: (m, f) [spreads of the descriptors].
        """
        with _one_thread():
            mean, deviation = self._process.predict(described, return_std=True)
        return mean, deviation

    def together(self, described: Array) -> tuple[Array, Array]:
        """Return mean, (m,) [unit of the score], and covariance, (m, m) [its square].

        Args:
            described: (m, f) [spreads of the descriptors].
        """
        with _one_thread():
            mean, covariance = self._process.predict(described, return_cov=True)
        return mean, covariance


def _kernel(count: int) -> Any:
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    matern: Any = Matern(np.full(count, 3.0), _LENGTHS, nu=2.5)  # pyright: ignore[reportArgumentType]
    return ConstantKernel(1.0, _VARIANCE) * matern + WhiteKernel(0.05, _NOISE)


def _process(kernel: Any, **how: Any) -> Any:
    """Return the process; the types that scikit-learn states are not those it takes."""
    from sklearn.gaussian_process import GaussianProcessRegressor

    return GaussianProcessRegressor(kernel, alpha=_JITTER, normalize_y=True, **how)


def _one_thread() -> AbstractContextManager[object]:
    """Return a context for linear algebra on one thread: several wait for each other.

    With two threads on two busy cores a factorisation of 240 candidates took 59 ms, with one 1 ms.
    """
    return _libraries().limit(limits=1, user_api="blas")


@cache
def _libraries() -> Any:
    """Return what limits the threads: to look for the libraries takes 2 ms, so it is done once."""
    import scipy.linalg  # noqa: F401 - brings the library whose threads are limited
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
