"""Damped sinusoids: their frequencies, decays and amplitudes, fitted to paths, with errors.

One estimator for ring-downs of measured and simulated robots, for damping against amplitude, and
for the free vibration that a driven robot has not lost yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

__all__ = ["LEAST_SAMPLES", "DampedSinusoid", "SinusoidFit", "fit_sinusoids"]

LEAST_SAMPLES = 60
"""Fewer seen samples determine no sinusoid."""

_LOWEST_HZ = 0.5
_HIGHEST_HZ = 12.0
_PADDING = 8  # the spectrum is sampled so much finer than the record's own lines
_FASTEST_DECAY = 10.0  # [1/s]
_FIRST_DECAY = 0.1  # [1/s]
_BLOCKS = 10  # in time, over which the residual may be correlated


class DampedSinusoid(NamedTuple):
    """A damped sinusoid: exp(-decay t) cos(2 pi hz t).

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
class SinusoidFit:
    """Damped sinusoids that share frequency and decay over c paths; t is 0 at the first sample.

    Args:
        sinusoids: m of them.
        sinusoid_errors: standard errors of each one's frequency [Hz] and decay [1/s].
        amplitudes: (m, c) complex [m]; the sinusoid is Re(amplitude exp((2 pi i hz - decay) t)).
        beside: (k, c) factors of the columns beside the sinusoids [m]; the first is the centre.
        beside_covariance: (c, k, k) of those factors [m^2].
        residual: (n, c) residual of the fit [m], NaN where not seen.
    """

    sinusoids: tuple[DampedSinusoid, ...]
    sinusoid_errors: tuple[DampedSinusoid, ...]
    amplitudes: NDArray[np.complex128]
    beside: NDArray[np.float64]
    beside_covariance: NDArray[np.float64]
    residual: NDArray[np.float64]


def fit_sinusoids(
    times: NDArray[np.float64],
    paths: NDArray[np.float64],
    count: int,
    *,
    beside: NDArray[np.float64] | None = None,
    start: Sequence[DampedSinusoid] = (),
) -> SinusoidFit:
    """Fit damped sinusoids and a centre to paths, all at once.

    Frequencies and decays are searched, amplitudes and centre are linear and found for each trial
    (variable projection). Frequencies start at the highest lines of the residual, one after the
    other, between 0.5 and 12 Hz. Standard errors allow for residuals that are correlated over a
    tenth of the record.

    Args:
        times: (n,) increasing, nearly evenly spaced [s].
        paths: (n, c) [m], NaN where not seen; a sample counts where all paths were seen.
        count: of the sinusoids; with 0 only the centre and the columns beside are fitted.
        beside: (n, k - 1) further columns [1] that the paths are linear in, as those of a drive.
        start: sinusoids that are known about; the rest is searched.

    Raises:
        ValueError: fewer than `LEAST_SAMPLES` samples were seen.
    """
    columns = np.ones((len(times), 1)) if beside is None else np.insert(beside, 0, 1.0, axis=1)
    seen = np.asarray(np.isfinite(np.hstack([paths, columns])).all(axis=1))
    if np.count_nonzero(seen) < LEAST_SAMPLES:
        raise ValueError(
            f"{np.count_nonzero(seen)} samples determine no sinusoid; {LEAST_SAMPLES} do"
        )
    record = _Record(times[seen] - times[seen][0], paths[seen], columns[seen])
    sinusoids = list(start[:count])
    if sinusoids:
        sinusoids = record.fitted(sinusoids)
    while len(sinusoids) < count:
        sinusoids = record.fitted([*sinusoids, record.highest_line(sinusoids)])
    return record.judged(sinusoids, seen)


