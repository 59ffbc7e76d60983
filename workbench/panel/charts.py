"""Charts as SVG without a script: curves over time, and control charts."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.catalogue import Trend

__all__ = ["Curve", "control_chart", "curves_chart"]

_WIDTH, _LEFT, _BOTTOM, _TOP, _RIGHT = 640, 84, 34, 10, 12
_MOST_POINTS = 1200  # of a curve: twice the pixels of a chart


class Curve(NamedTuple):
    """One line.

    Args:
        times: (n,) [s].
        values: (n,) NaN where not known [unit of the chart].
        style: its classes.
    """

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    style: str


class _Axes:
    """Scales of a chart and their drawing."""

    def __init__(self, x: tuple[float, float], y: tuple[float, float], height: int) -> None:
        self._x, self._y, self.height = _widened(*x), _widened(*y), height

    def at(self, x: float, y: float) -> tuple[float, float]:
        (x0, x1), (y0, y1) = self._x, self._y
        across = _LEFT + (x - x0) / (x1 - x0) * (_WIDTH - _LEFT - _RIGHT)
        down = self.height - _BOTTOM - (y - y0) / (y1 - y0) * (self.height - _BOTTOM - _TOP)
        return round(across, 1), round(down, 1)

    def drawn(self, across: str, title: str, least: float = 0.0) -> str:
        """Return grid, numbers and titles; numbers across are at least so far apart."""
        parts = []
        for value in _ticks(*self._y):
            x, y = self.at(self._x[0], value)
            parts.append(f'<line class="grid" x1="{x}" x2="{_WIDTH - _RIGHT}" y1="{y}" y2="{y}"/>')
            parts.append(f'<text x="{x - 6}" y="{y + 4}" text-anchor="end">{value:g}</text>')
        for value in _ticks(*self._x, least):
            x, y = self.at(value, self._y[0])
            parts.append(f'<text x="{x}" y="{y + 16}" text-anchor="middle">{value:g}</text>')
        parts.append(
            f'<text x="{_WIDTH - _RIGHT}" y="{self.height - 4}" text-anchor="end">'
            f"{escape(across)}</text>"
        )
        return (
            f'<svg viewBox="0 0 {_WIDTH} {self.height}" role="img" aria-label="{escape(title)}">'
            + "".join(parts)
        )


def curves_chart(title: str, unit: str, curves: Sequence[Curve]) -> str:
    """Return a chart of curves over time."""
    thin = [curve for curve in map(_thinned, curves) if np.isfinite(curve.values).any()]
    if not thin:
        return ""
    x = [curve.times[end] for curve in thin for end in (0, -1)]
    y = [f(curve.values) for curve in thin for f in (np.nanmin, np.nanmax)]
    axes = _Axes((min(x), max(x)), (min(y), max(y)), 260)
    lines = "".join(f'<path class="{c.style}" d="{_path(axes, c)}"/>' for c in thin)
    return (
        f"<figure><figcaption>{escape(title)} [{escape(unit)}]</figcaption>"
        f"{axes.drawn('time [s]', title)}{lines}</svg></figure>"
    )


def control_chart(trend: Trend) -> str:
    """Return the chart of one quantity, a dot a run, with its control limits."""
    n, limits = len(trend.values), trend.limits
    bounds = [*trend.values, *(limits or ())]
    axes = _Axes((0.5, n + 0.5), (min(bounds), max(bounds)), 220)
    parts = []
    for value, style in zip(limits or (), ("limit", "centre", "limit"), strict=False):
        (x0, y), (x1, _) = axes.at(0.5, value), axes.at(n + 0.5, value)
        parts.append(f'<line class="{style}" x1="{x0}" x2="{x1}" y1="{y}" y2="{y}"/>')
    line = Curve(np.arange(1.0, n + 1), trend.values, "")
    parts.append(f'<path class="trend" d="{_path(axes, line)}"/>')
    for k, (name, value, out) in enumerate(
        zip(trend.names, trend.values, trend.signals, strict=True), start=1
    ):
        x, y = axes.at(k, value)
        parts.append(
            f'<circle class="{"out" if out else "dot"}" cx="{x}" cy="{y}" r="{5 if out else 3}">'
            f"<title>{escape(name)}: {value:.4g} {escape(trend.unit)}</title></circle>"
        )
    unit = f" [{trend.unit}]" if trend.unit else ""
    head = f"<figure><figcaption>{escape(trend.title)}{escape(unit)}: {escape(_verdict(trend))}"
    drawn = axes.drawn(f"{trend.each}, oldest first", trend.title, 1.0)
    return f"{head}</figcaption>{drawn}{''.join(parts)}</svg></figure>"


def _verdict(trend: Trend) -> str:
    if trend.limits is None:
        return f"fewer than five {trend.each}s, so no control limits"
    lower, centre, upper = trend.limits
    usual = f"mean {centre:.4g}, limits {lower:.4g} to {upper:.4g}"
    count = int(trend.signals.sum())
    if not count:
        return f"in control; {usual}"
    first = trend.names[int(np.argmax(trend.signals))]
    return f"OUT OF CONTROL in {count} of {len(trend.values)} {trend.each}s, first {first}; {usual}"


def _thinned(curve: Curve) -> Curve:
    """Return the least and the greatest value of each of many equal stretches."""
    n, per = len(curve.values), 2 * len(curve.values) // _MOST_POINTS
    if per < 2:
        return curve
    whole = n - n % per
    blocks = curve.values[:whole].reshape(-1, per)
    filled = np.isfinite(blocks)
    low = np.where(filled, blocks, np.inf).argmin(axis=1)
    high = np.where(filled, blocks, -np.inf).argmax(axis=1)
    columns = np.sort(np.stack([low, high], axis=1), axis=1) + np.arange(0, whole, per)[:, None]
    return Curve(curve.times[columns.ravel()], curve.values[columns.ravel()], curve.style)


def _path(axes: _Axes, curve: Curve) -> str:
    """Return the line, broken where nothing is known."""
    parts, pen = [], "M"
    for x, y in zip(curve.times.tolist(), curve.values.tolist(), strict=True):
        if y != y:
            pen = "M"
            continue
        across, down = axes.at(x, y)
        parts.append(f"{pen}{across:g} {down:g}")
        pen = "L"
    return "".join(parts)


def _widened(low: float, high: float) -> tuple[float, float]:
    room = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
    return low - room, high + room


def _ticks(low: float, high: float, least: float = 0.0) -> list[float]:
    """Return three to seven round numbers between two."""
    rough = max((high - low) / 5, least)
    power = 10.0 ** np.floor(np.log10(rough))
    step = float(next(k * power for k in (1, 2, 5, 10) if k * power >= rough))
    return [round(k * step, 12) for k in range(int(np.ceil(low / step)), int(high / step) + 1)]
