"""What a robot did after its release: how far it was let go from, how it rang, how that faded.

The same estimator serves track and twin, so that its errors cancel in the difference.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.errors import require_named
from workbench.motion.damped_sinusoids import LEAST_SAMPLES, fit_sinusoids
from workbench.motion.motion import FOOT, RELEASED, TOP, Mode, position, seen_median
from workbench.timeseries import TimeSeries

__all__ = ["Ring", "RingDown", "ring", "summarize_release"]

_LANDED_S = 0.5  # after the release of a drop the foot stands on the ground
_END_S = 0.5
_LEAST_AMPLITUDE_M = 2e-4  # below this, markers show noise


@dataclass(frozen=True)
class RingDown:
    """What a released robot did, in three numbers; NaN where it cannot be determined.

    Args:
        displacement_m: decay: how far forward of the centre of its swings T was held; drop: how far
            the foot fell, from the hand to its rest on the ground.
        ring_hz: frequency of the strongest swing of T, forward in decay, upward after a drop.
        damping_ratio: of that swing, as if its damping were viscous. The twin, pulled by 16 mm, has
            0.36 %; found are 0.36 % after 5 or 10 s, but 0.28 % after 2 s and nothing after 1 s.
    """

    displacement_m: float
    ring_hz: float
    damping_ratio: float

    def as_json(self) -> dict[str, float]:
        """Return the numbers under their names."""
        return asdict(self)


class Ring(NamedTuple):
    """A damped sinusoid: its frequency [Hz], damping ratio, and what it swings about [m]."""

    hz: float
    damping_ratio: float
    centre: float


def summarize_release(motion: TimeSeries, mode: Mode, duration: float) -> RingDown:
    """Return displacement, frequency and damping of a motion whose time zero is the release.

    Args:
        motion: channels of `workbench.motion`.
        mode: `decay` or `drop`.
        duration: how long it is looked at [s].

    Raises:
        InputError: when the mode is another one.
    """
    require_named("mode with a release", mode, RELEASED)
    t, top, foot = motion.times, position(motion, TOP), position(motion, FOOT)
    if mode == "decay":
        analysed = (t >= 0) & (t <= duration)
        found = ring(t[analysed], top[analysed, 0])
        return RingDown(seen_median(top[t < 0, 0]) - found.centre, found.hz, found.damping_ratio)
    analysed = (t >= _LANDED_S) & (t <= duration)
    found = ring(t[analysed], top[analysed, 2])
    ended = (t >= min(duration, t[-1]) - _END_S) & (t <= duration)
    fall = seen_median(foot[t < 0, 2]) - seen_median(foot[ended, 2])
    return RingDown(fall, found.hz, found.damping_ratio)


def ring(times: NDArray[np.float64], path: NDArray[np.float64]) -> Ring:
    """Return the strongest of two damped sinusoids fitted to a path; NaN where nothing rings.

    The robot has two modes below 20 Hz; fitted alone, the strong one would take the other's motion
    for damping.

    Args:
        times: (n,) evenly spaced [s].
        path: (n,) [m], NaN where not seen.
    """
    if np.count_nonzero(np.isfinite(path)) < LEAST_SAMPLES:
        return Ring(np.nan, np.nan, np.nan)
    found = fit_sinusoids(times, path[:, None], 2)
    strongest = int(np.argmax(np.abs(found.amplitudes[:, 0])))
    centre = float(found.beside[0, 0])
    if abs(found.amplitudes[strongest, 0]) < _LEAST_AMPLITUDE_M:
        return Ring(np.nan, np.nan, centre)
    sinusoid = found.sinusoids[strongest]
    return Ring(sinusoid.hz, sinusoid.damping_ratio, centre)
