"""The figures of a diagnosis: errors on runs held out, what is missing, what candidates gain."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose import Dependence, Errors, MissingForceAnalysis, digits
from workbench.report import palette
from workbench.report.drawing import drawn, legend
from workbench.report.evidence_plots import draw_errors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Bar", "coordinate_figure", "force_figure", "gain_figure", "residual_figure"]

Array = NDArray[np.float64]

_BAND = 2.0  # deviations to either side: 95 of 100 samples
_MOST_BARS = 12
_LEAST_SHOWN = 0.1  # of a gain: less is as good as nothing
_COLUMNS = (("estimated", "estimated"), ("fitted", "fitted"))
_PLACES = (52, 92)  # of the columns of numbers, right of the axes [pt]
_MILLI = 1000.0
_PIECES = 18  # of as many samples along a coordinate, for each of which a median is drawn
_WIDE = (0.5, 99.5)  # percentiles of the force that are drawn
_ROWS = ("forward", "up")
_SHOWN = {"m": (1000.0, "mm")}
"""Unit of a coordinate -> factor and unit that it is shown in; others stay as they are."""


@dataclass(frozen=True)
class Bar:
    """What a candidate, or several together, gains.

    Args:
        names: of the candidates.
        estimated: before it was fitted; None where it was not estimated.
        fitted: when it was; None where it was not.
        taken: whether the answer lists it.
    """

    names: tuple[str, ...]
    estimated: float | None
    fitted: float | None
    taken: bool

    @property
    def most(self) -> float:
        """Return the gain when fitted, else the estimate."""
        return self.fitted if self.fitted is not None else self.estimated or 0.0


def force_figure(missing: MissingForceAnalysis) -> Figure:
    """Draw the missing force at T against time in the run that misses most.

    The band is twice what the cameras' noise alone makes, to either side.
    """
    one = missing.worst
    usable = np.where(one.usable, 1.0, np.nan)[:, None]
    force = _MILLI * one.force * usable
    band = _BAND * _MILLI * np.sqrt(np.diag(one.response.noise))

    def draw(figure: Figure) -> None:
        rows = figure.subplots(2, 1, sharex=True, sharey=True)
        for k, (ax, name) in enumerate(zip(rows, _ROWS, strict=True)):
            ax.axhspan(-band[k], band[k], linewidth=0, color=palette.SHADES["scale"], alpha=0.25,
                       label="noise alone")  # fmt: skip
            ax.plot(one.times, force[:, k], color=palette.SHADES["force"], label="missing")
            ax.set(ylabel=f"{name} [mN]")
        rows[0].set_title(f"missing force at T in {_short(one.run)}")
        legend(rows[0])
        rows[-1].set_xlabel("time [s]")

    return drawn(draw, 3.6)


def coordinate_figure(missing: MissingForceAnalysis) -> Figure:
    """Draw the missing force of all runs against the coordinate that explains most.

    Dots are samples, each run in its colour; the line is the median over pieces of the coordinate.
    """
    best = missing.dependences[0]
    factor, unit = _SHOWN.get(best.unit, (1.0, best.unit))
    runs = [one for one in missing.forces if best.name in one.coordinates]
    where = [factor * _folded(best, one.coordinates[best.name][one.usable]) for one in runs]
    forces = [_MILLI * one.force[one.usable] @ best.direction for one in runs]

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        for k, (one, at, force) in enumerate(zip(runs, where, forces, strict=True), start=1):
            color = palette.run_color(k)
            ax.plot(at, force, ".", markersize=3, alpha=0.5, color=color)
            ax.plot([], [], "o", markersize=5, color=color, label=_short(one.run))
        every, values = np.concatenate(where), np.concatenate(forces)
        ax.plot(
            *_medians(every, values), color=palette.SHADES["force"], linewidth=2.2, label="median"
        )
        low, high = np.percentile(values, _WIDE)
        wide = 0.15 * (high - low)
        ax.set(
            xlabel=f"{best.name} [{unit}]",
            ylabel=f"{best.where} [mN]",
            ylim=(low - wide, high + wide),
        )
        figure.legend(loc="outside lower center", ncols=4)

    return drawn(draw, 3.2 + 0.15 * (len(runs) // 4))


def _short(run: str) -> str:
    """Return a run's name without its day and time."""
    return re.sub(r"^\d{4}-\d\d-\d\d_\d+_", "", run)


