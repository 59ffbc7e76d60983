"""The figures of designs: paths as in the thesis' figures 6.1 and 6.5, shapes as in its 6.3."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.motion import FOOT
from workbench.report import palette
from workbench.report.drawing import drawn
from workbench.timeseries import TimeSeries

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["path_figure", "shape_figure"]

_MOST_COLUMNS = 5  # of shapes beside each other, as in figure 6.3


def path_figure(motions: Mapping[str, TimeSeries]) -> Figure:
    """Draw the foot's path of each hop below the other, on the same axes.

    Args:
        motions: title -> motion; times before zero are left out.
    """

    def draw(figure: Figure) -> None:
        rows = figure.subplots(len(motions), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
        for ax, (title, motion), color in zip(rows, motions.items(), _colors(), strict=False):
            moving = motion.between(0.0, np.inf)
            ax.plot(moving[FOOT[0]], 1e3 * moving[FOOT[2]], color=color, linewidth=0.7)
            ax.set(title=title, ylabel="z [mm]")
        rows[-1].set_xlabel("x of the foot's centre [m]")

    return drawn(draw, 0.6 + 1.35 * len(motions))


def shape_figure(shapes: Mapping[str, Sequence[NDArray[np.float64]]], foot_length: float) -> Figure:
    """Draw beams beside each other, each on its foot, to one scale.

    Args:
        shapes: title -> curves (N + 1, 2), x from the foot's centre [m]: the first with a full
            line, the others behind it with thin ones.
        foot_length: [m].
    """
    count = len(shapes)
    rows = -(-count // _MOST_COLUMNS)

    def draw(figure: Figure) -> None:
        panels = figure.subplots(
            rows, min(count, _MOST_COLUMNS), sharex=True, sharey=True, squeeze=False
        )
        for ax, (title, curves) in zip(panels.flat, shapes.items(), strict=False):
            _draw_robot(ax, curves, foot_length)
            ax.set_title(title)
        for ax in panels.flat[count:]:
            ax.set_visible(False)
        for ax in panels[-1]:
            ax.set_xlabel("x [m]")
        panels[0, 0].set_ylabel("z [m]")

    return drawn(draw, 2.9 * rows)


def _draw_robot(ax: Axes, curves: Sequence[NDArray[np.float64]], foot_length: float) -> None:
    ax.plot([-foot_length / 2, foot_length / 2], [0, 0], color=palette.SHADES["foot"], linewidth=2)
    for k, points in enumerate(curves):
        style = (
            {"color": palette.TWIN, "linewidth": 1.6}
            if k == 0
            else {"color": palette.SHADES["scale"], "linewidth": 0.7}
        )
        ax.plot(*points.T, **style)
        ax.plot(*points[-1], marker="o", markersize=4 if k == 0 else 2, color=style["color"])
    ax.set_aspect("equal", adjustable="box")


def _colors() -> list[str]:
    return [palette.SHADES["scale"], palette.TWIN, palette.EXTENDED, palette.REAL] * 4
