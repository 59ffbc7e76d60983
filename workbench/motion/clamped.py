"""T's answer to the rotor while the foot is clamped: amplitude, frequency and phase.

The rotor pulls T along its own direction. T answers in multiples of the rotor's angle, and where
two motions are possible also at half its speed. A lightly damped robot rings for half a minute
after each change of speed; this free vibration is fitted beside the answer. The same estimator
serves track and twin, and each speed of a sweep.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.motion.damped_sinusoids import (
    LEAST_SAMPLES,
    DampedSinusoid,
    SinusoidFit,
    fit_sinusoids,
)
from workbench.motion.motion import ROTOR_ANGLE, TOP, position
from workbench.timeseries import TimeSeries

__all__ = [
    "ORDERS",
    "ClampedResponse",
    "answer",
    "factors",
    "lag",
    "steady_end",
    "summarize_clamped",
    "terms",
]

ORDERS = (0.5, 1.0, 2.0)
"""Multiples of the rotor's speed at which T's answer is estimated."""

_SETTLE_S = 1.0  # twenty time constants of a motor
_LEAST_END_S = 6.0  # separates sinusoids that differ by 1 rad/s from the rotor
_FREE_SINUSOIDS = 2  # modes below 20 Hz
_FADING = 0.1  # [1/s], where the search for a swing at an order begins
_LEAST_TURNED = 2  # samples of a speed
_FIRST = ORDERS.index(1.0)


@dataclass(frozen=True)
class ClampedResponse:
    """What a clamped robot did at the last speed of a run; NaN where too little is seen.

    Args:
        amplitude_m: of T, forward, at the rotor's speed.
        swing_hz: of T's strongest answer: the rotor's, half or twice of it.
        phase_rad: by which T follows the rotor's pull forward, -pi to pi: near zero far below a
            resonance, pi/2 on it, near pi far above it.
        speed_rad_s: mean rotor speed meanwhile.
    """

    amplitude_m: float
    swing_hz: float
    phase_rad: float
    speed_rad_s: float

    def as_json(self) -> dict[str, float]:
        """Return the numbers under their names."""
        return asdict(self)


def summarize_clamped(motion: TimeSeries, duration: float) -> ClampedResponse:
    """Return amplitude, frequency and phase of T in a motion whose time zero is the first motion.

    Args:
        motion: channels of `workbench.motion`.
        duration: end of the drive [s].
    """
    t = motion.times
    window = (t >= steady_end(0.0, duration)) & (t <= duration)
    phi = np.where(motion.validity(ROTOR_ANGLE), motion[ROTOR_ANGLE], np.nan)[window]
    top = position(motion, TOP)[window][:, [0, 2]]
    turned = np.isfinite(phi)
    if np.count_nonzero(turned) < _LEAST_TURNED:
        return ClampedResponse(np.nan, np.nan, np.nan, np.nan)
    speed = float(np.polyfit(t[window][turned], phi[turned], 1)[0])
    if np.count_nonzero(turned & np.isfinite(top).all(axis=1)) < LEAST_SAMPLES:
        return ClampedResponse(np.nan, np.nan, np.nan, speed)
    found = factors(answer(t[window], top, phi, abs(speed)))[0]
    strongest = int(np.abs(found).max(axis=0).argmax())
    return ClampedResponse(
        amplitude_m=float(np.abs(found[0, _FIRST])),
        swing_hz=ORDERS[strongest] * abs(speed) / (2 * np.pi),
        phase_rad=float(lag(found)[0]),
        speed_rad_s=speed,
    )


def steady_end(start: float, stop: float) -> float:
    """Return where the steady end of one speed, held from `start` to `stop` [s], begins."""
    return max(start + _SETTLE_S, min(stop - _LEAST_END_S, (start + stop) / 2))


def terms(phi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return cosine and sine of each order of the rotor's angle, (n, 2 orders) [1].

    Args:
        phi: (n,) unwrapped angle of the rotor [rad], NaN where not seen.
    """
    sense = 1.0 if np.nanmedian(np.diff(phi)) >= 0 else -1.0
    columns = []
    for order in ORDERS:
        columns += [np.cos(order * phi), sense * np.sin(order * phi)]
    return np.column_stack(columns)


def answer(
    times: NDArray[np.float64], top: NDArray[np.float64], phi: NDArray[np.float64], speed: float
) -> SinusoidFit:
    """Return the fit of the orders with the robot's free vibration beside them.

    A sinusoid that the window cannot separate from an order is searched, then left to the answer,
    whose change shows it: a large answer bends the beam, so that nothing linear takes it off.

    Args:
        times: (n,) nearly evenly spaced [s].
        top: (n, 2) of T along x and z [m], NaN where not seen.
        phi: (n,) unwrapped angle of the rotor [rad], NaN where not seen.
        speed: of the rotor, positive [rad/s].
    """
    beside = terms(phi)
    near = [DampedSinusoid(order * speed / (2 * np.pi), _FADING) for order in ORDERS]
    tried = [
        fit_sinusoids(times, top, _FREE_SINUSOIDS, beside=beside, start=start)
        for start in ([], *([sinusoid] for sinusoid in near))
    ]
    found = min(tried, key=lambda one: float(np.nansum(one.residual**2)))
    length = times[-1] - times[0]
    free = [
        one for one in found.sinusoids if all(abs(one.hz - other.hz) * length > 1 for other in near)
    ]
    if len(free) == len(found.sinusoids):
        return found
    return fit_sinusoids(times, top, len(free), beside=beside, start=free)


def factors(found: SinusoidFit) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Return the complex answer along x and z and its errors, (2, orders) each [m]."""
    pairs = found.beside[1:].T.reshape(2, len(ORDERS), 2)
    variances = np.array([np.diag(c)[1:] for c in found.beside_covariance])
    error = np.sqrt(variances.reshape(2, len(ORDERS), 2).mean(axis=2))
    return pairs[..., 0] - 1j * pairs[..., 1], error


def lag(found: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return by how much T follows the rotor's pull along x and z, (2,) [rad] in -pi to pi.

    Args:
        found: (2, orders) complex answer along x and z [m], of `factors`.
    """
    pull = np.array([1.0, 1j])  # along x cos(angle), along z -sin(angle)
    return -np.angle(found[:, _FIRST] / pull)
