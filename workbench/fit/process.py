"""Process noise by maximum likelihood: what the model misses, in N m sqrt(s) and N sqrt(s).

Strong noise lets the observer follow whatever was seen and forget at once: the cost is smooth even
far from the truth, and little is learnt. Weak noise remembers and learns more, and sees every
difference. The likelihood weighs both: log det S pays for every strength that is not needed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.fit.estimator import Estimator

__all__ = ["NOISE_FACTOR", "between_steps", "likeliest", "weaker"]

NOISE_FACTOR = 10**0.5
"""From one strength that is tried to the next."""

_GAIN = 1.0  # of log L that another strength must bring: less is chance
_HALF = 0.5  # of a step


def likeliest(
    estimator: Estimator, x: NDArray[np.float64], down: int = 8, up: int = 3
) -> Estimator:
    """Return the estimator with the process noise that makes what was seen most likely.

    One group after the other, from its present strength towards the better neighbour as long as the
    likelihood grows by more than chance.

    Args:
        estimator: with the present noise.
        x: (p,) parameters, kept [prior deviations].
        down: most steps towards a weaker noise.
        up: most steps towards a stronger one.
    """
    best, value = estimator, estimator.log_likelihood(x)
    for group in estimator.system.groups:
        if not estimator.depends_on(group):
            continue
        start = best
        for ways, factor in ((down, 1 / NOISE_FACTOR), (up, NOISE_FACTOR)):
            moved, current = False, start
            for _ in range(ways):
                current = _changed(current, group, factor)
                likelihood = current.log_likelihood(x)
                if likelihood < value + _GAIN:
                    break
                best, value, moved = current, likelihood, True
            if moved:
                break
    return best


def between_steps(estimator: Estimator, x: NDArray[np.float64]) -> Estimator:
    """Return the estimator with each group's noise at the vertex of a parabola.

    It goes through the log likelihoods at the present strength and a step to either side, in the
    logarithm of the strength. Where a foot lands the likelihood is kinked, and all stays.

    Args:
        estimator: with the likeliest process noise, but for half a step.
        x: (p,) parameters, kept [prior deviations].
    """
    system = estimator.system
    if any(map(system.lands, range(len(system.names)))):
        return estimator
    for group in filter(estimator.depends_on, system.groups):
        here = estimator.log_likelihood(x)
        weak, strong = (
            _changed(estimator, group, factor).log_likelihood(x)
            for factor in (1 / NOISE_FACTOR, NOISE_FACTOR)
        )
        bend = weak - 2 * here + strong
        step = np.clip((weak - strong) / (2 * bend), -_HALF, _HALF) if bend < 0 else 0.0
        there = _changed(estimator, group, NOISE_FACTOR ** float(step))
        if there.log_likelihood(x) > here:
            estimator = there
    return estimator


def weaker(estimator: Estimator, group: str) -> Estimator:
    """Return the estimator with the process noise of a group of joints a step weaker."""
    return _changed(estimator, group, 1 / NOISE_FACTOR)


def _changed(estimator: Estimator, group: str, factor: float) -> Estimator:
    noise = dict(estimator.noise)
    noise[group] *= factor
    return estimator.with_noise(noise)
