"""One oscillator fitted to complex answers beside a resonance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Oscillator", "fit_oscillator"]

_ROUNDS = 8
_DRAWS = 100
_SEED = 0  # the same data give the same error


class Oscillator(NamedTuple):
    """An oscillator that an unbalance drives: a (w0^2 - w^2 + 2 i zeta w0 w) = c w^2.

    Args:
        speed: of the greatest answer, w0 / sqrt(1 - 2 zeta^2) [rad/s].
        speed_error: standard error of it [rad/s].
        damping_ratio: zeta.
        miss: greatest distance of an answer from the oscillator's, as a share of the answer.
    """

    speed: float
    speed_error: float
    damping_ratio: float
    miss: float


def fit_oscillator(
    speeds: NDArray[np.float64], answers: NDArray[np.complex128], errors: NDArray[np.float64]
) -> Oscillator | None:
    """Fit one oscillator, common to both axes, and a complex strength for each axis.

    The equation above is linear in w0^2, 2 zeta w0 and c; its rows are weighted by that of the
    round before, so that errors of the answer count and not those of the equation (Sanathanan and
    Koerner 1963). The error comes from redrawn answers, and is widened where the misfit is greater
    than the errors explain.

    Args:
        speeds: (n,) of the rotor [rad/s], 3 or more.
        answers: (n, axes) complex [m].
        errors: (n, axes) of real and imaginary part [m].

    Returns:
        The oscillator, or None where none fits: no stiffness, or a negative damping.
    """
    errors = np.maximum(errors, 1e-9 * np.abs(answers).max())
    found = _solved(speeds, answers, errors)
    if found is None:
        return None
    rng = np.random.default_rng(_SEED)
    drawn = []
    for _ in range(_DRAWS):
        noise = rng.standard_normal((2, *answers.shape)) * errors
        again = _solved(speeds, answers + noise[0] + 1j * noise[1], errors)
        if again is not None:
            drawn.append(_peak(again.coefficients))
    if len(drawn) < _DRAWS / 2:
        return None
    low, high = np.percentile(drawn, [16, 84])
    error = float(high - low) / 2 * float(np.sqrt(max(1.0, found.misfit)))
    square, rate = found.coefficients
    ratio = rate / (2 * float(np.sqrt(square)))
    return Oscillator(_peak(found.coefficients), error, ratio, found.miss)


class _Solution(NamedTuple):
    """w0^2 and 2 zeta w0, chi^2 per degree of freedom, and the greatest relative miss."""

    coefficients: tuple[float, float]
    misfit: float
    miss: float


def _peak(coefficients: tuple[float, float]) -> float:
    square, rate = coefficients
    ratio = rate / (2 * np.sqrt(square))
    return float(np.sqrt(square / max(1 - 2 * ratio**2, 0.1)))


def _solved(
    w: NDArray[np.float64], answers: NDArray[np.complex128], errors: NDArray[np.float64]
) -> _Solution | None:
    """Return the weighted solution; None where it is no oscillator."""
    count, axes = answers.shape
    rows = np.zeros((axes, count, 2 + 2 * axes), dtype=complex)
    for axis in range(axes):
        rows[axis, :, 0] = answers[:, axis]
        rows[axis, :, 1] = 1j * w * answers[:, axis]
        rows[axis, :, 2 + 2 * axis] = -(w**2)
        rows[axis, :, 3 + 2 * axis] = -1j * w**2
    wanted = (answers * w[:, None] ** 2).T
    weight = 1 / errors.T
    residual = np.zeros(0)
    solution = np.zeros(2 + 2 * axes)
    for _ in range(_ROUNDS):
        a, b = rows * weight[..., None], wanted * weight
        flat = a.reshape(-1, a.shape[-1])
        stacked, target = np.vstack([flat.real, flat.imag]), np.concatenate([b.real, b.imag], None)
        solution = np.linalg.lstsq(stacked, target)[0]
        residual = stacked @ solution - target
        denominator = solution[0] - w**2 + 1j * solution[1] * w
        weight = 1 / (errors.T * np.maximum(np.abs(denominator), 1e-9))
    free = residual.size - len(solution)
    if not (solution[0] > 0 and solution[1] > 0 and free > 0):
        return None
    denominator = solution[0] - w**2 + 1j * solution[1] * w
    predicted = np.outer(w**2 / denominator, solution[2::2] + 1j * solution[3::2])
    miss = np.linalg.norm(predicted - answers, axis=1) / np.linalg.norm(answers, axis=1)
    misfit = float(residual @ residual) / free
    return _Solution((float(solution[0]), float(solution[1])), misfit, float(miss.max()))
