"""The curves of a recording, as entities under `plots`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from workbench.motion import FOOT, FOOT_ERROR, ROTOR_ANGLE, ROTOR_SPEED, TOP, TOP_ERROR
from workbench.report import palette
from workbench.report.columns import send_seen
from workbench.report.comparison import NOISE_WIDTH, Comparison
from workbench.report.geometry import MISSING
from workbench.report.palette import rgb
from workbench.timeseries import TimeSeries

__all__ = ["TRACES", "DrawnRobot", "plot_run", "robots"]

TRACES = {
    "foot_x": FOOT[0],
    "foot_z": FOOT[2],
    "top_x": TOP[0],
    "top_z": TOP[2],
    "rotor_speed": ROTOR_SPEED,
}
"""Plot -> the channel that it shows of every robot."""

_SUPPLY = {
    "set_voltage_V": ("set", palette.SHADES["set_volts"]),
    "voltage_V": ("read back", palette.SHADES["volts"]),
    "current_A": ("read back", palette.SHADES["amps"]),
}
_THIN = 1.0
_THICK = 1.5


class DrawnRobot(NamedTuple):
    """One of the robots of a comparison.

    Args:
        name: of its curves' entities.
        label: in people's words.
        color: `#rrggbb`.
        motion: what it did.
    """

    name: str
    label: str
    color: str
    motion: TimeSeries


def robots(comparison: Comparison) -> list[DrawnRobot]:
    """Return the robot, its twin and, where there is one, the extended twin."""
    texts = [
        DrawnRobot("real", "real", palette.REAL, comparison.real),
        DrawnRobot("twin", "twin", palette.TWIN, comparison.twin),
    ]
    if comparison.extended is not None:
        motion = comparison.extended.motion
        texts.append(DrawnRobot("extended", "extended twin", palette.EXTENDED, motion))
    return texts


def plot_run(stream: rr.RecordingStream, comparison: Comparison, root: str = "") -> None:
    """Send every curve of a run below `root`, an entity path that ends in a slash or is empty."""
    for robot in robots(comparison):
        style = _line(robot.label, robot.color)
        for plot, channel in TRACES.items():
            _send(stream, f"{root}plots/{plot}/{robot.name}", robot.motion, channel, style)
        if comparison.driven:
            path = f"{root}plots/rotor_phase/{robot.name}"
            _send(stream, path, _phase(robot.motion), "phase_deg", style)
    for plot, channel in TRACES.items():
        _send_band(stream, f"{root}plots/{plot}/noise", comparison, channel)
    if comparison.driven:
        style = _line("twin ahead of real", palette.TWIN)
        _send(stream, f"{root}plots/rotor_lag/twin", comparison.rotor_lag(), "lag_deg", style)
    _send_errors(stream, comparison, root)
    _send_validation(stream, comparison, root)
    _send_missing(stream, comparison, root)
    for column, (name, color) in _SUPPLY.items() if comparison.supply is not None else ():
        path = f"{root}plots/supply/{column}"
        _send(stream, path, comparison.supply, column, _line(name, color))


def _phase(motion: TimeSeries) -> TimeSeries:
    """Return the rotor's direction, 0 to 360 deg; not valid at the jump, where no line belongs."""
    phase = np.degrees(motion[ROTOR_ANGLE]) % 360
    jump = np.abs(np.diff(phase, prepend=phase[:1])) > 180
    seen = motion.validity(ROTOR_ANGLE) & ~jump
    return TimeSeries.of(motion.times, {"phase_deg": phase}, {"phase_deg": seen})


