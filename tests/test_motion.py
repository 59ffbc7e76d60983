import numpy as np
import pytest

from workbench.motion import (
    FOOT,
    ROTOR_ANGLE,
    ROTOR_SPEED,
    TOP,
    first_motion,
    last_motion,
    misfit,
    rotor_angle,
    rotor_speed,
    summarize,
)
from workbench.timeseries import TimeSeries

RATE = 120.0


def spun(start: float, lag: float, noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Angle of a motor that starts at a time with a first-order lag towards 17 rad/s."""
    times = np.arange(0, 6, 1 / RATE)
    since = np.maximum(times - start, 0)
    angle = 1.2 + 17 * (since - lag * (1 - np.exp(-since / lag)))
    return times, angle + np.random.default_rng(seed).normal(0, noise, len(times))


@pytest.mark.parametrize("start", [1.0, 2.0, 2.0042])
@pytest.mark.parametrize("lag", [1e-4, 0.05, 0.2])
def test_first_motion_is_found_within_a_frame(start: float, lag: float) -> None:
    found = first_motion(*spun(start, lag, noise=0.004))
    assert found == pytest.approx(start, abs=0.6 / RATE)


def test_first_motion_scatters_by_less_than_three_milliseconds() -> None:
    found = [first_motion(*spun(2.0, 0.1, 0.004, seed)) or 0.0 for seed in range(50)]
    assert np.std(found) < 0.003
    assert np.mean(found) == pytest.approx(2.0, abs=0.003)


def test_a_rotor_at_rest_has_no_first_motion() -> None:
    times, _ = spun(2.0, 0.1, 0.0)
    still = np.random.default_rng(1).normal(0.3, 0.004, len(times))
    assert first_motion(times, still) is None
    assert first_motion(times, np.full(len(times), np.nan)) is None


def test_rotor_angle_turns_from_forward_towards_down() -> None:
    top = np.zeros((4, 3))
    rotor = np.array([[1, 0, 0], [0, 0, -1], [-1, 0, 0], [0, 0, 1]], float)
    assert rotor_angle(top, rotor) == pytest.approx(np.array([0, 0.5, 1, 1.5]) * np.pi)


def test_rotor_speed_survives_a_gap() -> None:
    times, angle = spun(0.0, 1e-3, noise=0.0)
    angle[100:104] = np.nan
    speed = rotor_speed(times, angle)
    assert np.isnan(speed[100:104]).all()
    assert speed[50:100] == pytest.approx(17, rel=1e-6)


def motion(x: np.ndarray, z: np.ndarray, times: np.ndarray) -> TimeSeries:
    zero = np.zeros(len(times))
    columns = dict.fromkeys((*FOOT, *TOP), zero)
    columns |= {FOOT[0]: x, FOOT[2]: z, TOP[0]: x, ROTOR_ANGLE: 17 * np.maximum(times, 0)}
    return TimeSeries.of(times, columns)


def test_the_end_of_the_drive_is_found_where_the_rotor_slows() -> None:
    times = np.arange(-100, 700) / RATE
    speed = np.where((times > 0) & (times <= 4), 17.0, 0.0)
    series = TimeSeries.of(times, {ROTOR_SPEED: speed})
    assert last_motion(series) == pytest.approx(4.0, abs=1 / RATE)


def test_summary_tells_distance_hop_height_and_speed() -> None:
    times = np.arange(-240, 1300) / RATE
    height = np.where(times > 0, 0.01 * np.sin(17 * times / 2) ** 2, 0.0)
    summary = summarize(motion(0.5 + 0.02 * np.maximum(times, 0), height + 0.1, times), 10.0)
    assert summary.distance_m == pytest.approx(0.2, abs=1e-4)
    assert summary.hop_height_m == pytest.approx(0.01, rel=0.02)
    assert summary.speed_rad_s == pytest.approx(17)


def test_misfit_is_the_root_mean_square_in_millimetres() -> None:
    times = np.arange(-10, 1300) / RATE
    zero = np.zeros(len(times))
    one = motion(zero, zero, times)
    off = motion(zero, zero + 0.003, times)
    found = misfit(one, off, 10.0)
    assert found.foot_mm == pytest.approx(3.0)
    assert found.top_mm == pytest.approx(0.0)
    assert found.both_mm == pytest.approx(3.0 / np.sqrt(2))
