"""One rerun recording of a run beside its twin.

`/real/**` and `/sim/**` hold the two robots, `/extended/**` a third one where a model was extended,
`/plots/**` the curves, `/phase`, `/log` and `/notes`
the story, all on the timeline `t` [s] whose zero is the rotor's first motion or the release. Every
entity is sent as whole columns, styles once.

The recording is a view: it is made from a `Comparison` alone and can be made again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr

from workbench.motion import FOOT, ROTOR_SPEED, TOP
from workbench.review import palette
from workbench.review.columns import TIMELINE, send_seen
from workbench.review.comparison import FOOT_ERROR, TOP_ERROR, Comparison
from workbench.review.layout import layout
from workbench.review.notes import notes
from workbench.review.palette import rgb
from workbench.review.scene import draw_extended, draw_floor, draw_real, draw_twin
from workbench.timeseries import TimeSeries

__all__ = ["APPLICATION", "write_recording"]

APPLICATION = "hopping-workbench"

_TRACES = {
    "foot_x": FOOT[0],
    "foot_z": FOOT[2],
    "top_x": TOP[0],
    "top_z": TOP[2],
    "rotor_speed": ROTOR_SPEED,
}
_ROBOTS = (
    ("real", "real", palette.REAL),
    ("twin", "twin", palette.TWIN),
    ("extended", "extended twin", palette.EXTENDED),
)
"""Entity, name and colour of the robots, in the order of a comparison's motions."""
_SUPPLY = {
    "set_voltage_V": ("set voltage [V]", palette.SHADES["set_volts"]),
    "voltage_V": ("voltage [V]", palette.SHADES["volts"]),
    "current_A": ("current [A]", palette.SHADES["amps"]),
}


def write_recording(comparison: Comparison, path: Path) -> None:
    """Write the recording with its layout to `path`; the same comparison gives the same recording.

    Args:
        comparison: the run and its twin.
        path: the `.rrd` file; one that is there is replaced.
    """
    stream = rr.RecordingStream(APPLICATION, recording_id=comparison.run, send_properties=False)
    stream.save(path, default_blueprint=layout(comparison))
    try:
        _describe(stream, comparison)
        draw_floor(stream, comparison)
        draw_real(stream, comparison.real, comparison.figure)
        draw_twin(stream, comparison.twin, comparison.figure)
        if comparison.extended is not None:
            draw_extended(stream, comparison.extended.motion, comparison.figure)
        _plot(stream, comparison)
        _tell(stream, comparison)
    finally:
        stream.flush()
        stream.disconnect()  # writes the footer that makes the file complete


def _describe(stream: rr.RecordingStream, comparison: Comparison) -> None:
    summaries = {"real": comparison.real_summary, "twin": comparison.twin_summary}
    extended = comparison.extended
    if extended is not None:
        summaries["extended"] = extended.summary
    numbers: dict[str, Any] = {
        f"{who}_{name}": value
        for who, summary in summaries.items()
        for name, value in summary.as_json().items()
    }
    if extended is not None:
        numbers |= {"extended_model": extended.model, "extended_misfit_mm": extended.misfit.both_mm}
    stream.send_recording_name(comparison.title)
    stream.send_property(
        "run",
        rr.AnyValues(
            title=comparison.title,
            run=comparison.run,
            mode=comparison.mode,
            time_zero=comparison.time_zero,
            duration_s=comparison.duration_s,
            misfit_mm=comparison.misfit.both_mm,
            rerun_version=rr.__version__,
            **numbers,
        ),
    )


def _plot(stream: rr.RecordingStream, comparison: Comparison) -> None:
    robots = zip(_ROBOTS, comparison.motions, strict=False)  # the third one may be missing
    for (name, label, color), motion in robots:
        for trace, channel in _TRACES.items():
            _send_curve(stream, f"plots/{trace}/{name}", motion, channel, _line(label, color))
    errors = {"error_mm": comparison.error(), "extended_error_mm": comparison.extended_error()}
    for plot, error in errors.items():
        for part, name, column in (("foot", "foot", FOOT_ERROR), ("top", "T", TOP_ERROR)):
            style = _line(name, palette.SHADES[part])
            if error is not None:
                _send_curve(stream, f"plots/{plot}/{part}", error, column, style)
    if comparison.supply is not None:
        for column, (name, color) in _SUPPLY.items():
            path = f"plots/supply/{column}"
            _send_curve(stream, path, comparison.supply, column, _line(name, color))


def _send_curve(
    stream: rr.RecordingStream,
    path: str,
    series: TimeSeries,
    name: str,
    style: rr.SeriesLines,
) -> None:
    seen = series.validity(name) & np.isfinite(series[name])
    send_seen(stream, path, series.times, seen, rr.Scalars.columns(scalars=series[name][seen]))
    stream.log(path, style, static=True)


def _line(name: str, color: str) -> rr.SeriesLines:
    return rr.SeriesLines(names=name, colors=rgb(color), widths=1.5)


def _tell(stream: rr.RecordingStream, comparison: Comparison) -> None:
    """Send the phases, the journal and the notes."""
    if comparison.phases:
        names = [phase.name for phase in comparison.phases]
        _send_rows(
            stream,
            "phase",
            [phase.time_s for phase in comparison.phases],
            rr.StateChange.columns(state=names),
        )
        stream.log("phase", _phase_style(names), static=True)
    lines = _journal(comparison)
    if lines:
        times, levels, texts = zip(*lines, strict=True)
        _send_rows(stream, "log", times, rr.TextLog.columns(text=texts, level=levels))
    stream.log("notes", rr.TextDocument(notes(comparison), media_type="text/markdown"), static=True)


def _journal(comparison: Comparison) -> list[tuple[float, str, str]]:
    """Return time, level and text of every line; the warnings stand where the run begins."""
    start = float(comparison.real.times[0])
    lines = [(start, "WARN", text) for text in comparison.warnings]
    lines += [(time, "INFO", text) for time, text in comparison.log]
    # The viewer's own time column opens too narrow to be read, so the time is in the text.
    return [(time, level, f"{time:6.2f} s  {text}") for time, level, text in lines]


def _phase_style(names: list[str]) -> rr.StateConfiguration:
    distinct = list(dict.fromkeys(names))
    colors = [rgb(palette.PHASES[i % len(palette.PHASES)]) for i in range(len(distinct))]
    return rr.StateConfiguration(values=distinct, colors=colors)


def _send_rows(
    stream: rr.RecordingStream,
    path: str,
    times: Sequence[float],
    columns: Iterable[rr.ComponentColumn],
) -> None:
    stream.send_columns(path, [rr.TimeColumn(TIMELINE, duration=times)], columns)
