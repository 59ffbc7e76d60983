"""Cleaning against a known truth, and the thesis' script written out a second time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from workbench.errors import InputError
from workbench.motion import FOOT, ROTOR, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking import CLEANING, Axes, BodyNames, Take, raw_points
from workbench.tracking.cleaning import recipe_named
from workbench.tracking.default_recipe import _curve
from workbench.tracking.resampling import nearest_sample, on_grid

Lose = Callable[[Take, str, int, int], Take]


def clean(take: Take, recipe: str = "default") -> tuple[TimeSeries, Any]:
    cleaned = CLEANING[recipe](raw_points(take, BodyNames(), Axes()))
    return cleaned.columns, cleaned.report


def spoil(take: Take, name: str, where: slice, by: float) -> Take:
    """Displace a body sideways in some samples."""
    body = take.bodies[name]
    measured, solved = body.measured.copy(), body.solved.copy()
    measured[where] += by
    solved[where] += by
    return replace(
        take, bodies={**take.bodies, name: replace(body, measured=measured, solved=solved)}
    )


def path(series: TimeSeries, names: tuple[str, str, str]) -> np.ndarray:
    return np.column_stack([series[name] for name in names])


def test_a_clean_take_is_kept_within_its_noise(hop: Any) -> None:
    series, report = clean(hop.take)
    assert series.valid.all()
    for names, truth in ((TOP, hop.truth.top), (ROTOR, hop.truth.rotor)):
        apart = path(series, names) - truth
        assert np.std(apart, axis=0).max() < 1e-4
    counts = {(b.held, b.filled, b.rejected, b.missing_left) for b in report.bodies.values()}
    assert counts == {(0, 0, 0, 0)}


def test_a_short_gap_is_filled_but_not_valid(hop: Any, lose: Lose) -> None:
    series, report = clean(lose(hop.take, "Rotor", 600, 610))
    x = series[ROTOR[0]]
    assert np.isfinite(x).all()
    assert np.flatnonzero(~series.validity(ROTOR[0])).tolist() == list(range(600, 610))
    whole = clean(hop.take)[0]
    assert np.abs(path(series, ROTOR) - path(whole, ROTOR)).max() < 4e-3
    assert (report.bodies["rotor"].filled, report.bodies["rotor"].missing_left) == (10, 0)


def test_a_long_gap_stays_open_and_the_filter_does_not_cross_it(hop: Any, lose: Lose) -> None:
    take = lose(hop.take, "Foot", 600, 640)
    series, report = clean(take)
    assert np.flatnonzero(np.isnan(series[FOOT[0]])).tolist() == list(range(600, 640))
    assert report.bodies["foot"].missing_left == 40
    beyond = spoil(take, "Foot", slice(640, None), 0.001)
    before = slice(0, 600)
    np.testing.assert_array_equal(series[FOOT[0]][before], clean(beyond)[0][FOOT[0]][before])


def test_a_stretch_too_short_for_the_curve_is_left_and_reported(hop: Any, lose: Lose) -> None:
    take = lose(lose(hop.take, "Foot", 500, 540), "Foot", 543, 590)
    series, report = clean(take)
    raw = raw_points(take, BodyNames(), Axes()).foot.position
    assert report.unfiltered == 3 * 3
    np.testing.assert_array_equal(path(series, FOOT)[540:543], raw[540:543])
    assert series.validity(FOOT[0])[540:543].all()


@pytest.mark.parametrize(("name", "by"), [("Foot", 0.01), ("T", 0.02), ("Rotor", 0.02)])
def test_a_spike_is_rejected(hop: Any, name: str, by: float) -> None:
    role = {"Foot": "foot", "T": "top", "Rotor": "rotor"}[name]
    series, report = clean(spoil(hop.take, name, slice(700, 702), by))
    assert report.bodies[role].rejected == 2
    names = {"foot": FOOT, "top": TOP, "rotor": ROTOR}[role]
    assert np.abs(path(series, names) - path(clean(hop.take)[0], names)).max() < 1.5e-3


def test_a_burst_is_rejected(hop: Any) -> None:
    _, report = clean(spoil(hop.take, "Rotor", slice(700, 708), 0.08))
    assert {role: b.rejected for role, b in report.bodies.items()} == {
        "foot": 0,
        "top": 0,
        "rotor": 8,
    }


def test_an_impossible_distance_is_rejected(hop: Any) -> None:
    series, report = clean(spoil(hop.take, "Rotor", slice(700, 760), 0.5))
    assert report.bodies["rotor"].rejected == 60
    assert not series.validity(ROTOR[0])[700:760].any()


def test_a_distance_rule_that_never_fits_is_left_out(hop: Any) -> None:
    _, report = clean(spoil(hop.take, "Rotor", slice(None), 0.5))
    assert report.bodies["rotor"].rejected == 0
    assert "distances top-rotor lie outside 0.01 to 0.2 m" in report.warnings[0]


def test_the_curve_has_the_gain_it_promises() -> None:
    t = np.arange(600) / 120

    def kept(hertz: float) -> float:
        wave = np.sin(2 * np.pi * hertz * t)
        out = _curve(wave[:, None], 120.0)[0][:, 0]
        return float(np.std(out[100:-100]) / np.std(wave[100:-100]))

    for hertz in (3.2, 12.0, 30.0, 50.0):
        ratio = np.sin(np.pi * hertz / 120) / np.sin(np.pi * 30 / 120)
        assert kept(hertz) == pytest.approx(1 / (1 + ratio**6), abs=1e-4)
    noise = np.random.default_rng(3).normal(size=(5000, 1))
    assert np.std(_curve(noise, 120.0)[0]) == pytest.approx(0.66, abs=0.02)


def test_a_gap_is_bridged_as_a_polynomial_and_spoils_no_sample_beside_it() -> None:
    t = np.arange(200) / 120
    wave = np.column_stack([t**2 - t, 0.035 * np.cos(17 * t)])
    holed = wave.copy()
    holed[90:102] = np.nan
    out = _curve(holed, 120.0)[0]
    np.testing.assert_allclose(out[:, 0], wave[:, 0], atol=1e-9)
    assert np.abs(out - wave)[20:90].max() < 2e-5
    assert np.abs(out - wave)[90:102].max() < 1e-3  # a cubic spline: 4 mm


def test_a_jump_of_the_index_is_a_gap(hop: Any) -> None:
    take = hop.take
    late = np.where(np.arange(len(take)) < 500, 0, 60)
    jumped = replace(take, indices=take.indices + late, times=take.times + late / 120)
    series, _ = clean(jumped)
    assert len(series) == len(take) + 60
    assert np.isnan(series[FOOT[0]][500:560]).all()
    assert series.validity(FOOT[0])[560:].all()


def test_a_jump_too_far_is_refused(hop: Any) -> None:
    late = np.where(np.arange(len(hop.take)) < 500, 0.0, 1e8)
    with pytest.raises(InputError, match="the frame index jumps too far"):
        clean(replace(hop.take, times=hop.take.times + late))


def test_a_jittering_clock_is_resampled_evenly() -> None:
    rng = np.random.default_rng(2)
    times = np.arange(500) / 250 + rng.uniform(-9e-4, 9e-4, 500)
    grid = times[0] + np.arange(495) / 250
    source = nearest_sample(times, grid, 250.0)
    values = on_grid(times, np.sin(20 * times)[:, None], grid, source, 0.1)
    assert np.isfinite(values[1:-1]).all()
    assert np.abs(values[:, 0] - np.sin(20 * grid))[1:-1].max() < 1e-4


def script(take: Take) -> np.ndarray:
    """Appendix C a second time, in loops like the original; export axes."""
    n = len(take) - 1
    data = np.hstack([take.bodies[k].solved.mean(axis=1)[:n] for k in ("Foot", "T", "Rotor")])
    base = np.median(data[:240, :3], axis=0)
    data -= np.tile(base, 3)
    for i in range(1, n):
        for c in range(9):
            if np.isnan(data[i, c]):
                data[i, c] = data[i - 1, c]
    for i in range(2, n):
        apart = np.linalg.norm(data[i, :3] - data[i, 3:6])
        if apart < 0.16 or apart > 0.6:
            data[i, 3:6] = data[i - 1, 3:6]
        apart = np.linalg.norm(data[i, 3:6] - data[i, 6:9])
        if apart < 0.01 or apart > 0.2:
            data[i, 6:9] = data[i - 1, 6:9]
    coefficients: Any = butter(10, 9 / 60)
    return filtfilt(coefficients[0], coefficients[1], data, axis=0, padlen=30)


def test_the_thesis_recipe_is_appendix_c(hop: Any, lose: Lose) -> None:
    take = lose(spoil(hop.take, "T", slice(700, 710), 0.5), "Foot", 400, 420)
    foot = take.bodies["Foot"]
    solved = foot.solved.copy()
    solved[800:803] = np.nan
    take = replace(take, bodies={**take.bodies, "Foot": replace(foot, solved=solved)})
    series, report = clean(take, "thesis")
    told = script(take)
    for k, names in enumerate((FOOT, TOP, ROTOR)):
        bench = Axes().points_to_bench(told[:, 3 * k : 3 * k + 3])
        np.testing.assert_allclose(path(series, names), bench, atol=1e-8)
    assert series.valid.all()
    assert len(series) == len(take) - 1
    counts = {role: (b.held, b.rejected) for role, b in report.bodies.items()}
    assert counts == {"foot": (3, 0), "top": (10, 10), "rotor": (0, 0)}


def test_the_thesis_recipe_halves_nine_hertz(hop: Any) -> None:
    foot = hop.take.bodies["Foot"]
    shake = 1e-3 * np.sin(2 * np.pi * 9.0 * hop.take.times)
    solved = foot.solved + shake[:, None, None] * [0.0, 1.0, 0.0]
    take = replace(hop.take, bodies={**hop.take.bodies, "Foot": replace(foot, solved=solved)})
    left = (clean(take, "thesis")[0][FOOT[2]] - clean(hop.take, "thesis")[0][FOOT[2]])[100:-100]
    assert left.max() - np.median(left) == pytest.approx(0.5e-3, rel=0.02)


def test_the_thesis_recipe_says_where_its_script_gives_nothing(hop: Any) -> None:
    foot = hop.take.bodies["Foot"]
    solved = foot.solved.copy()
    solved[100] = np.nan
    take = replace(hop.take, bodies={**hop.take.bodies, "Foot": replace(foot, solved=solved)})
    with pytest.raises(
        InputError, match="'Foot' has no position in frame row 101 of the first 240"
    ):
        clean(take, "thesis")


def test_an_unknown_recipe_is_named_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"'thesiss' is unknown.*did you mean 'thesis'"):
        recipe_named("thesiss")
