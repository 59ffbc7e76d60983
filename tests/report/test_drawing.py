"""Figures of pages: nothing is drawn beyond their edges."""

from __future__ import annotations

from matplotlib.figure import Figure

from workbench.report.drawing import drawn


def two_rows(figure: Figure) -> None:
    """Two axes whose tick labels differ in width, as best and mean of a long search."""
    best, mean = figure.subplots(2, 1)
    best.plot([0, 2500], [0.0, 1.25])
    mean.plot([0, 2500], [-0.3, 1.1])
    for axes in (best, mean):
        axes.set_ylabel("distance [m]")


def test_aligned_labels_have_room() -> None:
    figure = drawn(two_rows, 4.6)
    figure.draw_without_rendering()
    for axes in figure.axes:
        assert axes.yaxis.label.get_window_extent().x0 > 0
