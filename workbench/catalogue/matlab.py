"""A run as a MAT-file that MATLAB and Octave read without any tool of ours."""

from __future__ import annotations

import io
import json
import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from workbench.bundle import Manifest
from workbench.errors import InputError
from workbench.quantities import unit_of
from workbench.timeseries import TimeSeries

__all__ = ["as_mat"]

_LONGEST = 63  # MATLAB's namelengthmax
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_HEAD = b"MATLAB 5.0 MAT-file, written by the hopping workbench".ljust(116)
"""The text before the data; scipy writes the time there, and no two files would be equal."""


def as_mat(
    manifest: Manifest, traces: Mapping[str, TimeSeries], remarks: Mapping[str, Any]
) -> bytes:
    """Return a MAT-file of version 5 with one struct, `run`; the same run gives the same bytes.

    `run.measured.foot_x_m` is a column, NaN where nothing was seen, `run.measured.time_s` its
    times, `run.measured.units.foot_x_m` its unit; `run.simulated`, `run.supply` alike.
    `run.manifest` is the manifest as JSON, for `jsondecode`.

    Args:
        manifest: of the bundle.
        traces: by name.
        remarks: what people said, by kind.

    Raises:
        InputError: when a name is none in MATLAB.
    """
    run = {key: _plain(value) for key, value in (_facts(manifest) | dict(remarks)).items()}
    run |= {name: _struct(series) for name, series in traces.items()}
    run["manifest"] = json.dumps(manifest.flat(), ensure_ascii=True, default=str)
    file = io.BytesIO()
    scipy.io.savemat(
        file, {"run": run}, long_field_names=True, do_compression=True, oned_as="column"
    )
    return _HEAD + file.getvalue()[len(_HEAD) :]


def _facts(manifest: Manifest) -> dict[str, object]:
    """Return the facts that somebody looks for first; all are in the manifest's JSON."""
    asked, compared = manifest.asked, manifest.compared
    head: dict[str, object] = {
        "id": manifest.id,
        "status": manifest.status,
        "created": manifest.created,
        "error_mm": None if compared is None else compared.error_mm,
    }
    if asked is None:
        return head
    return head | {
        "title": asked.title,
        "mode": asked.mode,
        "role": asked.role,
        "model": asked.model,
        "shape": asked.shape,
        "operator": asked.operator,
        "speed_rad_s": asked.speed_rad_s,
        "voltage_V": asked.voltage_V,
        "pull_N": asked.pull_N,
        "height_m": asked.height_m,
        "duration_s": asked.duration_s,
    }


def _struct(series: TimeSeries) -> dict[str, Any]:
    columns = {"time_s": series.times}
    for name in series.names:
        columns[name] = np.where(series.validity(name), series[name], np.nan)
    for name in columns:
        if len(name) > _LONGEST or not _NAME.fullmatch(name):
            raise InputError(f"column {name!r}: MATLAB takes no such name for a field")
    return columns | {"units": {name: unit_of(name)[1] for name in columns}}


def _plain(value: object) -> object:
    """Return a value as MATLAB has it: text, a number, NaN for none."""
    return math.nan if value is None else value
