"""The figures of the report, as SVG elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.motion import FOOT, FOOT_ERROR, ROTOR_SPEED, TOP, TOP_ERROR
from workbench.report import palette
from workbench.report.comparison import NOISE_WIDTH, Comparison
from workbench.report.drawing import as_svg, drawn, legend
from workbench.timeseries import TimeSeries

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "error_plot",
    "motion_plot",
    "phase_plot",
    "seen",
    "speed_plot",
    "supply_plot",
    "trajectory_plot",
]

_BAND = 0.3  # opacity of a noise band
_LEAST_M = 0.005  # of an axis: on less, a foot that is held seems to move by the noise


def trajectory_plot(comparison: Comparison) -> str:
    """Draw the path of the foot, or of T, in x-z, the robot above and the twin below.

    The form of the thesis' figures 6.5 to 6.7; both have the same axes, which fit both paths.
    """
    x, _, z = comparison.mover

    def draw(figure: Figure) -> None:
        axes = figure.subplots(2, 1, sharex=True, sharey=True)
        for ax, motion, name, color in zip(axes, *_pair(comparison), strict=True):
            moving = motion.between(0.0, comparison.duration_s)
            ax.plot(seen(moving, x), seen(moving, z), color=color)
            ax.set(title=name, ylabel="z [m]")
        axes[1].set_xlabel("x [m]")

    return as_svg(drawn(draw, 3.6), "trajectory")


def motion_plot(comparison: Comparison) -> str:
    """Draw x and z of foot and T over time."""

    def draw(figure: Figure) -> None:
        axes = figure.subplots(4, 1, sharex=True)
        channels = {"foot x [m]": FOOT[0], "foot z [m]": FOOT[2]}
        channels |= {"T x [m]": TOP[0], "T z [m]": TOP[2]}
        for ax, (label, channel) in zip(axes, channels.items(), strict=True):
            _both(ax, comparison, channel, label)
            middle, half = np.mean(ax.get_ylim()), np.ptp(ax.get_ylim()) / 2
            if half < _LEAST_M / 2:
                ax.set_ylim(middle - _LEAST_M / 2, middle + _LEAST_M / 2)
        legend(axes[0])
        _time_axis(axes[-1], comparison.time_zero)

    return as_svg(drawn(draw, 6.0), "motion")


def speed_plot(comparison: Comparison) -> str:
    """Draw the rotor's speed over time."""

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        _both(ax, comparison, ROTOR_SPEED, "rotor speed [rad/s]")
        legend(ax)
        _time_axis(ax, comparison.time_zero)

    return as_svg(drawn(draw, 2.2), "speed")


def phase_plot(comparison: Comparison) -> str:
    """Draw by how much the twin's rotor leads the robot's, over time."""
    lag = comparison.rotor_lag()

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        ax.plot(lag.times, seen(lag, "lag_deg"), color=palette.TWIN)
        ax.set(ylabel="twin ahead by [deg]")
        _time_axis(ax, comparison.time_zero)

    return as_svg(drawn(draw, 1.8), "phase")


def error_plot(comparison: Comparison) -> str:
    """Draw the distance between robot and twin over time."""
    error = comparison.error()

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        lines = {"foot": (FOOT_ERROR, "foot"), "T": (TOP_ERROR, "top")}
        for name, (column, shade) in lines.items():
            color = palette.SHADES[shade]
            ax.plot(error.times, seen(error, column), color=color, label=name)
        noise = max(comparison.error_noise().values(), default=0.0)
        _logarithmic(ax, error, NOISE_WIDTH * noise)
        ax.set_ylabel("distance [mm]")
        legend(ax)
        _time_axis(ax, comparison.time_zero)

    return as_svg(drawn(draw, 2.2), "error")


def _logarithmic(ax: Axes, error: TimeSeries, noise: float) -> None:
    """Give an axis of distances a logarithmic scale on which the noise's band can be seen."""
    seen_of = error.values[error.valid & (error.values > 0)]
    if not len(seen_of):
        return
    low = min(noise / 4 or np.inf, float(np.percentile(seen_of, 5)))
    ax.set(yscale="log", ylim=(low, 1.3 * max(float(seen_of.max()), noise)))
    ax.axhspan(low, noise, color=palette.SHADES["noise"], alpha=_BAND, lw=0)
    ax.yaxis.set_major_formatter("{x:g}")


def supply_plot(supply: TimeSeries, time_zero: str) -> str:
    """Draw what was asked of the supply and what it read back."""
    panels = {
        "voltage [V]": {"set": ("set_voltage_V", "set_volts"), "read": ("voltage_V", "volts")},
        "current [A]": {"read": ("current_A", "amps")},
    }

    def draw(figure: Figure) -> None:
        axes = figure.subplots(2, 1, sharex=True)
        for ax, (label, lines) in zip(axes, panels.items(), strict=True):
            _supply_panel(ax, supply, lines)
            ax.set(ylabel=label, ylim=(0, None))
        legend(axes[0])
        _time_axis(axes[-1], time_zero)

    return as_svg(drawn(draw, 2.8), "supply")


def _supply_panel(ax: Axes, supply: TimeSeries, lines: Mapping[str, tuple[str, str]]) -> None:
    for name, (column, shade) in lines.items():
        ax.plot(supply.times, seen(supply, column), color=palette.SHADES[shade], label=name)


def _pair(comparison: Comparison) -> tuple[Sequence[TimeSeries], Sequence[str], Sequence[str]]:
    return (
        (comparison.real, comparison.twin),
        ("Real: the robot", "Simulated: its twin"),
        (palette.REAL, palette.TWIN),
    )


def _both(ax: Axes, comparison: Comparison, channel: str, label: str) -> None:
    real, sigma = seen(comparison.real, channel), comparison.noise.get(channel)
    if sigma is not None:
        edges = (real - NOISE_WIDTH * sigma, real + NOISE_WIDTH * sigma)
        ax.fill_between(comparison.real.times, *edges, color=palette.REAL, alpha=_BAND, lw=0)
    ax.plot(comparison.real.times, real, color=palette.REAL, label="real")
    ax.plot(comparison.twin.times, seen(comparison.twin, channel), color=palette.TWIN, label="twin")
    ax.set_ylabel(label)


def seen(series: TimeSeries, name: str) -> NDArray[np.float64]:
    """Return a channel, (n,) [unit of the channel], NaN where it was not seen."""
    return np.where(series.validity(name), series[name], np.nan)


def _time_axis(ax: Axes, time_zero: str) -> None:
    ax.set_xlabel(f"time since {time_zero} [s]")
