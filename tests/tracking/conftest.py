"""A robot that hops on paper: takes with a known truth, and the folder of real exports."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from workbench.tracking import Axes, BodyTake, Cloud, SampleStatus, Take, read_take

RATE = 120.0
START = 2.0
START_ANGLE = 0.6
SPEED = 17.0
FOOT_MARKERS_MM = [[120, -110, 12], [120, 110, 12], [-120, -110, 12], [-120, 110, 12]]
TOP_MARKERS_MM = [[0, -20, 5], [0, 20, -5]]
ROTOR_MARKERS_MM = [[0, -10, 0], [0, 10, 0]]
PLACE = np.array([0.31, -0.22, 0.05])
"""Where the foot stands in the room, bench axes [m]."""


@dataclass(frozen=True)
class Truth:
    """The motion that a take was made from, bench axes, the foot at rest as origin."""

    times: NDArray[np.float64]
    foot: NDArray[np.float64]
    top: NDArray[np.float64]
    rotor: NDArray[np.float64]
    pitch: NDArray[np.float64]
    angle: NDArray[np.float64]
    speed: NDArray[np.float64]


@dataclass(frozen=True)
class Hop:
    """A take and its truth."""

    take: Take
    truth: Truth


MakeHop = Callable[..., Hop]


def truth(seconds: float, rate: float) -> Truth:
    t = np.arange(round(seconds * rate)) / rate
    tau = np.maximum(0.0, t - START)
    ramp = 1 - np.exp(-tau / 0.3)
    angle = START_ANGLE + SPEED * (tau - 0.3 * ramp)
    bounce = np.sin(angle - START_ANGLE)
    pitch = 0.03 * ramp * bounce
    foot = np.column_stack([0.05 * tau, 0 * t, 0.012 * ramp * bounce**2])
    top = foot + np.column_stack([0.071 + 0.02 * ramp * bounce, 0 * t, 0.28 + 0.01 * ramp * bounce])
    rotor = top + 0.035 * np.column_stack([np.cos(angle), 0 * t, -np.sin(angle)])
    return Truth(t, foot, top, rotor, pitch, angle, SPEED * ramp)


def body_take(
    name: str,
    number: int,
    path: NDArray[np.float64],
    pitch: NDArray[np.float64],
    markers_mm: list[list[int]],
    axes: Axes,
    noise: NDArray[np.float64],
) -> BodyTake:
    turn = Rotation.from_rotvec(np.outer(pitch, [0, 1, 0]))
    places = np.array(markers_mm) * 1e-3
    solved = path[:, None, :] + np.einsum("nij,mj->nmi", turn.as_matrix(), places) + PLACE
    quaternion = axes.quaternions_to_export(turn.as_quat(scalar_first=True))
    return BodyTake(
        name=name,
        id=str(number),
        position=axes.points_to_export(solved.mean(axis=1)),
        quaternion=quaternion,
        measured=axes.points_to_export(solved + noise),
        solved=axes.points_to_export(solved),
        marker_names=tuple(f"Marker {k + 1}" for k in range(len(places))),
        missing=np.zeros(len(path), dtype=np.int8),
    )


def hide(take: Take, name: str, start: int, stop: int) -> Take:
    """Lose a body in samples start..stop-1, as cameras do: only the model markers remain."""
    body = take.bodies[name]
    position, quaternion = body.position.copy(), body.quaternion.copy()
    measured, missing = body.measured.copy(), body.missing.copy()
    for values in (position, quaternion, measured):
        values[start:stop] = np.nan
    missing[start:stop] = SampleStatus.LOST
    lost = replace(
        body, position=position, quaternion=quaternion, measured=measured, missing=missing
    )
    return replace(take, bodies={**take.bodies, name: lost})


def make_hop(
    seconds: float = 8.0,
    rate: float = RATE,
    axes: Axes | None = None,
    noise_m: float = 1e-4,
    seed: int = 7,
    names: tuple[str, str, str] = ("Foot", "T", "Rotor"),
) -> Hop:
    axes, motion, rng = axes or Axes(), truth(seconds, rate), np.random.default_rng(seed)
    n = len(motion.times)
    specs = (
        (motion.foot, motion.pitch, FOOT_MARKERS_MM),
        (motion.top, 0 * motion.pitch, TOP_MARKERS_MM),
        (motion.rotor, 0 * motion.pitch, ROTOR_MARKERS_MM),
    )
    bodies = {
        name: body_take(
            name, i + 1, path, pitch, places, axes, rng.normal(0, noise_m, (n, len(places), 3))
        )
        for i, (name, (path, pitch, places)) in enumerate(zip(names, specs, strict=True))
    }
    take = Take(
        path="hop.csv",
        sha256="0" * 64,
        format="row",
        version="1.0",
        rate_hz=rate,
        jitter_s=0.0,
        indices=np.arange(n),
        times=motion.times,
        bodies=bodies,
        cloud=Cloud.empty(n),
    )
    return Hop(take, motion)


def small_take() -> Take:
    """Return 40 samples around the start with gaps: the contents of tests/data/tracking."""
    hop = make_hop(seconds=START + 0.2)
    take = part(hop.take, len(hop.take) - 40)
    take = hide(hide(take, "Foot", 5, 8), "Rotor", 20, 32)
    stray = np.full((40, 1, 3), np.nan)
    stray[10:15] = [0.5, 0.6, 0.7]
    names = np.full((40, 1), "", dtype=object)
    names[10:15] = "Unlabeled 1007"
    return replace(take, cloud=Cloud(stray, names))


def part(take: Take, start: int) -> Take:
    """Return the samples from `start` on, with indices and times from zero."""
    n = len(take) - start
    bodies = {
        name: replace(
            body,
            position=body.position[start:],
            quaternion=body.quaternion[start:],
            measured=body.measured[start:],
            solved=body.solved[start:],
            missing=body.missing[start:],
        )
        for name, body in take.bodies.items()
    }
    return replace(
        take,
        indices=np.arange(n),
        times=np.arange(n) / take.rate_hz,
        bodies=bodies,
        cloud=Cloud.empty(n),
    )


@pytest.fixture(scope="session")
def new_hop() -> MakeHop:
    return make_hop


@pytest.fixture(scope="session")
def hop() -> Hop:
    return make_hop()


@pytest.fixture
def lose() -> Callable[[Take, str, int, int], Take]:
    return hide


@pytest.fixture(scope="session")
def small() -> Take:
    return small_take()


@pytest.fixture(scope="session")
def foot_markers() -> dict[str, list[list[int]]]:
    return {"Foot": FOOT_MARKERS_MM}


@pytest.fixture(scope="session")
def stored() -> Path:
    """The folder of small exports that our writers made."""
    return Path(__file__).parents[1] / "data" / "tracking"


@pytest.fixture(scope="session")
def real_exports() -> Path:
    """The folder of measured exports, which is not part of this repository."""
    default = Path(__file__).parents[2].parent / "shared" / "optitrack"
    folder = Path(os.environ.get("WORKBENCH_REAL_EXPORTS", default))
    if not (folder / "expected_numbers.json").exists():
        pytest.skip(f"no real exports at {folder}; set WORKBENCH_REAL_EXPORTS to their folder")
    return folder


@pytest.fixture
def read(tmp_path: Path) -> Callable[[bytes], Take]:
    """Read an export given as bytes."""

    def from_bytes(data: bytes) -> Take:
        (tmp_path / "x.csv").write_bytes(data)
        return read_take(tmp_path / "x.csv")

    return from_bytes
