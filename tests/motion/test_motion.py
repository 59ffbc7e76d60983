from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import butter, lfilter, sosfiltfilt

from workbench.motion import (
    FOOT,
    RELEASED,
    ROTOR_ANGLE,
    ROTOR_SPEED,
    TOP,
    Mode,
    first_motion,
    last_motion,
    misfit,
    position,
    release,
    rotor_angle,
    rotor_speed,
    summarize,
    time_zero,
)
from workbench.schemas import load_model, load_shape
from workbench.sim import Condition, make_robot, simulate
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


Path3 = Callable[[np.ndarray], np.ndarray]
LOCKED = np.zeros(600)
LOW_PASS = butter(4, 25.0, fs=RATE, output="sos")  # the default recipe's


def let_go(held: Condition) -> Path3:
    """Path of the released point of a simulated robot at any time, the release at zero."""
    here = Path()
    robot = make_robot(
        load_model("thesis", here).content.values(), load_shape("thesis-initial", here).content
    )
    moving = simulate(robot, held).motion
    path = CubicSpline(moving.times, position(moving, RELEASED[held.mode]))
    return lambda times: np.asarray(path(np.clip(times, 0.0, 4.9)))


def seen(path: Path3, start: float, seed: int, noise: float, filtered: bool) -> np.ndarray:
    rng = np.random.default_rng(seed)
    places = path(np.arange(0, 6, 1 / RATE) - start)
    places += rng.normal(0, noise, places.shape)
    return np.asarray(sosfiltfilt(LOW_PASS, places, axis=0)) if filtered else places


@pytest.mark.parametrize("filtered", [False, True])
@pytest.mark.parametrize(
    ("held", "bias_ms", "scatter_ms"),
    [
        (Condition("decay", LOCKED, pull=0.1), 5.0, 14.0),
        (Condition("decay", LOCKED, pull=0.39), 2.5, 5.0),
        (Condition("decay", LOCKED, pull=1.2), 2.0, 2.0),
        (Condition("drop", LOCKED, height=0.01), 2.5, 3.0),
        (Condition("drop", LOCKED, height=0.05), 2.5, 2.0),
    ],
    ids=lambda value: f"{value.mode} {value.pull} N" if isinstance(value, Condition) else None,
)
def test_a_release_is_found_as_well_as_the_docstring_says(
    held: Condition, bias_ms: float, scatter_ms: float, filtered: bool
) -> None:
    path, times = let_go(held), np.arange(0, 6, 1 / RATE)
    starts = 2.0 + np.random.default_rng(5).uniform(0, 1 / RATE, 25)  # anywhere between pictures
    late = []
    for seed, start in enumerate(starts):
        found = release(times, seen(path, start, seed, 0.0003, filtered))
        assert found is not None
        late.append(1000 * (found - start))
    assert abs(np.mean(late)) < bias_ms
    assert np.std(late) < scatter_ms


@pytest.mark.parametrize(("pull", "scatter_ms"), [(0.1, 32.0), (0.39, 10.0), (1.2, 4.0)])
def test_a_release_in_noise_that_lasts_is_found_less_well(pull: float, scatter_ms: float) -> None:
    path, times = let_go(Condition("decay", LOCKED, pull=pull)), np.arange(0, 6, 1 / RATE)
    late = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        start = 2.0 + rng.uniform(0, 1 / RATE)
        fresh = rng.normal(0, 0.6 * 0.0003, (len(times), 3))
        found = release(times, path(times - start) + lfilter([1], [1, -0.8], fresh, axis=0))
        assert found is not None
        late.append(1000 * (found - start))
    print(np.mean(late), np.std(late))
    assert abs(np.mean(late)) < 10
    assert np.std(late) < scatter_ms


def test_a_release_survives_a_gap_and_a_later_pick_up() -> None:
    path, times = let_go(Condition("drop", LOCKED, height=0.02)), np.arange(0, 6, 1 / RATE)
    places = seen(path, 2.0, 1, 0.0002, False)
    places[230:236] = np.nan
    places[times > 5.2] += 0.5  # somebody takes the robot away
    assert release(times, places) == pytest.approx(2.0, abs=0.005)


def test_what_is_held_all_the_time_is_never_released() -> None:
    times = np.arange(0, 6, 1 / RATE)
    still = np.random.default_rng(1).normal(0.3, 0.0003, (len(times), 3))
    assert release(times, still) is None
    assert release(times, np.full_like(still, np.nan)) is None


def test_time_zero_is_what_the_mode_begins_with() -> None:
    times, turned = spun(1.5, 0.1, 0.0)
    lifted = np.where(times > 2, -5.0 * (times - 2) ** 2, 0.0).clip(-0.02)
    pulled = 0.1 + 0.02 * np.cos(10 * np.maximum(times - 2.5, 0))
    zero = np.zeros(len(times))
    columns = dict.fromkeys((*FOOT, *TOP), zero)
    columns |= {FOOT[2]: lifted, TOP[0]: pulled, ROTOR_ANGLE: turned}
    series = TimeSeries.of(times, columns)
    begins: dict[Mode, float] = {"hop": 1.5, "clamped": 1.5, "drop": 2.0, "decay": 2.5}
    for mode, expected in begins.items():
        assert time_zero(mode, series) == pytest.approx(expected, abs=0.004)
