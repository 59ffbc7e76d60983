import numpy as np
import pytest

from workbench.timeseries import TimeSeries

T = np.array([0.0, 0.5, 1.0, 1.5, 2.0])


def series() -> TimeSeries:
    return TimeSeries.of(T, {"a_m": T * 2, "b_m": np.array([0, 1, np.nan, 3, 4])})


def test_a_sample_that_is_not_finite_is_not_valid() -> None:
    assert series().validity("b_m").tolist() == [True, True, False, True, True]
    assert series().validity("a_m").all()


def test_interpolation_is_valid_only_between_valid_neighbours() -> None:
    there = series().at(np.array([0.25, 0.75, 1.0, 1.5, 2.0, 2.1]))
    assert there.validity("b_m").tolist() == [True, False, False, True, True, False]
    assert there["a_m"][:5] == pytest.approx([0.5, 1.5, 2, 3, 4])
    assert np.isnan(there["a_m"][5])


def test_shift_select_and_cut_return_new_values() -> None:
    cut = series().shifted(1.0).select(["b_m"]).between(1.0, 2.0)
    assert cut.names == ("b_m",)
    assert cut.times.tolist() == [1.0, 1.5, 2.0]
    assert series().times[0] == 0


def test_wrong_shapes_and_times_are_refused_with_the_sample() -> None:
    with pytest.raises(ValueError, match=r"5 times and 1 names has values \(4, 1\)"):
        TimeSeries(T, np.zeros((4, 1)), ("a",), np.ones((4, 1), bool))
    with pytest.raises(ValueError, match="do not increase at sample 2"):
        TimeSeries.of(np.array([0.0, 1.0, 1.0]), {"a": np.zeros(3)})
    with pytest.raises(ValueError, match="names repeat"):
        TimeSeries(T, np.zeros((5, 2)), ("a", "a"), np.ones((5, 2), bool))


def test_an_unknown_column_names_those_that_exist() -> None:
    with pytest.raises(KeyError, match="no column 'c_m'; there are a_m, b_m"):
        series()["c_m"]


def test_a_series_is_shown_in_one_line() -> None:
    series = TimeSeries.of([0.0, 0.5], {"foot_x_m": [0, 1], "foot_z_m": [0, 1]})
    assert repr(series) == "TimeSeries(2 samples, 0 s to 0.5 s: foot_x_m, foot_z_m)"
    assert repr(series.between(7, 8)) == "TimeSeries(0 samples: foot_x_m, foot_z_m)"
