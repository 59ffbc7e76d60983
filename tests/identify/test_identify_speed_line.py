"""The line and its checks on speeds whose truth is known."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from workbench.identify import SpeedCalibration, SpeedPoint, calibrate, fit_line
from workbench.identify.speed_line import fitted

SLOPE, OFFSET = 4.38, -2.87
VOLTS = np.linspace(1.2, 5.0, 10)
DRAWS = 200
SCATTER = 0.02  # [rad/s] from run to run
OWN = 0.005


def points(
    rng: np.random.Generator, *, bend: float = 0.0, scatter: float = SCATTER
) -> list[SpeedPoint]:
    """Runs in random order, six minutes apart; own errors differ threefold; bent by rad/s."""
    volts = VOLTS
    order = rng.permutation(len(volts))
    own = OWN * rng.uniform(0.5, 1.5, len(volts))
    parabola = 4 * (volts - volts[0]) * (volts[-1] - volts) / (volts[-1] - volts[0]) ** 2
    speeds = SLOPE * volts + OFFSET + bend * parabola
    speeds = speeds + rng.normal(0, np.hypot(own, scatter))
    return [
        SpeedPoint(f"r{k}", float(volts[k]), float(speeds[k]), float(own[k]), hours=0.1 * place)
        for place, k in enumerate(order)
    ]


def draws(count: int = DRAWS, **how: float) -> list[SpeedCalibration]:
    return [calibrate(points(np.random.default_rng(seed), **how)) for seed in range(count)]


@pytest.mark.parametrize("scatter", [0.0, 0.005, 0.02])
def test_the_intervals_hold_the_truth_nine_times_in_ten(scatter: float) -> None:
    found = [one.line for one in draws(scatter=scatter)]
    slope = np.mean([line.slope.low <= SLOPE <= line.slope.high for line in found if line])
    offset = np.mean([line.offset.low <= OFFSET <= line.offset.high for line in found if line])
    assert 0.80 <= slope <= 0.98
    assert 0.80 <= offset <= 0.98


def test_the_interval_of_one_more_run_holds_it_nine_times_in_ten() -> None:
    rng = np.random.default_rng(1)
    inside = []
    for one in draws():
        assert one.line is not None
        volts = np.array([3.0])
        speed = SLOPE * 3 + OFFSET + rng.normal(0, np.hypot(OWN, SCATTER))
        half = one.line.half_width(volts, OWN)[0]
        inside.append(abs(speed - one.line.at(volts)[0]) <= half)
    assert 0.84 <= np.mean(inside) <= 0.96


def test_a_line_bent_by_two_percent_is_told_every_time_and_a_straight_one_is_not() -> None:
    span = SLOPE * (VOLTS[-1] - VOLTS[0])
    bent = draws(bend=0.02 * span)
    assert all(one.checks["curvature"].found for one in bent)
    assert np.mean([one.checks["curvature"].size for one in bent]) == pytest.approx(2.0, abs=0.05)
    assert "the line is bent: midway the speed lies 0.3" in bent[0].warnings[0]
    alarms = [one.checks["curvature"].found for one in draws()]
    assert np.mean(alarms) <= 0.03  # one in a hundred is the level; 200 draws


def test_a_bend_that_nobody_could_set_is_not_called_one() -> None:
    (one,) = draws(1, bend=0.01, scatter=1e-5)
    exact = calibrate([replace(point, standard_error=1e-5) for point in one.points])
    assert not exact.checks["curvature"].found


def test_a_drift_is_told_in_rad_per_second_an_hour() -> None:
    runs = points(np.random.default_rng(3))
    drifting = [replace(point, speed=point.speed + 0.3 * point.hours) for point in runs]
    found = calibrate(drifting).checks["drift"]
    assert found.found
    assert found.size == pytest.approx(0.3, abs=0.08)
    assert not calibrate(runs).checks["drift"].found


def test_what_goes_with_the_voltage_is_not_tested() -> None:
    runs = points(np.random.default_rng(3))
    rising = [replace(point, hours=point.voltage) for point in runs]
    found = calibrate(rising).checks
    assert "the time of day goes with the voltage" in str(found["drift"].untested)
    assert found["direction"].untested == "the voltage was only changed one way"
    assert found["sense"].untested == "the rotor turned one way only"
    unknown = calibrate([replace(point, hours=float("nan")) for point in runs]).checks
    assert "not known when" in str(unknown["drift"].untested)


@pytest.mark.parametrize(
    ("change", "check", "told"),
    [
        ({"mode": "hop"}, "mode", "0.2.. rad/s slower when the robot hops"),
        ({"sense": -1}, "sense", "0.2.. rad/s faster forwards than backwards"),
    ],
)
def test_two_kinds_of_runs_that_differ_are_told(
    change: dict[str, object], check: str, told: str
) -> None:
    runs = points(np.random.default_rng(5)) + points(np.random.default_rng(6))
    mixed = [
        replace(point, speed=point.speed - 0.2, **change) if k % 2 else point  # type: ignore[arg-type]
        for k, point in enumerate(runs)
    ]
    found = calibrate(mixed)
    assert found.checks[check].found
    assert any(told.split("..")[1] in warning for warning in found.warnings)
    alike = [replace(point, **change) if k % 2 else point for k, point in enumerate(runs)]  # type: ignore[arg-type]
    assert not calibrate(alike).checks[check].found


def test_a_speed_that_depends_on_the_voltage_before_is_told() -> None:
    runs = points(np.random.default_rng(7))
    higher = [True] + [b.voltage < a.voltage for a, b in pairwise(runs)]
    lagging = [
        replace(point, speed=point.speed + 0.15 * down)
        for point, down in zip(runs, higher, strict=True)
    ]
    assert calibrate(lagging).checks["direction"].found
    assert not calibrate(runs).checks["direction"].found


def test_repeats_tell_a_kink_that_no_parabola_is() -> None:
    rng = np.random.default_rng(8)
    runs = points(rng) + points(rng) + points(rng)
    wave = 0.15 * np.sin(2 * np.pi * (VOLTS - 1.2) / 1.3)
    kinked = [replace(p, speed=p.speed + float(np.interp(p.voltage, VOLTS, wave))) for p in runs]
    assert calibrate(kinked).checks["lack_of_fit"].found
    assert not calibrate(runs).checks["lack_of_fit"].found
    assert calibrate(points(rng)).checks["lack_of_fit"].untested == "no voltage was repeated"


@pytest.mark.parametrize(
    ("volts", "why"),
    [
        ([3.0] * 6, r"have 1 different voltage \(3.00 V\); a line .* at least 3"),
        ([2.0, 4.0, 2.01, 4.0], "have 2 different voltages"),
        ([3.0, 3.2, 3.4, 3.6], "span only 0.60 V, from 3.00 to 3.60 V"),
        ([], r"have 0 different voltages \(none\)"),
    ],
)
def test_voltages_that_cannot_determine_a_line_are_refused(volts: list[float], why: str) -> None:
    found = calibrate([SpeedPoint(str(k), v, 4 * v, 0.01) for k, v in enumerate(volts)])
    assert found.line is None
    assert found.parameters == {}
    with pytest.raises(ValueError, match=why):
        raise ValueError(found.open)
    assert found.as_json()["not_determined"] == [found.open]


def test_speeds_that_scatter_too_much_for_a_slope_are_refused() -> None:
    found = calibrate(points(np.random.default_rng(2), scatter=2.0))
    assert found.line is None
    assert "the slope is only known within" in str(found.open)


def test_the_scatter_is_what_makes_chi_square_its_degrees() -> None:
    one = points(np.random.default_rng(4))
    line = fit_line(one)
    variance = np.array([point.standard_error for point in one]) ** 2 + line.scatter**2
    assert np.sum(line.residuals**2 / variance) == pytest.approx(8, rel=1e-6)
    assert line.fit.birge > 1


def test_a_fit_without_scatter_is_the_textbook_s() -> None:
    # Bevington and Robinson: weights 1/s^2, covariance (X'WX)^-1 where chi^2 is below its degrees
    x, y, s = (
        np.array([0.0, 1, 2, 3]),
        np.array([0.1, 0.9, 2.1, 2.9]),
        np.array([0.2, 0.4, 0.2, 0.4]),
    )
    terms = np.column_stack([x, np.ones(4)])
    fit = fitted(terms, y, s)
    weights = np.diag(1 / s**2)
    covariance = np.linalg.inv(terms.T @ weights @ terms)
    assert fit.scatter == 0
    assert fit.coefficients == pytest.approx(covariance @ terms.T @ weights @ y)
    assert fit.covariance == pytest.approx(covariance)


def test_held_out_runs_are_compared_and_not_fitted() -> None:
    runs = points(np.random.default_rng(9))
    good = replace(runs[0], name="good", speed=SLOPE * runs[0].voltage + OFFSET)
    off = replace(good, name="off", speed=good.speed + 0.2)
    found = calibrate(runs, [good, off])
    assert [name for name, _, _ in found.held_out_errors] == ["good", "off"]
    assert len(found.warnings) == 1
    assert found.warnings[0].startswith("held-out run off lies +0.")
