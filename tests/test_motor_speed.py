from __future__ import annotations

import numpy as np
import pytest

from benchmarks.motor_speed import motor_speed_fft, motor_speed_thesis
from workbench.errors import InputError

RATE = 120.0


def heights(speed: float, n: int, mean: float) -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(n) / RATE
    return 0.3 + 0.0 * t, 0.3 - mean + 0.035 * np.sin(speed * t)


@pytest.mark.parametrize("speed", [16.2, 17.0, 18.33, 21.0])
def test_the_right_one_finds_the_speed_between_bins(speed: float) -> None:
    top, rotor = heights(speed, 1200, mean=0.01)
    assert motor_speed_fft(top, rotor, RATE) == pytest.approx(speed, abs=0.02)


def test_the_thesis_one_is_a_bin_too_high() -> None:
    n = 1200
    speed = 27 * 2 * np.pi * RATE / n  # on a bin
    top, rotor = heights(speed, n + 500, mean=0.0)
    one_bin = 2 * np.pi * RATE / n
    assert motor_speed_thesis(top, rotor, RATE) == pytest.approx(speed + one_bin)
    assert motor_speed_fft(top, rotor, RATE) == pytest.approx(speed, abs=0.02)


def test_in_the_thesis_one_a_constant_height_can_win() -> None:
    top, rotor = heights(17.0, 1700, mean=0.02)
    assert motor_speed_thesis(top, rotor, RATE) == pytest.approx(2 * np.pi * RATE / 1200)


def test_too_few_samples_are_refused() -> None:
    top, rotor = heights(17.0, 510, mean=0.0)
    with pytest.raises(InputError, match="cuts off the last 500 samples; 510 are too few"):
        motor_speed_thesis(top, rotor, RATE)
    rotor[3] = np.nan
    with pytest.raises(InputError, match="509 of 510 are"):
        motor_speed_fft(top, rotor, RATE)
