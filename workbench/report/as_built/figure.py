"""Draw target and beam over each other, and mark the joints to correct."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from workbench.as_built import Deviation
from workbench.report import palette
from workbench.report.drawing import drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["deviation_figure"]

_SAMPLES = 400
_LABEL_MM = 11.0  # outside the line
_STATION_MM = 3.0
_MARGIN_MM = 85.0


def deviation_figure(deviation: Deviation) -> Figure:
    """Return the picture: target, beam, stations and what to do where, from the same root [mm]."""
    return drawn(lambda figure: _draw(figure, deviation), 8.2)


def _draw(figure: Figure, deviation: Deviation) -> None:
    ax, bars = figure.subplots(2, 1, height_ratios=[4, 1])
    target, bent = (arcs.scaled(1000.0) for arcs in deviation.arcs())
    along = np.linspace(0, target.length, _SAMPLES)
    ax.plot(*target.points_at(along).T, color=palette.TWIN, label="target", linewidth=1.6)
    ax.plot(*bent.points_at(along).T, color=palette.REAL, label="as bent", linewidth=1.6)
    step = target.length / len(deviation.bent)
    stations = step * np.arange(len(deviation.bent))
    ax.plot(*bent.points_at(stations).T, "o", color=palette.REAL, markersize=_STATION_MM)
    for joint in deviation.correct:
        position, normal = bent.points_at(stations[joint]), bent.normals_at(stations[joint])
        ax.plot(*position, "o", color=palette.SHADES["amps"], markersize=8, fillstyle="none")
        text = position + _LABEL_MM * normal
        ax.annotate(
            f"{joint}: {deviation.in_words(joint)}",
            position,
            text,
            ha="right" if normal[0] < 0 else "left",
            va="center",
            arrowprops={"arrowstyle": "-", "linewidth": 0.5, "color": palette.SHADES["amps"]},
        )
    tip = 1000 * float(np.linalg.norm(deviation.tip_error))
    ends = np.array([arcs.points_at(arcs.length) for arcs in (target, bent)])
    ax.plot(*ends.T, ":", color=palette.SHADES["scale"], label=f"tip off by {tip:.1f} mm")
    ax.set(xlabel="forward [mm]", ylabel="up [mm]", aspect="equal")
    ax.margins(0.0)
    ax.set_xlim(ax.get_xlim()[0] - _MARGIN_MM, ax.get_xlim()[1] + _MARGIN_MM)
    ax.set_ylim(ax.get_ylim()[0] - _LABEL_MM, ax.get_ylim()[1] + _LABEL_MM)
    figure.legend(loc="outside upper right", ncols=3)  # where no joint's label can lie on it
    _draw_differences(bars, deviation)


def _draw_differences(ax: Axes, deviation: Deviation) -> None:
    first = 0 if deviation.foot_seen else 1
    joints = np.arange(first, len(deviation.bent))
    error = None if deviation.error is None else np.degrees(deviation.error[first:])
    ax.bar(joints, np.degrees(deviation.difference[first:]), color=palette.REAL, width=0.6)
    if error is not None:
        ax.errorbar(
            joints, np.degrees(deviation.difference[first:]), yerr=error, fmt="none",
            ecolor=palette.SHADES["scale"], capsize=2,
        )  # fmt: skip
    ax.axhline(0, linewidth=0.6, color=palette.SHADES["scale"])
    ax.set(xlabel="joint", ylabel="bent - target [deg]", xticks=joints)
