"""`workbench ingest TAKE` says which bodies look like the robot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.conftest import Command
from workbench.tracking import BodyTake, Cloud, Take, write_motive

RATE = 120.0


@pytest.fixture
def export(tmp_path: Path) -> Path:
    """Three bodies with a plate between them: one rests, one sways above it, one circles that."""
    times = np.arange(400) / RATE
    angle = 17 * np.maximum(0.0, times - 1)
    sway = np.column_stack([0.01 * np.sin(angle), 0 * angle, 0 * angle])
    foot = np.array([0.3, 0.02, -0.1])  # at the origin it would be Motive's "not seen yet"
    top = foot + sway + np.array([0.05, 0.28, 0.0])
    rotor = top + 0.035 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    paths = {"a 1": foot + 0 * top, "plate": 0 * top + 2.0, "b 2": top, "c 3": rotor}
    unturned = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1))
    none = np.empty((len(times), 0, 3))
    bodies = {
        name: BodyTake(
            name, str(i), path, unturned, none, none, (), np.zeros(len(times), dtype=np.int8)
        )
        for i, (name, path) in enumerate(paths.items())
    }
    take = Take(
        path="", sha256="", format="motive", version="1.23", rate_hz=RATE, jitter_s=0.0,
        indices=np.arange(len(times)), times=times, bodies=bodies, cloud=Cloud.empty(len(times)),
    )  # fmt: skip
    write_motive(take, tmp_path / "x.csv")
    return tmp_path / "x.csv"


def test_ingest_says_which_bodies_look_like_the_robot(workbench: Command, export: Path) -> None:
    assert "looks like: foot a 1, top b 2, rotor c 3\n" in workbench("ingest", export).out
    guess = workbench("ingest", export, "--json").json["guess"]
    assert guess == {"foot": "a 1", "top": "b 2", "rotor": "c 3"}


def test_ingest_says_nothing_where_no_robot_is_seen(workbench: Command, root: Path) -> None:
    stored = sorted((root / "tests" / "data" / "tracking").glob("*.csv"))[0]
    assert "looks like" not in workbench("ingest", stored).out
    assert workbench("ingest", stored, "--json").json["guess"] is None
