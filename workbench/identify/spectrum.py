"""The spectrum of T's motion and its lines, as section 4.2 of the thesis looks for resonances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.motion import TOP, position

__all__ = ["Oscillation", "SpectralLine", "Spectrum", "oscillation", "spectrum"]

Oscillation = Literal["torsional", "longitudinal"]
"""The thesis' names of the two: T sways forward, or bounces upward."""

_SETTLE_S = 1.0
_LEAST_S = 2.0
_LOWEST_HZ, _HIGHEST_HZ = 0.5, 20.0
_PADDING = 8  # samples of the spectrum between two of its own bins
_LEAST_SHARE = 0.03  # of the strongest line
_LEAST_OVER_NOISE = 6.0
_MOST_LINES = 6
_LOBE_BINS = 2.0  # half the width of a line through a Hann window
_RAYLEIGH_MEDIAN = float(np.sqrt(np.log(2)))  # of noise in a bin, over its root mean square
_HANN_LOSS = 1.53  # of a line's frequency, against no window: var = 2.34 times that of the bound


@dataclass(frozen=True)
class SpectralLine:
    """A line of a spectrum.

    Args:
        hz: its frequency, placed between the bins.
        hz_error: standard error from the noise beside it [Hz]; what fades or bends is not in it.
        amplitude: of T along x and z [m].
        order: multiple of the rotor's speed that it is, or None where the robot rings by itself.
        overtone: whether it is twice a stronger line, as a beam that bends far answers.
    """

    hz: float
    hz_error: float
    amplitude: tuple[float, float]
    order: float | None
    overtone: bool = False

    @property
    def rad_s(self) -> float:
        """Return the angular frequency [rad/s]."""
        return 2 * np.pi * self.hz

    @property
    def name(self) -> str:
        """Return what it is: of the rotor, an overtone, or an oscillation of the robot."""
        if self.order is not None:
            return "rotor" if self.order == 1 else f"{self.order:g} x rotor"
        return "overtone" if self.overtone else self.oscillation

    @property
    def oscillation(self) -> Oscillation:
        """Return the name of the oscillation by the direction of T's motion."""
        return oscillation(*self.amplitude)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Amplitude of T's motion over frequency.

    Args:
        run: of which it is.
        hz: (n,) frequencies [Hz].
        amplitude: (n, 2) of T along x and z [m]; a sine reaches its own amplitude.
        speed: of the rotor, zero where nothing drove the robot [rad/s].
        lines: the strongest first.
    """

    run: str
    hz: NDArray[np.float64]
    amplitude: NDArray[np.float64]
    speed: float
    lines: tuple[SpectralLine, ...]


def oscillation(x: float, z: float) -> Oscillation:
    """Name an oscillation by T's amplitudes along x and z."""
    return "torsional" if abs(x) >= abs(z) else "longitudinal"


def spectrum(run: MeasuredRun) -> Spectrum:
    """Return the spectrum of T's motion while the robot is driven, or after its release.

    A straight line is taken off, a Hann window keeps leakage local, padding and a parabola through
    the logarithms place each line between the bins. Short gaps are bridged by straight lines.

    Raises:
        InputError: when less than two seconds are left, or T is not seen.
    """
    motion = run.motion.between(_SETTLE_S if run.driven else 0.0, np.inf)
    path = position(motion, TOP)[:, [0, 2]]
    seen = np.isfinite(path).all(axis=1)
    duration = float(np.ptp(motion.times[seen])) if seen.any() else 0.0
    if duration < _LEAST_S or np.mean(seen) < 0.5:
        raise InputError(
            f"{run.name}: T is seen for {duration:.1f} s and {100 * np.mean(seen):.0f} % of it; "
            f"a spectrum needs {_LEAST_S:g} s and half of the samples"
        )
    times = np.linspace(motion.times[seen][0], motion.times[seen][-1], np.ptp(np.flatnonzero(seen)))
    even = np.column_stack([np.interp(times, motion.times[seen], p) for p in path[seen].T])
    line = np.column_stack([np.ones_like(times), times])
    even -= line @ np.linalg.lstsq(line, even)[0]
    window = np.hanning(len(times))
    count = _PADDING * len(times)
    hz = np.fft.rfftfreq(count, times[1] - times[0])
    amplitude = 2 / window.sum() * np.abs(np.fft.rfft(even * window[:, None], count, axis=0))
    keep = hz <= _HIGHEST_HZ
    speed = next((s for _, s in reversed(run.steps) if s), 0.0)
    lines = _lines(hz[keep], amplitude[keep], duration, abs(speed))
    return Spectrum(run.name, hz[keep], amplitude[keep], speed, lines)


def _lines(
    hz: NDArray[np.float64], amplitude: NDArray[np.float64], duration: float, speed: float
) -> tuple[SpectralLine, ...]:
    total = np.hypot(*amplitude.T)
    noise = _noise(total)
    least = max(_LEAST_SHARE * total[hz >= _LOWEST_HZ].max(), _LEAST_OVER_NOISE * noise)
    apart = round(_PADDING * _LOBE_BINS)
    peaks, _ = scipy.signal.find_peaks(total, height=least, distance=apart, prominence=0.3 * least)
    peaks = [k for k in peaks if hz[k] >= _LOWEST_HZ]
    peaks = sorted(peaks, key=lambda k: -total[k])[:_MOST_LINES]
    found: list[SpectralLine] = []
    for k in peaks:
        low, mid, high = np.log(total[k - 1 : k + 2])
        shift = 0.5 * (low - high) / (low - 2 * mid + high)
        at = float(hz[k] + shift * (hz[1] - hz[0]))
        error = _HANN_LOSS * noise / (np.pi * total[k] * duration)
        along = float(amplitude[k, 0]), float(amplitude[k, 1])
        order = _order(at, speed, _LOBE_BINS / duration)
        doubled = any(abs(at - 2 * line.hz) < _LOBE_BINS / duration / 2 for line in found)
        found.append(SpectralLine(at, error, along, order, overtone=order is None and doubled))
    return tuple(found)


def _noise(total: NDArray[np.float64]) -> float:
    """Return the root mean square of noise in a bin; lines are few, the median does not see them.

    Both axes add up in `total`, but a line has its own share of each: half the power counts.
    """
    return float(np.median(total)) / _RAYLEIGH_MEDIAN / np.sqrt(2)


def _order(hz: float, speed: float, within: float) -> float | None:
    """Return the multiple or half multiple of the rotor's speed that a line is."""
    if speed == 0:
        return None
    orders: Sequence[float] = (0.5, 1.0, 1.5, 2.0, 3.0)
    nearest = min(orders, key=lambda order: abs(hz - order * speed / (2 * np.pi)))
    return nearest if abs(hz - nearest * speed / (2 * np.pi)) <= within / 2 else None