def _send_errors(stream: rr.RecordingStream, comparison: Comparison, root: str) -> None:
    """Send the distances, and below which distance noise alone would explain them."""
    errors = {"error_mm": comparison.error(), "extended_error_mm": comparison.extended_error()}
    noise = NOISE_WIDTH * max(comparison.error_noise().values(), default=0.0)
    for plot, error in errors.items():
        if error is None:
            continue
        for part, name, column in (("foot", "foot", FOOT_ERROR), ("top", "T", TOP_ERROR)):
            style = _line(name, palette.SHADES[part])
            _send(stream, f"{root}plots/{plot}/{part}", error, column, style)
        if noise and len(error):
            level = TimeSeries.of(error.times[[0, -1]], {"noise_mm": [noise, noise]})
            style = _line("twice the noise", palette.SHADES["noise"])
            _send(stream, f"{root}plots/{plot}/noise", level, "noise_mm", style)


def _send_validation(stream: rr.RecordingStream, comparison: Comparison, root: str) -> None:
    """Send the errors of base and extended model as compared, on one plot, with the noise."""
    validation, columns = comparison.validation, {FOOT_ERROR: "foot", TOP_ERROR: "T"}
    if validation is None:
        return
    inks = {"base": palette.TWIN, "extended": palette.EXTENDED}
    for name, one in validation.both:
        for column in one.error.names:
            style = _line(f"{columns[column]}, {name}", inks[name])
            path = f"{root}plots/compared/{columns[column].lower()}_mm/{name}"
            _send(stream, path, one.error, column, style)
    for column in validation.base.error.names:
        level = TimeSeries.of(
            validation.base.error.times[[0, -1]], {"noise_mm": [validation.noise_mm] * 2}
        )
        path = f"{root}plots/compared/{columns[column].lower()}_mm/noise"
        _send(stream, path, level, "noise_mm", _line("noise", palette.SHADES["noise"]))


def _send_missing(stream: rr.RecordingStream, comparison: Comparison, root: str) -> None:
    """Send the missing force at T, not valid where it may be noise."""
    estimate = comparison.estimate
    if estimate is None or MISSING["top"][0] not in estimate:
        return
    shades = {"forward": palette.SHADES["missing"], "up": palette.SHADES["foot"]}
    for (label, shade), name in zip(shades.items(), MISSING["top"], strict=True):
        path = f"{root}plots/missing_mN/{label}"
        force = TimeSeries.of(
            estimate.times, {"mN": 1000 * estimate[name]}, {"mN": estimate.validity(name)}
        )
        _send(stream, path, force, "mN", _line(label, shade))


def _send_band(stream: rr.RecordingStream, path: str, comparison: Comparison, channel: str) -> None:
    """Send the edges of a measured curve's noise band, where its noise is known."""
    sigma = comparison.noise.get(channel)
    if sigma is None:
        return
    real = comparison.real
    seen = real.validity(channel) & np.isfinite(real[channel])
    edges = real[channel][seen, None] + NOISE_WIDTH * sigma * np.array([-1.0, 1.0])
    _send_values(stream, path, real.times, seen, edges)
    names = ["twice the noise"] * 2  # one line of the legend
    colors = [rgb(palette.SHADES["noise"])] * 2
    stream.log(path, rr.SeriesLines(names=names, colors=colors, widths=[_THIN] * 2), static=True)


def _send(
    stream: rr.RecordingStream,
    path: str,
    series: TimeSeries | None,
    name: str,
    style: rr.SeriesLines,
) -> None:
    if series is None or not len(series):
        return
    seen = series.validity(name) & np.isfinite(series[name])
    _send_values(stream, path, series.times, seen, series[name][seen])
    stream.log(path, style, static=True)


def _send_values(
    stream: rr.RecordingStream,
    path: str,
    times: NDArray[np.float64],
    seen: NDArray[np.bool_],
    values: NDArray[np.float64],
) -> None:
    """Send a row for every time, with one value or, of (n, k), with k."""
    each = 1 if values.ndim == 1 else values.shape[1]
    columns = rr.Scalars.columns(scalars=values.reshape(-1))
    send_seen(stream, path, times, seen, columns, each)


def _line(name: str, color: str) -> rr.SeriesLines:
    return rr.SeriesLines(names=name, colors=rgb(color), widths=_THICK)
