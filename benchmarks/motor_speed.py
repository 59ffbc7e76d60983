"""The rotor's mean speed from a Fourier transform, as in the thesis and corrected."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError

__all__ = ["motor_speed_fft", "motor_speed_thesis"]

_CUT = 500
_LEAST = 16


def motor_speed_thesis(
    top_z: NDArray[np.float64], rotor_z: NDArray[np.float64], rate: float
) -> float:
    """Return the speed as Appendix C computes it [rad/s], for comparison only.

    Two faults are kept: the mean stays in, so that the constant height between T and rotor can
    win (the answer is then one bin); and bins count from 1, so that every answer is 2 pi rate / N
    too high. The last 500 samples are cut off.

    Args:
        top_z: (n,) height of T [m].
        rotor_z: (n,) height of the rotor [m].
        rate: [Hz].

    Raises:
        InputError: when too little is left after the cut.
    """
    height = (top_z - rotor_z)[:-_CUT]
    if len(height) < _LEAST:
        raise InputError(
            f"the thesis' motor speed cuts off the last {_CUT} samples; {len(top_z)} are too few"
        )
    strength = np.abs(np.fft.fft(height))[: len(height) // 2]
    return float((np.argmax(strength) + 1) / (len(height) / rate) * 2 * np.pi)


def motor_speed_fft(top_z: NDArray[np.float64], rotor_z: NDArray[np.float64], rate: float) -> float:
    """Return the strongest frequency of the height of T above the rotor [rad/s].

    The mean is removed, a Hann window keeps leakage local, and a parabola through the logarithms of
    the three highest bins interpolates the peak. The sign of the speed is unknown.

    Args:
        top_z: (n,) height of T [m], finite.
        rotor_z: (n,) height of the rotor [m], finite.
        rate: [Hz].

    Raises:
        InputError: fewer than 16 samples, or samples that are not finite.
    """
    height = top_z - rotor_z
    if len(height) < _LEAST or not np.isfinite(height).all():
        raise InputError(
            f"the motor speed needs at least {_LEAST} finite samples; "
            f"{np.count_nonzero(np.isfinite(height))} of {len(height)} are"
        )
    strength = np.abs(np.fft.rfft((height - height.mean()) * np.hanning(len(height))))
    peak = int(np.argmax(strength[1:-1])) + 1
    low, mid, high = np.log(strength[peak - 1 : peak + 2] + 1e-300)
    curve = low - 2 * mid + high
    offset = 0.5 * (low - high) / curve if curve < 0 else 0.0
    return float(2 * np.pi * (peak + offset) * rate / len(height))
