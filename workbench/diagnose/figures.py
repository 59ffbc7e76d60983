"""The figures of a diagnosis: traces with their noise, spectra of what is left, scores."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.answer import LEAST_WORTH
from workbench.diagnose.diagnosis import Diagnosis
from workbench.diagnose.leftover import Density, Trace
from workbench.diagnose.wording import digits
from workbench.review import palette
from workbench.review.drawing import drawn, legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["label", "score_figure", "spectrum_figure", "trace_figure"]

_UNITS = ("m", "rad")  # that may end a channel's name
_BAND = 2.0  # noise deviations to either side: 95 of 100 samples
_SWINGS = 2.0  # that the close-up shows: in more, lines a noise apart fall together
_NOISE = palette.SHADES["scale"]
_TICKS = (1.0, 3.0)  # of each decade
_MOST_BARS = 10
_LEAST_SHOWN = 1.0  # of worth: less is as good as nothing
_SHOWN = {"m": (1000.0, "mm"), "m/s": (1000.0, "mm/s")}
"""Unit of a channel -> factor and unit that it is shown in; others stay as they are."""


def label(channel: str) -> str:
    """Return a channel's name for people, `top x` for `top_x_m`."""
    name, _, unit = channel.rpartition("_")
    return (name if unit in _UNITS else channel).replace("_", " ")


def trace_figure(traces: Sequence[Trace]) -> Figure:
    """Draw channels of a run: a close-up where the base is worst, and below what is left all along.

    The band is twice the noise to either side: about the samples where measured, about zero where
    what is left.

    Args:
        traces: one or more, each gets two panels.
    """

    def draw(figure: Figure) -> None:
        ratios = (1.5, 1.0) * len(traces)
        rows = figure.subplots(2 * len(traces), 1, squeeze=False, height_ratios=ratios)[:, 0]
        for near, left, trace in zip(rows[::2], rows[1::2], traces, strict=True):
            window = _close_up(trace)
            _draw_close(near, trace, window)
            _draw_left(left, trace, window)
        legend(rows[0])

    return drawn(draw, 0.3 + 3.5 * len(traces))


def spectrum_figure(traces: Sequence[Trace], densities: Sequence[Density]) -> Figure:
    """Draw the spectra of what is left of channels, before and after, over that of their noise.

    Args:
        traces: the channels.
        densities: of each.
    """
    from matplotlib.ticker import LogLocator, NullFormatter

    def draw(figure: Figure) -> None:
        rows = figure.subplots(len(traces), 1, squeeze=False, sharex=True)[:, 0]
        for ax, trace, one in zip(rows, traces, densities, strict=True):
            factor, unit = _shown(trace.unit)
            moving = one.hz > 0
            ax.fill_between(one.hz[moving], factor * one.noise[moving], color=_NOISE, alpha=0.25,
                            linewidth=0, label="noise")  # fmt: skip
            ax.plot(one.hz[moving], factor * one.before[moving], color=palette.TWIN, label="base")
            if one.after is not None:
                ax.plot(one.hz[moving], factor * one.after[moving], color=palette.EXTENDED,
                        label="extended")  # fmt: skip
            ax.set(xscale="log", yscale="log", title=_title(trace))
            ax.set_ylabel(f"left [{unit}/\N{SQUARE ROOT}Hz]")
            ax.xaxis.set_major_formatter("{x:g}")
            ax.yaxis.set_major_locator(LogLocator(subs=_TICKS))
            ax.yaxis.set_major_formatter("{x:g}")
            ax.yaxis.set_minor_formatter(NullFormatter())
        legend(rows[0])
        rows[-1].set_xlabel("frequency [Hz]")

    return drawn(draw, 0.5 + 2.0 * len(traces))


