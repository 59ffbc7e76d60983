"""The shaft's speed from tracked motion whose truth is known, and the runs that tell none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.identify import shaft_speed
from workbench.motion import FOOT, PITCH, ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking import mean_speed

NOISE_M, ARM_M, RATE_HZ = 0.0003, 0.035, 120.0
Angle = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def run(angle: Angle, seed: int = 0, tilt: float = 0.0, mode: str = "clamped") -> MeasuredRun:
    """A run of 10 s at one voltage; T swings at the beam's own 1.7 Hz and tilts the motor."""
    rng = np.random.default_rng(seed)
    t = np.arange(-1, 10, 1 / RATE_HZ)
    swing = tilt * np.cos(2 * np.pi * 1.7 * t + seed) * np.exp(-np.maximum(t, 0) / 6)
    x = 0.2 * swing
    world = (
        angle(np.maximum(t, 0)) + swing + 0.3 * swing**2 + rng.normal(0, NOISE_M / ARM_M, len(t))
    )
    columns = {
        FOOT[0]: np.zeros_like(t),
        FOOT[2]: np.zeros_like(t),
        PITCH: np.zeros_like(t),
        TOP[0]: x + rng.normal(0, NOISE_M, len(t)),
        TOP[2]: 0.4 - x**2 + rng.normal(0, NOISE_M, len(t)),
        ROTOR_ANGLE: world,
    }
    steps = ((0.0, 10.0), (10.0, 0.0))
    return MeasuredRun("made", mode, TimeSeries.of(t, columns), steps)  # type: ignore[arg-type]


def test_the_speed_is_within_its_error_of_the_truth() -> None:
    pulls = []
    for seed in range(60):
        speed = 2.5 + 0.3 * seed
        found = shaft_speed(run(lambda t, s=speed: s * t + 0.1 * np.sin(s * t), seed, tilt=0.3))
        pulls.append((found.value - speed) / found.standard_error)
    assert np.mean(np.abs(pulls) < 1.833) == pytest.approx(0.9, abs=0.1)  # t of nine degrees


def test_the_tilt_of_the_tip_does_not_tilt_the_line() -> None:
    made = run(lambda t: 17 * t, tilt=0.5)
    part = made.motion.between(1.0, 9.8)
    plain = mean_speed(part.times, part[ROTOR_ANGLE])
    assert abs(plain.value - 17) > 0.002
    assert shaft_speed(made).value == pytest.approx(17, abs=0.0005)


def test_a_rotor_that_turns_backwards_has_a_negative_speed() -> None:
    assert shaft_speed(run(lambda t: -8 * t)).value == pytest.approx(-8, abs=0.001)


@pytest.mark.parametrize(
    ("angle", "why"),
    [
        (lambda t: 0 * t, r"turns 0\.0 times in the 8\.8 s that count; a speed needs 3 turns"),
        (lambda t: 1.5 * t, r"turns 2\.1 times .* Where it did not stall, drive it longer"),
        (
            lambda t: 12 * np.minimum(t, 6),
            r"stalls, or .*: from [567]\.\d s on it makes 0\.\d\d turns",
        ),
        (lambda t: 12 * t + 0.06 * t**2, r"not steady: it changes by \+\d\.\d %"),
        (
            lambda t: 17 * t + 2 * np.pi * (t > 5),
            r"not seen for 0\.0\d s at [45]\.\d s, and the turns counted across it are off by 1\.0",
        ),
    ],
    ids=["stands", "slow", "stalls", "drifts", "miscounted"],
)
def test_a_run_that_tells_no_speed_is_refused_with_the_reason(angle: Angle, why: str) -> None:
    with pytest.raises(InputError, match=why):
        shaft_speed(run(angle))


def test_a_run_without_a_drive_or_without_markers_is_refused() -> None:
    made = run(lambda t: 17 * t)
    with pytest.raises(InputError, match="mode decay has no drive"):
        shaft_speed(MeasuredRun("d", "decay", made.motion))
    hidden = made.motion.values.copy()
    hidden[made.motion.times > 1, 0] = np.nan
    motion = TimeSeries(made.motion.times, hidden, made.motion.names, np.isfinite(hidden))
    with pytest.raises(InputError, match=r"seen together in only 0 samples between 1 and 9\.8 s"):
        shaft_speed(MeasuredRun("h", "hop", motion, made.steps))
