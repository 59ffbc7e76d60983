"""The floor's slope against one that was built in, and what it does to a motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking import fit_floor

RATE = 120.0


def hops(
    slope_x: float = 0.0, slope_y: float = 0.0, sideways: float = 0.0, seed: int = 1, hops: int = 30
) -> TimeSeries:
    """Return a foot that stands 0.15 s and hops 2 cm high and 3 cm far, on a tilted plane."""
    rng = np.random.default_rng(seed)
    stand, fly = 18, 16
    u = np.linspace(0, 1, fly, endpoint=False)
    x = np.concatenate([np.append(np.full(stand, k), k + u) for k in range(hops)]) * 0.03
    z = np.tile(np.append(np.zeros(stand), 0.08 * u * (1 - u)), hops)
    y = sideways * np.sin(x * 9)
    foot = np.column_stack([x, y, z + rng.normal(0, 3e-4, hops).repeat(stand + fly)])
    top = foot + np.array([0.07, 0.0, 0.28])
    rotor = top + np.array([0.0, 0.0, -0.035])
    turn = Rotation.from_euler("xy", [slope_y, -slope_x])
    columns: dict[str, np.ndarray] = {}
    for names, path in ((FOOT, foot), (TOP, top), (ROTOR, rotor)):
        seen = turn.apply(path) + rng.normal(0, 1e-4, path.shape)
        columns |= dict(zip(names, seen.T, strict=True))
    columns[PITCH] = np.full(len(x), -slope_x)
    columns[ROTOR_ANGLE] = np.full(len(x), np.pi / 2 - slope_x)
    return TimeSeries.of(np.arange(len(x)) / RATE, columns)


@pytest.mark.parametrize("slope", [0.0, 0.015, -0.04])
def test_the_slope_is_found_and_its_error_covers(slope: float) -> None:
    apart = []
    for seed in range(30):
        floor = fit_floor(hops(slope, seed=seed))
        assert floor is not None
        assert floor.contacts == 30
        assert floor.slope_y_rad is None
        assert floor.slope_x_rad == pytest.approx(slope, abs=1e-3)
        apart.append((floor.slope_x_rad - slope) / floor.slope_x_error_rad)
    assert 0.6 < np.std(apart) < 1.6


def test_both_slopes_are_found_where_the_foot_wanders_sideways() -> None:
    floor = fit_floor(hops(0.02, 0.03, sideways=0.2))
    assert floor is not None
    assert floor.slope_y_rad is not None
    assert floor.slope_y_error_rad is not None
    assert floor.slope_x_rad == pytest.approx(0.02, abs=1.5e-3)
    assert floor.slope_y_rad == pytest.approx(0.03, abs=1.5e-3)


def test_places_where_the_foot_stood_on_something_do_not_tilt_the_floor() -> None:
    run = hops(0.015)
    values = run.values.copy()
    values[-170:, run.names.index(FOOT[2])] += 0.02
    floor = fit_floor(TimeSeries(run.times, values, run.names, run.valid))
    assert floor is not None
    assert floor.slope_x_rad == pytest.approx(0.015, abs=2e-3)


def test_a_standing_foot_that_is_hidden_for_one_sample_still_tells_the_floor() -> None:
    run = hops(0.02)
    hidden = run.valid.copy()
    hidden[10::34] = False  # in the middle of each stand
    slower = run.times * RATE / 90  # three samples of a stand are enough at 90 Hz
    floor = fit_floor(TimeSeries(slower, run.values, run.names, hidden))
    assert floor is not None
    assert floor.slope_x_rad == pytest.approx(0.02, abs=0.005)


def test_a_foot_that_stays_tells_no_floor() -> None:
    assert fit_floor(hops(hops=3)) is None
    run = hops()
    still = np.tile(run.values[:1], (len(run), 1))
    assert fit_floor(TimeSeries(run.times, still, run.names, run.valid)) is None
    assert fit_floor(TimeSeries(run.times[:3], run.values[:3], run.names, run.valid[:3])) is None
