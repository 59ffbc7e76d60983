"""The traces of a run as tables for other programs, and what each of their columns is."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from typing import NamedTuple

from pyarrow import csv

from workbench.bundle import Bundle, Series
from workbench.errors import InputError
from workbench.quantities import unit_of
from workbench.timeseries import TimeSeries

__all__ = ["TRACES", "Trace", "as_csv", "column_lines", "heading", "read_traces"]


class Trace(NamedTuple):
    """A series of a bundle as a colleague meets it.

    Args:
        name: of its file or field.
        kind: of the series in the bundle.
        description: what it is, and where its time begins.
    """

    name: str
    kind: Series
    description: str


TRACES = (
    Trace("measured", "track", "the robot as the cameras saw it, cleaned; time zero is the rotor's "
          "first motion, or the release"),
    Trace("unfiltered", "raw", "the same on the take's own samples, neither filtered nor filled"),
    Trace("simulated", "twin", "its twin, the simulation of the same run on the same time axis"),
    Trace("estimated", "state", "the whole pose of the robot and the force that its model misses, "
          "as an observer estimates them from the same samples"),
    Trace("supply", "supply", "the motor's supply as it was read back; time zero is the start of "
          "the cameras"),
)  # fmt: skip

_AXES = {"x": "forward", "y": "to the left", "z": "upward"}
_POINTS = {
    "foot": "the foot's centre of gravity",
    "top": "T, the tip of the beam",
    "rotor": "the centre of the rotating mass",
}
_MEANINGS: tuple[tuple[str, str], ...] = (
    (r"time_s", "time"),
    *(
        (rf"{point}_{axis}_m", f"{what}, {way} of the foot's centre at rest")
        for point, what in _POINTS.items()
        for axis, way in _AXES.items()
    ),
    (r"foot_pitch_rad", "tilt of the foot, nose down; measured: against its rest"),
    (r"rotor_angle_rad", "direction from T to the rotor, from forward towards down, unwrapped"),
    (r"rotor_speed_rad_s", "rate of that angle"),
    (r"hinge_(\d+)_rad", "bend of the beam at this hinge, counted from its root"),
    (r"ground_([xyz])_N", "force of the ground on the foot along this axis"),
    (r".*_sigma_.*", "standard deviation of the column of that name without `sigma`"),
    (r"missing_(foot|top)_([xz])_N", "force on this point along this axis that the model misses"),
    (r"missing_foot_pitch_N_m", "moment on the foot, nose down, that the model misses"),
    (r"missing_mode_(\d+)_N_per_sqrt_kg", "force on this mode of unit mass that the model misses"),
    (r"corners_touching", "how many corners of the foot touch the ground"),
    (r"corners_sliding", "how many of them slide"),
    (r"motor_power_W", "mechanical power of the motor"),
    (r"set_voltage_V", "voltage that was set"),
    (r"voltage_V", "voltage that was read back"),
    (r"current_A", "current that was read back"),
)


def read_traces(bundle: Bundle) -> tuple[dict[str, TimeSeries], list[str]]:
    """Return the traces that a bundle holds by name, and a sentence for each that is damaged."""
    found: dict[str, TimeSeries] = {}
    lost: list[str] = []
    for name, kind, _ in TRACES:
        if bundle.series.has(kind):
            try:
                found[name] = bundle.series.read(kind)
            except InputError as error:
                lost.append(str(error).removeprefix(f"{bundle.path}/"))
    return found, lost


def heading(name: str) -> str:
    """Return the head of a column with its unit, `foot_x [m]` of `foot_x_m`."""
    suffix, unit = unit_of(name)
    return f"{name.removesuffix(suffix)} [{unit}]" if unit else name


def as_csv(series: TimeSeries) -> bytes:
    """Return a series as CSV, RFC 4180: a head line, a line a sample, empty where nothing was seen.

    Numbers are the shortest that read back as the same floating point numbers.
    """
    table = series.table()
    named = table.rename_columns([heading(name) for name in table.column_names])
    text = io.BytesIO()
    csv.write_csv(named, text, csv.WriteOptions(quoting_style="needed"))
    return text.getvalue()


def column_lines(names: Iterable[str]) -> list[str]:
    """Return a line of explanation a column."""
    rows = [(heading(name), _meaning(name)) for name in names]
    width = max((len(head) for head, _ in rows), default=0)
    return [f"  {head:{width}}  {meaning}" for head, meaning in rows]


def _meaning(name: str) -> str:
    for pattern, meaning in _MEANINGS:
        if re.fullmatch(pattern, name):
            return meaning
    return "as its name says"
