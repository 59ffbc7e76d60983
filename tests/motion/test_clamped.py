"""What T does while the foot is clamped, from motions whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.motion import ROTOR_ANGLE, TOP, summarize_clamped
from workbench.quantities import QUANTITIES, leading
from workbench.timeseries import TimeSeries

RATE, SPEED, LAG = 120.0, 14.0, 2.0


def swinging(order: float = 1.0, seconds: float = 8.0) -> TimeSeries:
    """T swings forward by 16 mm, LAG behind the rotor, rings at 1.6 Hz and carries noise."""
    t = np.arange(-1, seconds, 1 / RATE)
    phi = 0.4 + SPEED * np.maximum(t, 0.0)
    noise = np.random.default_rng(1).normal(0, 2e-4, (2, len(t)))
    ringing = 0.01 * np.exp(-0.03 * t) * np.cos(2 * np.pi * 1.6 * t)
    x = 0.016 * np.cos(phi - LAG) + ringing + noise[0]
    if order != 1.0:
        x += 0.05 * np.cos(order * phi)
    z = 0.4 + 0.004 * np.sin(phi) + noise[1]
    columns = dict(zip(TOP, (x, np.zeros_like(t), z), strict=True)) | {ROTOR_ANGLE: phi}
    return TimeSeries.of(t, columns)


def test_amplitude_frequency_and_phase_are_found_beside_the_ringing() -> None:
    found = summarize_clamped(swinging(), 8.0)
    assert found.amplitude_m == pytest.approx(0.016, abs=1e-4)
    assert found.phase_rad == pytest.approx(LAG, abs=0.01)
    assert found.swing_hz == pytest.approx(SPEED / (2 * np.pi), abs=1e-3)
    assert found.speed_rad_s == pytest.approx(SPEED, abs=1e-3)


def test_a_period_that_is_doubled_shows_in_the_frequency() -> None:
    found = summarize_clamped(swinging(0.5), 8.0)
    assert found.swing_hz == pytest.approx(SPEED / (4 * np.pi), abs=1e-3)


def test_a_run_that_is_too_short_tells_the_speed_alone() -> None:
    found = summarize_clamped(swinging(seconds=1.3), 1.3)
    assert found.speed_rad_s == pytest.approx(SPEED, abs=1e-3)
    assert np.isnan([found.amplitude_m, found.swing_hz, found.phase_rad]).all()
    assert leading(found.as_json()) == "-"


def test_phases_differ_by_less_than_a_turn_and_a_list_shows_the_amplitude() -> None:
    assert QUANTITIES["phase_rad"].apart(-3.1, 3.1) == pytest.approx(np.degrees(6.2) - 360)
    assert leading(summarize_clamped(swinging(), 8.0).as_json()) == "16.0 mm"
