"""The figures of a design: paths (thesis, 6.1 and 6.5), progress (6.2, 6.4), shapes (6.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from workbench.design.goals import Goal
from workbench.motion import FOOT
from workbench.optimize import History
from workbench.review import palette
from workbench.review.drawing import drawn, legend
from workbench.timeseries import TimeSeries

__all__ = ["front_figure", "path_figure", "progress_figure", "shape_figure"]

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


def progress_figure(histories: Mapping[str, History], goal: Goal) -> Figure:
    """Draw the best and the mean value of every generation, searches together.

    The mean is that of the candidates that did not fail.

    Args:
        histories: label -> history.
        goal: the first one of the search.
    """

    def draw(figure: Figure) -> None:
        top, below = figure.subplots(2, 1, sharex=True)
        for (label, history), color in zip(histories.items(), _cycled(), strict=False):
            table = history.columns()
            for ax, column in ((top, "best so far"), (below, "mean")):
                values = [goal.value_of(float(fitness)) for fitness in table[column]]
                ax.plot(table["generation"], values, color=color, label=label)
        unit = goal.column.rpartition("_")[2]
        top.set(title=f"best so far: {goal.meaning}", ylabel=f"{goal.name} [{unit}]")
        below.set(title="mean of a generation, failures left out", ylabel=f"{goal.name} [{unit}]")
        below.set_xlabel("generation")
        below.xaxis.set_major_locator(MaxNLocator(integer=True))
        if len(histories) > 1:
            legend(top)

    return drawn(draw, 4.6)


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


def front_figure(history: History, goals: Sequence[Goal], front: NDArray[np.float64]) -> Figure:
    """Draw all candidates by two goals, and those that no other beats by both.

    Args:
        history: of a search for two goals.
        goals: the two.
        front: (n, 2) fitness of the designs that are on the front.
    """

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        good = [t.evaluation.fitness for t in history.trials if t.evaluation.failure is None]
        for fitness, style in (
            (np.array(good).reshape(-1, 2), {"s": 5, "color": palette.SHADES["scale"]}),
            (front, {"s": 18, "color": palette.TWIN, "label": "nothing beats these by both"}),
        ):
            x, z = (
                [goal.value_of(float(one)) for one in column]
                for goal, column in zip(goals, fitness.T, strict=True)
            )
            ax.scatter(x, z, **style)
        ax.set(xlabel=goals[0].column, ylabel=goals[1].column)
        legend(ax)

    return drawn(draw, 3.6)


def _draw_robot(ax: Axes, curves: Sequence[NDArray[np.float64]], foot_length: float) -> None:
    ax.plot([-foot_length / 2, foot_length / 2], [0, 0], color=palette.SHADES["foot"], linewidth=2)
    for k, points in enumerate(curves):
        style = {"color": palette.TWIN, "linewidth": 1.6} if k == 0 else {
            "color": palette.SHADES["scale"], "linewidth": 0.7
        }  # fmt: skip
        ax.plot(*points.T, **style)
        ax.plot(*points[-1], marker="o", markersize=4 if k == 0 else 2, color=style["color"])
    ax.set_aspect("equal", adjustable="box")


def _colors() -> list[str]:
    return [palette.SHADES["scale"], palette.TWIN, palette.EXTENDED, palette.REAL] * 4


def _cycled() -> list[str]:
    inks = [palette.TWIN, palette.REAL, palette.EXTENDED]
    return [*inks, *(palette.SHADES[n] for n in ("top", "volts", "amps", "scale", "foot"))] * 2