def _folded(best: Dependence, values: Array) -> Array:
    """Return an angle within one turn, every other coordinate as it is."""
    return np.mod(values, 2 * np.pi) if best.unit == "rad" else values


def _medians(at: Array, values: Array) -> tuple[Array, Array]:
    """Return places along a coordinate and the median of values around each."""
    pieces = np.array_split(np.argsort(at, kind="stable"), _PIECES)
    kept = [piece for piece in pieces if len(piece)]
    return (
        np.array([np.median(at[piece]) for piece in kept]),
        np.array([np.median(values[piece]) for piece in kept]),
    )


def gain_figure(bars: Sequence[Bar], threshold: float) -> Figure:
    """Draw what candidates were estimated to gain as bars, and what they gained as diamonds.

    Args:
        bars: best first; the best are drawn.
        threshold: less may be chance.
    """
    shown = sorted(bars, key=lambda one: -one.most)[:_MOST_BARS]
    sizes = [value for one in shown for value in (one.estimated, one.fitted) if value is not None]

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        for row, one in enumerate(shown):
            _draw_bar(ax, row, one)
        ax.axvline(threshold, color=palette.SHADES["amps"], linewidth=1.2)
        ax.annotate(f"threshold {digits(threshold)}", (threshold, 1.0), xytext=(0, 2), va="bottom",
                    ha="right", xycoords=("data", "axes fraction"), textcoords="offset points",
                    color=palette.SHADES["amps"])  # fmt: skip
        for (name, _), at in zip(_COLUMNS, _PLACES, strict=True):
            ax.annotate(name, (1.0, 1.0), xytext=(at, 2), xycoords="axes fraction", ha="right",
                        va="bottom", textcoords="offset points")  # fmt: skip
        ax.set(xscale="log", xlim=(_LEAST_SHOWN, 2 * max([threshold, *sizes])))
        ax.set_yticks(range(len(shown)), [_spoken(one.names) for one in shown])
        ax.set_ylim(len(shown) - 0.5, -0.6)
        ax.xaxis.set_major_formatter("{x:g}")
        ax.grid(visible=False, axis="y")
        ax.set_xlabel("gain in log-likelihood over the base")

    return drawn(draw, 1.0 + 0.28 * max(len(shown), 1))


def _draw_bar(ax: Axes, row: int, one: Bar) -> None:
    color = palette.EXTENDED if one.taken else palette.TWIN
    if one.estimated is not None and one.estimated > _LEAST_SHOWN:
        ax.barh(row, one.estimated, 0.62, color=color, alpha=0.45)
    if one.fitted is not None and one.fitted > _LEAST_SHOWN:
        ax.plot([one.fitted], [row], "D", color=color, markersize=6)
    for (_, key), at in zip(_COLUMNS, _PLACES, strict=True):
        value = getattr(one, key)
        ax.annotate("" if value is None else digits(value), (1.0, row), xytext=(at, 0), ha="right",
                    xycoords=("axes fraction", "data"), textcoords="offset points",
                    va="center")  # fmt: skip


def residual_figure(base: Errors, extended: Errors, run: str) -> Figure:
    """Draw the errors of base and extended model over time in a run held out, beside the noise."""
    errors = {"base": (base.over_time[run], palette.TWIN),
              "extended": (extended.over_time[run], palette.EXTENDED)}  # fmt: skip

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        draw_errors(ax, errors, base.noise[run], base.unit)
        ax.set_xlabel("time [s]")
        legend(ax)

    return drawn(draw, 2.8)


def _spoken(names: Sequence[str]) -> str:
    words = [name.replace("_", " ") for name in names]
    return " + ".join(words) if len(words) < 3 else f"{words[-1]} + {len(words) - 1} others"