@dataclass(frozen=True, eq=False)
class _Record:
    """What was seen: times (n,), paths (n, c), columns beside the sinusoids (n, k)."""

    t: NDArray[np.float64]
    paths: NDArray[np.float64]
    columns: NDArray[np.float64]

    def terms(self, sinusoids: Sequence[DampedSinusoid]) -> NDArray[np.float64]:
        """Return the columns beside, then each sinusoid's cosine and sine, (n, k + 2 m)."""
        columns = []
        for hz, decay in sinusoids:
            fading, phase = np.exp(-decay * self.t), 2 * np.pi * hz * self.t
            columns += [fading * np.cos(phase), fading * np.sin(phase)]
        return np.column_stack([self.columns, *columns])

    def linear(self, sinusoids: Sequence[DampedSinusoid]) -> NDArray[np.float64]:
        """Return the best factors of the terms, (k + 2 m, c)."""
        return np.asarray(np.linalg.lstsq(self.terms(sinusoids), self.paths)[0], dtype=np.float64)

    def residual(self, sinusoids: Sequence[DampedSinusoid]) -> NDArray[np.float64]:
        """Return what the sinusoids do not explain, (n, c)."""
        return self.paths - self.terms(sinusoids) @ self.linear(sinusoids)

    def fitted(self, start: Sequence[DampedSinusoid]) -> list[DampedSinusoid]:
        """Return the sinusoids with the least residual."""
        low, high = [_LOWEST_HZ, 0.0] * len(start), [_HIGHEST_HZ, _FASTEST_DECAY] * len(start)
        begin = np.clip(np.ravel(start), np.array(low) + 1e-6, np.array(high) - 1e-6)
        found = scipy.optimize.least_squares(
            lambda p: self.residual(_sinusoids(p)).ravel(), begin, bounds=(low, high), x_scale=0.1
        )
        return _sinusoids(found.x)

    def highest_line(self, sinusoids: Sequence[DampedSinusoid]) -> DampedSinusoid:
        """Return the strongest line of the residual."""
        even = np.linspace(self.t[0], self.t[-1], len(self.t))
        rest = self.residual(sinusoids)
        count = _PADDING * len(even)
        hz = np.fft.rfftfreq(count, even[1] - even[0])
        allowed = (hz >= _LOWEST_HZ) & (hz <= _HIGHEST_HZ)
        power = np.zeros(np.count_nonzero(allowed))
        for path in rest.T:
            windowed = np.interp(even, self.t, path) * np.hanning(len(even))
            power += np.abs(np.fft.rfft(windowed, count)[allowed]) ** 2
        return DampedSinusoid(float(hz[allowed][np.argmax(power)]), _FIRST_DECAY)

    def judged(self, sinusoids: Sequence[DampedSinusoid], seen: NDArray[np.bool_]) -> SinusoidFit:
        """Return the fit with its errors."""
        sinusoids = sorted(sinusoids)
        linear, rest = self.linear(sinusoids), self.residual(sinusoids)
        k, m, c = self.columns.shape[1], len(sinusoids), self.paths.shape[1]
        pairs = linear[k:].reshape(m, 2, c)
        amplitudes = pairs[:, 0] - 1j * pairs[:, 1]
        covariance = self._covariance(sinusoids, amplitudes, rest)
        errors = np.sqrt(np.diag(covariance)[: 2 * m])
        first = [2 * m + (k + 2 * m) * path for path in range(c)]
        residual = np.full((len(seen), c), np.nan)
        residual[seen] = rest
        return SinusoidFit(
            sinusoids=tuple(sinusoids),
            sinusoid_errors=tuple(_sinusoids(errors)),
            amplitudes=amplitudes,
            beside=linear[:k],
            beside_covariance=np.array([covariance[i : i + k, i : i + k] for i in first]),
            residual=residual,
        )

    def _covariance(
        self,
        sinusoids: Sequence[DampedSinusoid],
        amplitudes: NDArray[np.complex128],
        rest: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return the covariance of sinusoids, then of paths' factors; blocks in time count once.

        The sandwich of clustered data (Liang and Zeger 1986), or that of white noise where it is
        greater.
        """
        terms, count = self.terms(sinusoids), self.paths.shape[1]
        slopes = []
        for path in range(count):
            blocks = [np.zeros_like(terms)] * count
            blocks[path] = terms
            slopes.append(
                np.hstack([self._jacobian_of_one(sinusoids, amplitudes[:, path]), *blocks])
            )
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

    def _jacobian_of_one(
        self, sinusoids: Sequence[DampedSinusoid], amplitudes: NDArray[np.complex128]
    ) -> NDArray[np.float64]:
        """Return the derivatives of one path by each frequency and decay, (n, 2 m)."""
        columns: list[NDArray[np.float64]] = []
        for (hz, decay), amplitude in zip(sinusoids, amplitudes, strict=True):
            slope = self.t * amplitude * np.exp((2j * np.pi * hz - decay) * self.t)
            columns += [-2 * np.pi * slope.imag, -slope.real]
        return np.column_stack([np.empty((len(self.t), 0)), *columns])


def _sinusoids(parameters: NDArray[np.float64]) -> list[DampedSinusoid]:
    return [DampedSinusoid(float(hz), float(decay)) for hz, decay in parameters.reshape(-1, 2)]