def score_figure(found: Diagnosis) -> Figure:
    """Draw what each cause is worth as bars, with the threshold; marks are refits of whole runs.

    Bars are foretold from the neighbourhood of the base. Pairs were refitted only.
    """
    singles = {score.causes: score.worth for score in found.refits.scores}
    refitted = {
        one.causes: found.refits.worth(one) for one in (*found.refits.singles, *found.refits.pairs)
    }
    best = dict.fromkeys((*singles, *refitted), 0.0)
    best = {causes: max(singles.get(causes, 0.0), refitted.get(causes, 0.0)) for causes in best}
    shown = sorted(best, key=lambda one: -best[one])[:_MOST_BARS]
    threshold = max(LEAST_WORTH, found.refits.threshold) + found.refits.misjudged

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        for row, causes in enumerate(shown):
            taken = set(causes) <= set(found.answer.causes)
            color = palette.EXTENDED if taken else palette.TWIN
            if singles.get(causes, 0.0) > _LEAST_SHOWN:
                ax.barh(row, singles[causes], 0.62, color=color, alpha=0.45)
            if refitted.get(causes, 0.0) > _LEAST_SHOWN:
                ax.plot([refitted[causes]], [row], "D", color=color, markersize=6)
            ax.annotate(digits(best[causes]), (1.0, row), xycoords=("axes fraction", "data"),
                        xytext=(4, 0), textcoords="offset points", va="center")  # fmt: skip
        ax.axvline(threshold, color=palette.SHADES["amps"], linewidth=1.2)
        ax.annotate(f"threshold {digits(threshold)}", (threshold, 1.0), xytext=(4, 2), va="bottom",
                    xycoords=("data", "axes fraction"), textcoords="offset points",
                    color=palette.SHADES["amps"])  # fmt: skip
        ax.set(xscale="log", xlim=(_LEAST_SHOWN, 2 * max([threshold, *best.values()])))
        ax.set_yticks(range(len(shown)), [" + ".join(map(_spoken, causes)) for causes in shown])
        ax.set_ylim(len(shown) - 0.5, -0.6)
        ax.xaxis.set_major_formatter("{x:g}")
        ax.grid(visible=False, axis="y")
        ax.set_xlabel("worth: logarithm of how much more likely it makes the runs")

    return drawn(draw, 0.9 + 0.28 * max(len(shown), 1))


def _draw_close(ax: Axes, trace: Trace, window: NDArray[np.bool_]) -> None:
    factor, unit = _shown(trace.unit)
    times, measured = trace.times[window], factor * trace.measured[window]
    band = _BAND * factor * trace.sigma
    ax.fill_between(times, measured - band, measured + band, color=palette.REAL, alpha=0.25,
                    linewidth=0, label="measured")  # fmt: skip
    ax.plot(times, measured, ".", color=palette.REAL, markersize=4)
    ax.plot(times, factor * trace.base[window], color=palette.TWIN, label="base")
    if trace.extended is not None:
        ax.plot(times, factor * trace.extended[window], color=palette.EXTENDED, label="extended")
    ax.set(title=_title(trace), ylabel=f"[{unit}]")


def _draw_left(ax: Axes, trace: Trace, window: NDArray[np.bool_]) -> None:
    factor, unit = _shown(trace.unit)
    band = _BAND * factor * trace.sigma
    ax.axhspan(-band, band, color=palette.REAL, alpha=0.25, linewidth=0)
    near = trace.times[window]
    ax.axvspan(near[0], near[-1], color=_NOISE, alpha=0.15, linewidth=0)
    models = ((trace.base, palette.TWIN), (trace.extended, palette.EXTENDED))
    for predicted, color in models:
        if predicted is not None:
            left = factor * (trace.measured - predicted)
            ax.plot(trace.times, left, color=color, linewidth=0.7)
    ax.set(ylabel=f"left [{unit}]", xlabel="time [s]")


def _close_up(trace: Trace) -> NDArray[np.bool_]:
    """Return the samples of a few swings around where the base is worst, (n,)."""
    seen = np.isfinite(trace.measured)
    moved = np.where(seen, trace.measured - np.nanmean(trace.measured[seen]), 0.0)
    swing = np.argmax(np.abs(np.fft.rfft(moved))[1:]) + 1  # swings in the whole run
    length = min(max(round(_SWINGS * len(moved) / swing), 2), len(moved))
    missed = np.where(seen, trace.measured - trace.base, 0.0) ** 2
    sums = np.concatenate([[0.0], np.cumsum(missed)])
    begin = int(np.argmax(sums[length:] - sums[:-length]))
    chosen = np.zeros(len(moved), dtype=bool)
    chosen[begin : begin + length] = True
    return chosen


def _title(trace: Trace) -> str:
    return f"{label(trace.channel)} of {trace.run}"


def _shown(unit: str) -> tuple[float, str]:
    return _SHOWN.get(unit, (1.0, unit))


def _spoken(cause: str) -> str:
    return cause.replace("_", " ")
