"""What speaks against the data or the observer, run by run: said before any parameter is believed.

The rate of the cameras, channels that were not seen for long, a robot that the model cannot follow
however it is corrected, a run that is unlike the others, and a motor's clock against the cameras'.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from workbench.fit.drive import fit_drive
from workbench.fit.fitting import Fit
from workbench.fit.observer import Innovations

__all__ = ["LOST", "clock_words", "gap_words", "lost_words", "rate_words", "warnings_of"]

Array = NDArray[np.float64]

LOST = 6.0
"""Innovations over what noise and process noise allow, over half a second, of a lost observer."""
_LOST_S, _GAP_S = 0.5, 0.5
_RATE = 0.02  # share by which the cameras' rate may differ from the simulation's samples
_SLOW = 3e-4  # share of the speed: ten times what ten seconds of turns show
_SURE = 4.0


def warnings_of(fit: Fit) -> list[str]:
    """Return what speaks against a fit's data or its observer, run by run."""
    system, found = fit.estimator.system, []
    for k, (name, one) in enumerate(zip(system.names, fit.innovations, strict=True)):
        found += gap_words(name, system.channels_of(k), system.seen(k), system.sample_s)
        found += lost_words(name, one, system.sample_s)
        found += system.drive_words(k)
    return found


def rate_words(name: str, times: Array, sample_s: float) -> list[str]:
    """Return what is wrong with the rate of a run's samples.

    Args:
        name: of the run.
        times: (n,) of the samples [s].
        sample_s: what the observer needs.
    """
    step = float(np.median(np.diff(times)))
    if abs(step / sample_s - 1) < _RATE:
        return []
    return [
        f"{name}: the cameras took {1 / step:.4g} samples a second, the observer needs "
        f"{1 / sample_s:.4g}; record at that rate, or resample the take"
    ]


def gap_words(name: str, channels: Sequence[str], seen: Array, sample_s: float) -> list[str]:
    """Return which channels were not seen for longer than 0.5 s.

    Args:
        name: of the run.
        channels: c names.
        seen: (n, c), NaN where not seen [unit of the channel].
        sample_s: from one sample to the next.
    """
    found = []
    for channel, values in zip(channels, seen.T, strict=True):
        away = np.diff(np.concatenate([[0], np.isnan(values).astype(int), [0]]))
        begins, ends = np.flatnonzero(away == 1), np.flatnonzero(away == -1)
        if len(begins) and (longest := int((ends - begins).argmax())) >= 0:
            seconds = float(ends[longest] - begins[longest]) * sample_s
            if seconds > _GAP_S:
                found.append(
                    f"{name}: {channel} was not seen for {seconds:.2g} s from sample "
                    f"{begins[longest]}; the observer predicts there and is not corrected by it"
                )
    return found


def lost_words(name: str, one: Innovations, sample_s: float) -> list[str]:
    """Return from when on the observer lost the robot, if it did."""
    white = one.white.copy()
    white[one.sane :] = np.inf
    squares = np.where(np.isfinite(one.error) | np.isinf(white), white**2, 0.0).mean(axis=1)
    window = max(1, round(_LOST_S / sample_s))
    rolling = np.array([squares[k : k + window].mean() for k in range(len(squares) - window + 1)])
    wrong = np.flatnonzero(rolling > LOST**2)
    if not len(wrong):
        return []
    size = float(np.sqrt(min(rolling.max(), 1e12)))
    return [
        f"{name}: the observer lost the robot {wrong[0] * sample_s:.2f} s after its first sample; "
        f"the model misses what was seen by up to {size:.3g} times what noise and process noise "
        "allow. Is it a run of this robot, in this mode?"
    ]


def clock_words(
    name: str, times: Array, angle: Array, steps: Sequence[tuple[float, float]], sigma: float
) -> list[str]:
    """Return by how much the rotor turned faster than commanded, where that is beyond doubt.

    Args:
        name: of the run.
        times: (n,) [s].
        angle: (n,) of the rotor against T [rad].
        steps: (time [s], commanded speed [rad/s]).
        sigma: standard deviation of the angle's noise [rad].
    """
    fit = fit_drive(times, angle, steps, sigma)
    off, error = fit.gain - 1, float(fit.deviation[0])
    if abs(off) < max(_SLOW, _SURE * error):
        return []
    return [
        f"{name}: the rotor turned {100 * off:+.2f} % against its command "
        f"(\N{PLUS-MINUS SIGN} {100 * error:.2g} %): the motor's speed, or one of the two clocks"
    ]
