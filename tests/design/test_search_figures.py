"""The figures of a search say what happened."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tests.optimize.contract import NAMES, beam, ridges, three
from workbench.optimize import GeneticAlgorithm, History, search
from workbench.report.design.search_figures import (
    draw_front,
    draw_generations,
    draw_repeats,
    draw_variables,
)


def legend(axes: Axes) -> list[str]:
    shown = axes.get_legend()
    return [text.get_text() for text in shown.get_texts()] if shown else []


def test_figure_6_2_has_best_above_and_mean_below() -> None:
    figure = Figure()
    draw_generations(figure, {"17 rad/s": three(), "19 rad/s": three()}, "distance_m")
    best, mean = figure.axes
    assert best.lines[0].get_ydata() == pytest.approx([1.0, 1.4, 1.4]), "the best so far"
    assert best.lines[1].get_ydata() == pytest.approx([1.0, 1.4, -2.0]), "of each generation"
    assert {float(tick) % 1 for tick in mean.get_xticks()} == {0.0}
    np.testing.assert_allclose(np.asarray(mean.lines[0].get_ydata()), [0.75, 1.0, np.nan])
    assert legend(best) == ["17 rad/s", "19 rad/s"]
    assert best.get_ylabel() == "distance [m]"


def test_figure_6_4_has_median_and_range_over_the_evaluations() -> None:
    shorter = History(("a", "b"), three().generations[:1])
    figure = Figure()
    draw_repeats(figure, [three(), three(), shorter], "distance_m")
    median = figure.axes[0].lines[-1]
    # 1.0 m with the first evaluation; 1.4 m with the fifth, which two of three searches made
    assert np.asarray(median.get_xdata()).tolist() == list(range(1, 10))
    np.testing.assert_allclose(np.asarray(median.get_ydata()), [1.0] * 4 + [1.4] * 5)


def test_the_best_variables_lie_between_their_bounds() -> None:
    space = beam()
    history = search("r", GeneticAlgorithm(space, 0), ridges(), evaluations=60, penalty=(102.0,))
    figure = Figure()
    draw_variables(figure, space, {"one": history, "two": history})
    shown = np.asarray(figure.axes[0].lines[1].get_ydata())
    np.testing.assert_allclose(space.lower + shown * space.widths, history.best.candidate)
    assert [t.get_text() for t in figure.axes[0].get_xticklabels()] == list(NAMES)


def test_a_front_s_figure_marks_what_none_beats() -> None:
    figure = Figure()
    draw_front(figure, three(), ("distance_m", "distance_m"))
    assert legend(figure.axes[0]) == ["front, 4 of 4"]
