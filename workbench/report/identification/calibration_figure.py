"""Figure 5.3 of the thesis from the lab's runs: speed over voltage, and what the line leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.identify import CONFIDENCE, SpeedCalibration, SpeedLine

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure_5_3"]

_SIZE_IN = (9.0, 3.6)
_LINE = "#c2410c"
_KINDS = {"clamped": ("o", "#0b5cad"), "hop": ("^", "#0f8a78"), "held out": ("s", "#6b7280")}
"""Kind of run -> marker, colour."""
_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "workbench",  # the same runs give the same file
}
_CURVE_POINTS = 200


def figure_5_3(calibration: SpeedCalibration) -> Figure:
    """Draw measured speeds and the line over voltage, and beside it what the line leaves.

    Bars are 90 %: of one run's own error and the scatter from run to run together. The band is the
    line's own interval.

    Args:
        calibration: with a line.

    Raises:
        InputError: when the runs determine no line.
    """
    from matplotlib import figure, rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    line = calibration.line
    if line is None:
        raise InputError(f"there is no line to draw: {calibration.open}")
    with rc_context(_STYLE):
        page = figure.Figure(figsize=_SIZE_IN, layout="constrained")
        FigureCanvasSVG(page)
        left, right = page.subplots(1, 2, gridspec_kw={"width_ratios": (1.15, 1)})
        volts = np.linspace(line.voltages.min(), line.voltages.max(), _CURVE_POINTS)
        left.plot(volts, line.at(volts), color=_LINE, label=_equation(line))
        _points(left, calibration, line, residual=False)
        left.set(xlabel="Voltage [V]", ylabel="\N{GREEK SMALL LETTER OMEGA} [rad/s]")
        left.set_title("Speed-voltage line", loc="left")
        left.legend(loc="upper left")
        _residuals(right, calibration, line, volts)
        return page


def _residuals(
    ax: Axes, calibration: SpeedCalibration, line: SpeedLine, volts: NDArray[np.float64]
) -> None:
    half = line.half_width(volts)
    band = ax.fill_between(
        volts, -half, half, color=_LINE, alpha=0.18, linewidth=0, label="line, 90 %"
    )
    ax.axhline(0, color=_LINE, linewidth=1)
    _points(ax, calibration, line, residual=True)
    ax.set(xlabel="Voltage [V]", ylabel="measured - line [rad/s]")
    found = [name.replace("_", " ") for name, one in calibration.checks.items() if one.found]
    text = f"\nfound: {', '.join(found)}" if found else ""
    ax.set_title(f"Residuals, scatter {line.scatter:.2g} rad/s{text}", loc="left")
    ax.legend(handles=[band], loc="upper right")


def _points(ax: Axes, calibration: SpeedCalibration, line: SpeedLine, residual: bool) -> None:
    kinds = {
        mode: [point for point in line.points if point.mode == mode] for mode in ("clamped", "hop")
    }
    kinds["held out"] = list(calibration.held_out)
    for name, points in kinds.items():
        if points:
            marker, color = _KINDS[name]
            errors = np.hypot([point.standard_error for point in points], line.scatter)
            ax.errorbar(
                [point.voltage for point in points],
                [line.residual(point) if residual else point.speed for point in points],
                yerr=scipy.stats.norm.ppf((1 + CONFIDENCE) / 2) * errors,
                fmt=marker,
                color=color,
                markerfacecolor="none" if name == "held out" else color,
                markersize=4,
                capsize=2,
                elinewidth=0.9,
                label=f"{name}, 90 %",
            )


def _equation(line: SpeedLine) -> str:
    offset = line.offset.value
    sign = "-" if offset < 0 else "+"
    return f"\N{GREEK SMALL LETTER OMEGA} = {line.slope.value:.4g} U {sign} {abs(offset):.4g}"
