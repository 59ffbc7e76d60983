"""The figures of chapter 4 of the thesis, drawn from a laboratory's own runs, and two more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.identify import (
    FrequencySurface,
    ModeDamping,
    Pair,
    ParameterEstimate,
    Resonances,
    SpectralLine,
    Spectrum,
    SweepPoint,
    label,
)
from workbench.motion import FOOT, TOP
from workbench.report import palette
from workbench.report.drawing import drawn, legend
from workbench.timeseries import TimeSeries

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["damping_figure", "figure_4_1", "figure_4_2", "figure_4_3", "figure_4_4", "figure_4_5",
           "sweep_figure"]  # fmt: skip

_ROW_IN = 1.35
_SPAN_S = 10.0  # of time, as in the thesis
_HIGHEST_HZ = 6.0  # T hardly moves faster
_X, _Z = palette.SHADES["foot"], palette.SHADES["top"]
_AXES = (("x", _X), ("z", _Z))
_DIRECTIONS = {"up": ("^", "-"), "down": ("v", "--"), "unordered": ("o", "")}
_JUMP = palette.SHADES["amps"]
_CONTOURS = 9
_NAME_HZ = 0.7  # what the name of a line takes on the axis


def figure_4_1(runs: Sequence[MeasuredRun]) -> Figure:
    """Draw the oscillation of T of some runs: z against x, and z over time.

    Args:
        runs: one row each, in the order given.

    Raises:
        InputError: when there is none.
    """
    _need(runs, "figure 4.1 needs a clamped run")

    def draw(figure: Figure) -> None:
        rows = figure.subplots(
            len(runs), 2, squeeze=False, sharex="col", sharey=True, width_ratios=(1, 2)
        )
        for (path, time), run in zip(rows, runs, strict=True):
            motion = run.motion.between(0.0, _SPAN_S)
            x, z = _seen(motion, TOP[0]), _seen(motion, TOP[2])
            path.plot(x, z, color=palette.REAL, linewidth=0.7)
            time.plot(motion.times, z, color=palette.REAL, linewidth=0.7)
            path.set(ylabel="z of T [m]", title=label(run))
        rows[-1, 0].set_xlabel("x of T [m]")
        rows[-1, 1].set_xlabel("time since the first motion [s]")

    return drawn(draw, 0.4 + _ROW_IN * len(runs))


def figure_4_2(spectra: Sequence[Spectrum]) -> Figure:
    """Draw the spectra of T's motion with their strongest lines named.

    Args:
        spectra: one row each, in the order given.

    Raises:
        InputError: when there is none.
    """
    _need(spectra, "figure 4.2 needs a spectrum")

    def draw(figure: Figure) -> None:
        rows = figure.subplots(len(spectra), 1, squeeze=False, sharex=True)[:, 0]
        for ax, one in zip(rows, spectra, strict=True):
            for (name, color), amplitude in zip(_AXES, one.amplitude.T, strict=True):
                ax.plot(one.hz, 1000 * amplitude, color=color, label=f"{name} of T")
            _name_lines(
                ax, [line for line in one.lines[:3] if line.hz <= _HIGHEST_HZ and not line.overtone]
            )
            driven = f"driven at {abs(one.speed):.1f} rad/s" if one.speed else "after the release"
            ax.set(title=driven, ylabel="amplitude [mm]", xlim=(0, _HIGHEST_HZ))
            ax.set_ylim(0, 1300 * float(one.amplitude.max()))
        legend(rows[0])
        rows[-1].set_xlabel("frequency [Hz]")

    return drawn(draw, 0.4 + 1.3 * _ROW_IN * len(spectra))


def figure_4_3(
    surface: FrequencySurface,
    identified: Mapping[str, ParameterEstimate],
    measured: tuple[float, float] | None = None,
) -> Figure:
    """Draw the longitudinal frequency over both stiffnesses, as contours, with the point found.

    Args:
        surface: from `frequency_surface`.
        identified: estimates of a fit; those of hinge_stiffness and root_stiffness are shown.
        measured: longitudinal frequency and its error from data [Hz], for its own contour.
    """

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        lines = ax.contour(surface.hinge, surface.root, surface.hz.T, _CONTOURS,
                           colors=palette.TWIN, linewidths=0.8)  # fmt: skip
        ax.clabel(lines, fmt="%.2f Hz", fontsize=8)
        if measured is not None:
            hz, error = measured
            band = [hz - error, hz, hz + error] if error > 0 else [hz]
            ax.contour(surface.hinge, surface.root, surface.hz.T, band, colors=palette.REAL,
                       linewidths=[0.6, 1.6, 0.6][: len(band)])  # fmt: skip
            ax.plot([], [], color=palette.REAL, label=f"measured, {hz:.3f} Hz")
        _mark_found(ax, surface, identified)
        ax.set_xlabel("k, stiffness of a hinge [N m/rad]")
        ax.set_ylabel("kT, stiffness of the root [N m/rad]")
        legend(ax)

    return drawn(draw, 3.8)


def figure_4_4(pairs: Sequence[Pair]) -> Figure:
    """Draw z of T over time at several speeds, the simulated over the measured.

    Args:
        pairs: one row each, in the order given; they need z of T.

    Raises:
        InputError: when there is none.
    """
    _need(pairs, "figure 4.4 needs a run and its simulation")

    def draw(figure: Figure) -> None:
        rows = figure.subplots(len(pairs), 1, squeeze=False, sharex=True, sharey=True)[:, 0]
        for ax, pair in zip(rows, pairs, strict=True):
            for motion, name, color, width in (
                (pair.measured, "measured", palette.REAL, 1.8),
                (pair.simulated, "simulated", palette.TWIN, 0.8),
            ):
                window = motion.between(0.0, _SPAN_S)
                ax.plot(window.times, 1000 * _seen(window, TOP[2]), color=color, linewidth=width,
                        label=name)  # fmt: skip
            ax.set(title=pair.label, ylabel="z of T [mm]")
        legend(rows[0])
        rows[-1].set_xlabel("time [s]")

    return drawn(draw, 0.4 + _ROW_IN * len(pairs))


def figure_4_5(pair: Pair) -> Figure:
    """Draw the foot's path of a hopping run: measured above, simulated below, on the same axes.

    Args:
        pair: it needs x and z of the foot.
    """

    def draw(figure: Figure) -> None:
        rows = figure.subplots(2, 1, sharex=True, sharey=True)
        names = ("measured", "simulated")
        colors, motions = (palette.REAL, palette.TWIN), (pair.measured, pair.simulated)
        for ax, name, color, motion in zip(rows, names, colors, motions, strict=True):
            window = motion.between(0.0, _SPAN_S)
            ax.plot(_seen(window, FOOT[0]), _seen(window, FOOT[2]), color=color)
            ax.set(title=f"{pair.label}, {name}", ylabel="z of the foot [m]")
        rows[-1].set_xlabel("x of the foot [m]")

    return drawn(draw, 3.6)


def sweep_figure(found: Resonances) -> Figure:
    """Draw T's amplitude and its lag behind the rotor's pull over the speed, up and down.

    Hollow marks were not steady. Peaks have their name; a jump between two speeds is a band, a
    double period a cross at its own amplitude.

    Raises:
        InputError: when no speed of a sweep was measured.
    """
    _need(found.points, "amplitude and phase need a clamped sweep")

    def draw(figure: Figure) -> None:
        rows = figure.subplots(4, 1, sharex=True, height_ratios=(1.4, 1.4, 1, 1))
        for axis, (name, color) in enumerate(_AXES):
            _draw_axis(rows[axis], rows[2 + axis], found.points, axis, color)
            rows[axis].set(ylabel=f"{name} of T [mm]")
            rows[2 + axis].set(ylabel=f"lag of {name} [deg]", ylim=(-190, 190))
            rows[2 + axis].set_yticks([-180, -90, 0, 90, 180])
        _mark_jumps(rows, found)
        for peak in found.peaks:
            if peak.direction != "down":
                rows[0].annotate(
                    f"{peak.oscillation}\n{peak.speed:.2f} \N{PLUS-MINUS SIGN} "
                    f"{peak.speed_error:.2f} rad/s", (peak.speed, 1000 * peak.amplitude[0]),
                    xytext=(-8, 8), textcoords="offset points", ha="right", va="bottom", fontsize=8,
                )  # fmt: skip
        for ax in rows[:2]:
            ax.set_ylim(0, None)
        legend(rows[0])
        rows[-1].set_xlabel("speed of the rotor [rad/s]")

    return drawn(draw, 6.6)


def damping_figure(modes: Sequence[ModeDamping]) -> Figure:
    """Draw damping ratio and frequency of each mode against its amplitude, with the mean.

    Raises:
        InputError: when there is no mode.
    """
    _need(modes, "damping against amplitude needs ring-downs")

    def draw(figure: Figure) -> None:
        rows = figure.subplots(2, len(modes), squeeze=False, sharex="col")
        colors = {"torsional": _X, "longitudinal": _Z}
        for (above, below), mode in zip(rows.T, modes, strict=True):
            color = colors[mode.oscillation]
            size = [1000 * point.amplitude for point in mode.points]
            _bars(above, size, [100 * p.ratio for p in mode.points],
                  [100 * p.ratio_error for p in mode.points], color)  # fmt: skip
            above.axhline(100 * mode.ratio, color=color, linewidth=0.8)
            above.axhspan(*(100 * r for r in mode.interval90), color=color, alpha=0.15, linewidth=0)
            _bars(
                below, size, [p.hz for p in mode.points], [p.hz_error for p in mode.points], color
            )
            above.set(title=f"{mode.oscillation}, {mode.hz:.3f} Hz", ylim=(0, None))
            below.set_xlabel("amplitude of T [mm]")
        rows[0, 0].set_ylabel("damping ratio [%]")
        rows[1, 0].set_ylabel("frequency [Hz]")

    return drawn(draw, 3.6)


def _draw_axis(
    size: Axes, phase: Axes, points: Sequence[SweepPoint], axis: int, color: str
) -> None:
    for direction, (marker, style) in _DIRECTIONS.items():
        leg = sorted((p for p in points if p.direction == direction), key=lambda p: p.speed)
        if not leg:
            continue
        speed = [p.speed for p in leg]
        amplitude = [1000 * float(p.amplitude()[axis]) for p in leg]
        error = [1000 * float(p.amplitude_error()[axis]) for p in leg]
        size.plot(speed, amplitude, style or "none", color=color, linewidth=0.8)
        phase.plot(speed, [np.degrees(p.lag[axis]) for p in leg], marker, color=color, markersize=4)
        size.errorbar(speed, amplitude, error, fmt="none", ecolor=color, elinewidth=0.8)
        for steady in (True, False):
            chosen = [k for k, p in enumerate(leg) if p.steady is steady]
            name = direction if steady else f"{direction}, not steady"
            if chosen:
                size.plot([speed[k] for k in chosen], [amplitude[k] for k in chosen], marker,
                          color=color, markersize=5, markerfacecolor=color if steady else "none",
                          label=name)  # fmt: skip


def _mark_jumps(rows: NDArray[np.object_], found: Resonances) -> None:
    named: set[str] = set()
    for jump in found.jumps:
        name = "" if jump.kind in named else jump.kind
        named.add(jump.kind)
        if jump.kind == "along the sweep":
            for ax in rows[:2]:
                ax.axvspan(*jump.speeds, color=_JUMP, alpha=0.12, linewidth=0,
                           label=f"jump {name}" if name else None)  # fmt: skip
        elif jump.kind == "up against down":
            rows[0].axvline(jump.speeds[0], color=_JUMP, linestyle=":", label=name or None)
    for point in found.points:
        if any(j.kind == "period doubled" and j.speeds[0] == point.speed for j in found.jumps):
            for axis, ax in enumerate(rows[:2]):
                half = 1000 * float(point.amplitude(0.5)[axis])
                named_now = axis == 0 and "half" not in named
                named |= {"half"} if named_now else set()
                ax.plot([point.speed], [half], "x", color=_JUMP, markersize=6,
                        label="at half the rotor's speed" if named_now else None)  # fmt: skip


def _name_lines(ax: Axes, lines: Sequence[SpectralLine]) -> None:
    """Write names above lines; of two close ones the left name goes left, the right one right."""
    ordered = sorted(lines, key=lambda line: line.hz)
    gaps = [np.inf, *np.diff([line.hz for line in ordered]), np.inf]
    for line, before, after in zip(ordered, gaps, gaps[1:], strict=False):
        side = "center" if min(before, after) > _NAME_HZ else "left" if before < after else "right"
        height = 1000 * max(line.amplitude)
        ax.annotate(f"{line.name}\n{line.hz:.3f} Hz", (line.hz, height), xytext=(0, 3),
                    textcoords="offset points", ha=side, va="bottom", fontsize=8)  # fmt: skip


def _mark_found(
    ax: Axes, surface: FrequencySurface, identified: Mapping[str, ParameterEstimate]
) -> None:
    """Mark the identified stiffnesses, and the stated ones beside them."""
    k, root = identified.get("hinge_stiffness"), identified.get("root_stiffness")
    if k is None or root is None:
        return
    found, stated = (k.value, root.value), (k.stated, root.stated)
    reach = [
        [[k.value - k.low], [k.high - k.value]],
        [[root.value - root.low], [root.high - root.value]],
    ]
    ax.errorbar([found[0]], [found[1]], xerr=reach[0], yerr=reach[1], fmt="o", markersize=5,
                color=palette.SHADES["amps"], label="identified, 90 % interval")  # fmt: skip
    inside = (
        surface.hinge[0] <= stated[0] <= surface.hinge[-1]
        and surface.root[0] <= stated[1] <= surface.root[-1]
    )
    if inside:
        ax.plot(*([value] for value in stated), "s", color=palette.SHADES["scale"], label="stated")


def _bars(
    ax: Axes, x: Sequence[float], y: Sequence[float], error: Sequence[float], color: str
) -> None:
    ax.errorbar(x, y, error, fmt="o", markersize=4, elinewidth=0.8, color=color)


def _need(given: Sequence[object], message: str) -> None:
    if not given:
        raise InputError(message)


def _seen(series: TimeSeries, name: str) -> NDArray[np.float64]:
    return np.where(series.validity(name), series[name], np.nan)
