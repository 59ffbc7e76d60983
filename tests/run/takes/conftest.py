"""Exports of a body that stands still, as long and from when a test wants."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from workbench.run.takes import CameraTime
from workbench.tracking import BodyTake, Cloud, Take, format_start_time, write_motive, write_row

RATE_HZ = 20.0
BEGAN = datetime(2026, 3, 12, 15, 59, 50, 500_000)

Export = Callable[..., Path]


def still_take(seconds: float, start_time: str) -> Take:
    n = round(seconds * RATE_HZ)
    markers = np.tile([[[0.1, 0.2, 0.3], [0.1, 0.2, 0.4]]], (n, 1, 1))
    body = BodyTake(
        name="Foot",
        id="1",
        position=np.tile([0.1, 0.2, 0.35], (n, 1)),
        quaternion=np.tile([1.0, 0, 0, 0], (n, 1)),
        measured=markers,
        solved=markers,
        marker_names=("Marker 1", "Marker 2"),
        missing=np.zeros(n, dtype=np.int8),
    )
    indices = np.arange(n)
    header = {"Capture Start Time": start_time}
    return Take(
        "", "", "motive", "1.24", RATE_HZ, 0.0, indices, indices / RATE_HZ, {"Foot": body},
        Cloud.empty(n), header,
    )  # fmt: skip


@pytest.fixture
def wanted() -> CameraTime:
    """The cameras had to record for 4 s."""
    return CameraTime(BEGAN, 4.0)


@pytest.fixture
def export(tmp_path: Path) -> Export:
    """Write an export: name, start, length; `.row` in the name makes it a row format."""

    def write(name: str, began: datetime | str = BEGAN, seconds: float = 6.0) -> Path:
        start = began if isinstance(began, str) else format_start_time(began)
        path, take = tmp_path / name, still_take(seconds, start)
        if ".row" in name:
            write_row(take, path, version="1.1")
        else:
            write_motive(take, path, "1.24")
        return path

    return write
