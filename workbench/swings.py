"""Fading swings: their frequencies, decays and amplitudes, fitted to paths, with errors.

One estimator for ring-downs of measured and simulated robots, for damping against amplitude, and
for the swings of its own that a driven robot has not lost yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

__all__ = ["LEAST_SAMPLES", "Pole", "Swings", "fit_swings"]

LEAST_SAMPLES = 60
"""Fewer seen samples tell no swing."""

_LOWEST_HZ = 0.5
_HIGHEST_HZ = 12.0
_PADDING = 8  # the spectrum is sampled so much finer than the record's own lines
_FASTEST_DECAY = 10.0  # [1/s]
_FIRST_DECAY = 0.1  # [1/s]
_BLOCKS = 10  # in time, over which what is left may hang together


class Pole(NamedTuple):
    """How a swing goes: exp(-decay t) cos(2 pi hz t).

    Args:
        hz: damped frequency.
        decay: rate at which it fades [1/s].
    """

    hz: float
    decay: float

    @property
    def damping_ratio(self) -> float:
        """Return the ratio to the critical damping, as if it were viscous."""
        return self.decay / float(np.hypot(2 * np.pi * self.hz, self.decay))


@dataclass(frozen=True, eq=False)
class Swings:
    """Swings that share their poles over c paths; t counts from the first seen sample.

    Args:
        poles: m of them.
        pole_errors: standard errors of each pole's frequency [Hz] and decay [1/s].
        amplitudes: (m, c) complex [m]; the swing is Re(amplitude exp((2 pi i hz - decay) t)).
        beside: (k, c) factors of the columns beside the swings [m]; the first is the centre.
        beside_covariance: (c, k, k) of those factors [m^2].
        left: (n, c) what the fit leaves [m], NaN where not seen.
    """

    poles: tuple[Pole, ...]
    pole_errors: tuple[Pole, ...]
    amplitudes: NDArray[np.complex128]
    beside: NDArray[np.float64]
    beside_covariance: NDArray[np.float64]
    left: NDArray[np.float64]


def fit_swings(
    times: NDArray[np.float64],
    paths: NDArray[np.float64],
    count: int,
    *,
    beside: NDArray[np.float64] | None = None,
    start: Sequence[Pole] = (),
) -> Swings:
    """Fit fading swings and a centre to paths, all at once.

    Frequencies and decays are searched, amplitudes and centre are linear and found for each trial
    (variable projection). Frequencies start at the highest lines of what is left, one after the
    other, between 0.5 and 12 Hz. Standard errors allow for residuals that hang together over a
    tenth of the record.

    Args:
        times: (n,) increasing, nearly evenly spaced [s].
        paths: (n, c) [m], NaN where not seen; a sample counts where all paths were seen.
        count: of the swings; with 0 only the centre and the columns beside are fitted.
        beside: (n, k - 1) further columns [1] that the paths are linear in, as those of a drive.
        start: poles that are known about; the rest is searched.

    Raises:
        ValueError: fewer than `LEAST_SAMPLES` samples were seen.
    """
    columns = np.ones((len(times), 1)) if beside is None else np.insert(beside, 0, 1.0, axis=1)
    seen = np.asarray(np.isfinite(np.hstack([paths, columns])).all(axis=1))
    if np.count_nonzero(seen) < LEAST_SAMPLES:
        raise ValueError(f"{np.count_nonzero(seen)} samples show no swing; {LEAST_SAMPLES} do")
    record = _Record(times[seen] - times[seen][0], paths[seen], columns[seen])
    poles = list(start[:count])
    if poles:
        poles = record.fitted(poles)
    while len(poles) < count:
        poles = record.fitted([*poles, record.highest_line(poles)])
    return record.judged(poles, seen)


@dataclass(frozen=True, eq=False)
class _Record:
    """What was seen: times (n,), paths (n, c), columns beside the swings (n, k)."""

    t: NDArray[np.float64]
    paths: NDArray[np.float64]
    columns: NDArray[np.float64]

    def terms(self, poles: Sequence[Pole]) -> NDArray[np.float64]:
        """Return the columns beside, then each swing's cosine and sine, (n, k + 2 m)."""
        swings = []
        for hz, decay in poles:
            fading, phase = np.exp(-decay * self.t), 2 * np.pi * hz * self.t
            swings += [fading * np.cos(phase), fading * np.sin(phase)]
        return np.column_stack([self.columns, *swings])

    def linear(self, poles: Sequence[Pole]) -> NDArray[np.float64]:
        """Return the best factors of the terms, (k + 2 m, c)."""
        return np.asarray(np.linalg.lstsq(self.terms(poles), self.paths)[0], dtype=np.float64)

    def left(self, poles: Sequence[Pole]) -> NDArray[np.float64]:
        """Return what the swings leave, (n, c)."""
        return self.paths - self.terms(poles) @ self.linear(poles)

    def fitted(self, start: Sequence[Pole]) -> list[Pole]:
        """Return the poles that leave least."""
        low, high = [_LOWEST_HZ, 0.0] * len(start), [_HIGHEST_HZ, _FASTEST_DECAY] * len(start)
        begin = np.clip(np.ravel(start), np.array(low) + 1e-6, np.array(high) - 1e-6)
        found = scipy.optimize.least_squares(
            lambda p: self.left(_poles(p)).ravel(), begin, bounds=(low, high), x_scale=0.1
        )
        return _poles(found.x)

    def highest_line(self, poles: Sequence[Pole]) -> Pole:
        """Return the strongest line of what the poles leave."""
        even = np.linspace(self.t[0], self.t[-1], len(self.t))
        rest = self.left(poles)
        count = _PADDING * len(even)
        hz = np.fft.rfftfreq(count, even[1] - even[0])
        allowed = (hz >= _LOWEST_HZ) & (hz <= _HIGHEST_HZ)
        power = np.zeros(np.count_nonzero(allowed))
        for path in rest.T:
            windowed = np.interp(even, self.t, path) * np.hanning(len(even))
            power += np.abs(np.fft.rfft(windowed, count)[allowed]) ** 2
        return Pole(float(hz[allowed][np.argmax(power)]), _FIRST_DECAY)

    def judged(self, poles: Sequence[Pole], seen: NDArray[np.bool_]) -> Swings:
        """Return the fit with its errors."""
        poles = sorted(poles)
        linear, rest = self.linear(poles), self.left(poles)
        k, m, c = self.columns.shape[1], len(poles), self.paths.shape[1]
        pairs = linear[k:].reshape(m, 2, c)
        amplitudes = pairs[:, 0] - 1j * pairs[:, 1]
        covariance = self._covariance(poles, amplitudes, rest)
        errors = np.sqrt(np.diag(covariance)[: 2 * m])
        first = [2 * m + (k + 2 * m) * path for path in range(c)]
        left = np.full((len(seen), c), np.nan)
        left[seen] = rest
        return Swings(
            poles=tuple(poles),
            pole_errors=tuple(_poles(errors)),
            amplitudes=amplitudes,
            beside=linear[:k],
            beside_covariance=np.array([covariance[i : i + k, i : i + k] for i in first]),
            left=left,
        )

    def _covariance(
        self, poles: Sequence[Pole], amplitudes: NDArray[np.complex128], rest: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the covariance of poles, then of each path's factors; blocks in time count once.

        The sandwich of clustered data (Liang and Zeger 1986), or that of white noise where it is
        greater.
        """
        terms, count = self.terms(poles), self.paths.shape[1]
        slopes = []
        for path in range(count):
            own = [np.zeros_like(terms)] * count
            own[path] = terms
            slopes.append(np.hstack([self._pole_slopes(poles, amplitudes[:, path]), *own]))
        jacobian = np.stack(slopes, axis=1)  # (n, c, u)
        inverse = np.linalg.pinv(np.einsum("ncu,ncv->uv", jacobian, jacobian), hermitian=True)
        free = max(rest.size - len(inverse), 1)
        white = inverse * float(np.sum(rest**2)) / free
        block = np.minimum((_BLOCKS * self.t / self.t[-1]).astype(int), _BLOCKS - 1)
        pulls = np.einsum("ncu,nc->nu", jacobian, rest)
        sums = np.array([pulls[block == b].sum(axis=0) for b in range(_BLOCKS)])
        clustered = inverse @ (sums.T @ sums) @ inverse * _BLOCKS / (_BLOCKS - 1)
        ratio = np.diag(clustered) / np.maximum(np.diag(white), np.finfo(float).tiny)
        widen = np.sqrt(np.maximum(ratio, 1.0))
        return white * np.outer(widen, widen)

    def _pole_slopes(
        self, poles: Sequence[Pole], amplitudes: NDArray[np.complex128]
    ) -> NDArray[np.float64]:
        """Return the derivatives of one path by each frequency and decay, (n, 2 m)."""
        columns: list[NDArray[np.float64]] = []
        for (hz, decay), amplitude in zip(poles, amplitudes, strict=True):
            swing = self.t * amplitude * np.exp((2j * np.pi * hz - decay) * self.t)
            columns += [-2 * np.pi * swing.imag, -swing.real]
        return np.column_stack([np.empty((len(self.t), 0)), *columns])


def _poles(parameters: NDArray[np.float64]) -> list[Pole]:
    return [Pole(float(hz), float(decay)) for hz, decay in parameters.reshape(-1, 2)]
