"""The figures that show why a model is believed or not: its error, the pose, the missing force."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from workbench.motion import FOOT, TOP, TOP_ERROR, position
from workbench.report import palette
from workbench.report.comparison import NOISE_WIDTH, Comparison, ValidationReplay
from workbench.report.drawing import as_svg, drawn, legend
from workbench.report.geometry import MISSING, beam_points, beam_root, certainty, foot_corners
from workbench.report.plots import seen
from workbench.timeseries import TimeSeries

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_errors", "missing_plot", "pose_plot", "pose_times", "validation_plot"]

_SMOOTH_S = 0.25
_INSTANTS = 4
_BAND = 0.35  # opacity of a noise band
_MILLI = 1000.0


def validation_plot(validation: ValidationReplay) -> str:
    """Draw the errors of base and extended model over time, with the noise."""

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        errors = {"base": (validation.base.error, palette.TWIN),
                  "extended": (validation.extended.error, palette.EXTENDED)}  # fmt: skip
        draw_errors(ax, errors, validation.noise_mm, "mm")
        ax.set_xlabel("time [s]")
        legend(ax)

    return as_svg(drawn(draw, 2.6), "proof")


def draw_errors(
    ax: Axes, errors: dict[str, tuple[TimeSeries, str]], noise: float, unit: str
) -> None:
    """Draw errors over time, root mean square over 0.25 s of all columns, on a logarithmic scale.

    Args:
        ax: empty.
        errors: label -> error and colour.
        noise: root mean square that noise alone makes, in the unit.
        unit: of all.
    """
    from matplotlib.ticker import LogLocator

    levels = [noise]
    for name, (error, color) in errors.items():
        size = _running(error)
        levels += [float(np.nanmin(size)), float(np.nanmax(size))]
        ax.plot(error.times, size, color=color, label=name)
    low, high = 0.7 * min(levels), 1.5 * max(*levels, NOISE_WIDTH * noise)
    ax.axhspan(low, noise, color=palette.SHADES["noise"], alpha=_BAND, lw=0)
    ax.axhline(noise, color=palette.SHADES["scale"], lw=0.8, ls="--", label="noise alone")
    ax.set(yscale="log", ylim=(low, high), ylabel=f"error [{unit}]")
    ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 50 * low else (1,)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter("")


def _running(error: TimeSeries) -> NDArray[np.float64]:
    """Return the root mean square around each sample, NaN where nothing was seen around it."""
    step = float(np.median(np.diff(error.times))) if len(error) > 1 else _SMOOTH_S
    width = max(1, round(_SMOOTH_S / step))
    squares = np.where(error.valid, error.values, 0.0) ** 2
    parts = (squares.sum(axis=1), error.valid.sum(axis=1).astype(float))
    total, count = (scipy.ndimage.uniform_filter1d(one, width, mode="constant") for one in parts)
    enough = count > 1e-9
    return np.sqrt(np.where(enough, np.maximum(total, 0.0) / np.where(enough, count, 1.0), np.nan))


def missing_plot(estimate: TimeSeries, time_zero: str) -> str:
    """Draw the missing force at T over time, with what may be noise."""

    def draw(figure: Figure) -> None:
        rows = figure.subplots(2, 1, sharex=True)
        for ax, name, label in zip(rows, MISSING["top"], ("forward", "up"), strict=True):
            stem, _, unit = name.rpartition("_")
            sigma = NOISE_WIDTH * _MILLI * seen(estimate, f"{stem}_sigma_{unit}")
            ax.fill_between(estimate.times, -sigma, sigma, lw=0, alpha=_BAND,
                            color=palette.SHADES["noise"], label="may be noise")  # fmt: skip
            ax.plot(estimate.times, _MILLI * seen(estimate, name), label="missing force",
                    color=palette.SHADES["missing"])  # fmt: skip
            ax.set_ylabel(f"{label} [mN]")
        legend(rows[0])
        rows[-1].set_xlabel(f"time since {time_zero} [s]")

    return as_svg(drawn(draw, 3.0), "missing")


def pose_times(comparison: Comparison) -> list[float]:
    """Return when the pose is drawn [s]: evenly over the run, last where T is farthest off."""
    whole = comparison.real.between(0.0, comparison.duration_s).times
    if not len(whole):
        return []
    even = np.linspace(whole[0], whole[-1], _INSTANTS + 1)[1:-1]
    error = comparison.error().between(0.0, comparison.duration_s)
    apart = np.where(error.validity(TOP_ERROR), error[TOP_ERROR], np.nan)
    largest = [error.times[int(np.nanargmax(apart))]] if np.isfinite(apart).any() else []
    return [*map(float, even), *map(float, largest)]


def pose_plot(comparison: Comparison) -> str:
    """Draw robot and twin from the side at some instants, the robot's beam as estimated."""
    times, figure_of = pose_times(comparison), comparison.figure
    count = max(len(times), 1)

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, count, sharex=True, sharey=True, squeeze=False)[0]
        for ax, time in zip(panels, times, strict=False):
            at = np.array([time])
            origin = position(comparison.real.at(at), FOOT)[0, 0]
            moved = -origin if np.isfinite(origin) else 0.0
            twin, real = (_moved(one.at(at), moved) for one in (comparison.twin, comparison.real))
            ax.plot(*_flat(beam_points(twin, figure_of)[0]), color=palette.TWIN, lw=1.0)
            _draw_foot(ax, twin, comparison, palette.TWIN)
            _draw_foot(ax, real, comparison, palette.REAL)
            if comparison.estimate is None:
                link = np.stack([beam_root(real, figure_of)[0], position(real, TOP)[0]])
                ax.plot(*_flat(link), color=palette.REAL, lw=0.8)
            else:
                _draw_beam(ax, _moved(comparison.estimate.at(at), moved), comparison)
            ax.plot(*_flat(position(real, TOP)), "o", color=palette.REAL, markersize=5)
            ax.set(title=f"{time:.2f} s", xlabel="x from foot [mm]", aspect="equal")
            ax.margins(0.08)
        panels[0].set_ylabel("z [mm]")

    return as_svg(drawn(draw, 3.0), "pose")


def _moved(motion: TimeSeries, forward: float) -> TimeSeries:
    """Return a motion with all its places moved forward [m]."""
    return motion.replaced({one[0]: motion[one[0]] + forward for one in (FOOT, TOP)})


def _draw_beam(ax: Axes, estimate: TimeSeries, comparison: Comparison) -> None:
    points, sure = beam_points(estimate, comparison.figure)[0], certainty(estimate)[0]
    if not np.isfinite(points).all():
        return
    for k, share in enumerate(np.nan_to_num(sure)):
        ax.plot(*_flat(points[k : k + 2]), color=palette.REAL, lw=2.0, alpha=float(share),
                solid_capstyle="butt")  # fmt: skip


def _draw_foot(ax: Axes, motion: TimeSeries, comparison: Comparison, color: str) -> None:
    half = comparison.figure.foot_length / 2
    ax.plot(*_flat(foot_corners(motion, [[-half, 0], [half, 0]])[0]), color=color, lw=2.0)


def _flat(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x and z of places (k, 3), (k,) each [mm]."""
    return _MILLI * points[:, 0], _MILLI * points[:, 2]
