"""Lay a case out as a laboratory would hand it over, or give it to a test in memory.

The folder of a case holds `sheet.yaml`, a take for each run and `truth.sha256`, the hash of the
label. The label itself goes to another folder, which no engine opens.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.bank.cases import Made, Run
from benchmarks.bank.courses import RATE_HZ
from benchmarks.bank.observe import REST_S, Filmed
from workbench.fit import MeasuredRun
from workbench.motion import DRIVEN, FOOT, ROTOR, ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking import Axes, BodyTake, Cloud, SampleStatus, Take, write_motive

__all__ = ["measured", "measured_run", "sealed_label", "write_case"]

Array = NDArray[np.float64]

_BODIES = {"foot": "Foot", "top": "T", "rotor": "Rotor"}
_MARKERS_MM: dict[str, tuple[tuple[float, float, float], ...]] = {
    "foot": ((120, -110, 12), (120, 110, 12), (-120, -110, 12), (-120, 110, 12)),
    "top": ((0, 22, 0), (0, -22, 0), (14, 0, 9), (-14, 0, -9)),
    "rotor": ((0, 9, 0), (0, -9, 0)),
}
"""Forward, left, up on the body at rest, their middle on its point: no marker is off it."""
_OWN_NOISE_M = 5e-5
"""Of a marker against its body, whose place has the case's noise."""
_PLACE_M = np.array([-0.4, 0.15, 0.02])
"""Where the robot stands in the cameras' volume, along the bench axes."""
_AXES = Axes(up="y", forward="-z")


def measured(made: Made) -> list[MeasuredRun]:
    """Return the runs of a case as a fit sees them, without files."""
    return [measured_run(run) for run in made.runs]


def write_case(made: Made, folder: Path, sealed: Path) -> Path:
    """Write a case and return its folder.

    Args:
        made: the case.
        folder: where the case's own folder is made.
        sealed: where the label goes; another folder.

    Raises:
        ValueError: when both are one.
    """
    if sealed.resolve() == folder.resolve():
        raise ValueError(f"{sealed}: labels must not lie beside the cases; give another folder")
    here = folder / made.case.name
    here.mkdir(parents=True)
    sealed.mkdir(parents=True, exist_ok=True)
    for k, run in enumerate(made.runs):
        write_motive(_take(run, made.case.rng(4, k)), here / f"{run.name}.csv")
    (here / "sheet.yaml").write_text(_sheet(made), encoding="utf-8")
    label = sealed_label(made)
    (here / "truth.sha256").write_text(hashlib.sha256(label).hexdigest() + "\n", encoding="ascii")
    (sealed / f"{made.case.name}.json").write_bytes(label)
    return here


def sealed_label(made: Made) -> bytes:
    """Return the label of a case as it is stored."""
    return (json.dumps(made.label, sort_keys=True, indent=1) + "\n").encode()


def measured_run(run: Run) -> MeasuredRun:
    """Return one run as a fit sees it, without files."""
    filmed, columns = run.filmed, dict[str, Array]()
    for body, names in (("foot", FOOT), ("top", TOP), ("rotor", ROTOR)):
        columns |= dict(zip(names, filmed.paths[body].T, strict=True))
    columns[ROTOR_ANGLE] = filmed.rotor_angle
    still = columns[ROTOR_ANGLE][filmed.times < 0]
    series = TimeSeries.of(filmed.times, columns).between(-np.inf, run.course.duration)
    return MeasuredRun(
        name=run.name,
        mode=run.course.mode,
        motion=series,
        steps=run.course.steps if run.course.mode in DRIVEN else (),
        start_angle=float(np.nanmedian(still)),
        pull=run.course.pull,
        height=run.course.height,
        role=run.role,
    )


def _sheet(made: Made) -> str:
    """Return the sheet: what a laboratory writes down, nothing of the truth."""
    lines = [
        "schema: workbench/sheet-1", "model: thesis", "shape: thesis-initial",
        "tracking: {up: y, forward: -z}", "bodies: {foot: Foot, top: T, rotor: Rotor}",
        "markers:", f"  Foot: {[list(place) for place in _MARKERS_MM['foot']]}", "runs:",
    ]  # fmt: skip
    for run in made.runs:
        course = run.course
        said = [f"take: {run.name}.csv", f"mode: {course.mode}"]
        if course.mode in DRIVEN:
            said += [f"omega: {course.steps[-1][1]:.6g} rad/s", f"ramp: {course.steps[-1][0]:g} s"]
        elif course.mode == "decay":
            said.append(f"pull: {course.pull:.6g} N")
        else:
            said.append(f"height: {1000 * course.height:.6g} mm")
        # a little less than was filmed, for nobody knows the first motion to a picture
        said += [
            f"rest: {REST_S:g} s",
            f"duration: {course.duration - 0.1:g} s",
            f"role: {run.role}",
        ]
        lines.append(f"  - {{{', '.join(said)}}}")
    return "\n".join(lines) + "\n"


def _take(run: Run, rng: np.random.Generator) -> Take:
    filmed, count = run.filmed, len(run.filmed.times)
    bodies = {
        name: _body(name, number, filmed, body, rng)
        for number, (body, name) in enumerate(_BODIES.items(), start=1)
    }
    return Take(
        path=f"{run.name}.csv", sha256="", format="motive", version="1.23",
        rate_hz=float(RATE_HZ), jitter_s=0.0, indices=np.arange(count),
        times=np.arange(count) / RATE_HZ, bodies=bodies, cloud=Cloud.empty(count),
    )  # fmt: skip


def _body(name: str, number: int, filmed: Filmed, body: str, rng: np.random.Generator) -> BodyTake:
    """Return one body's markers about its place, which has the noise already."""
    places = np.array(_MARKERS_MM[body]) / 1000
    origin, angle = filmed.paths[body] + _PLACE_M, filmed.angles[body]
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = places.T
    turned = np.stack([c * x + s * z, np.broadcast_to(y, (len(angle), len(y))), c * z - s * x], -1)
    markers = origin[:, None, :] + turned
    own = rng.normal(0.0, _OWN_NOISE_M, markers.shape)
    lost = ~np.isfinite(origin[:, 0])
    quaternion = np.zeros((len(angle), 4))
    quaternion[:, 0], quaternion[:, 2] = np.cos(angle / 2), np.sin(angle / 2)
    quaternion[lost] = np.nan
    return BodyTake(
        name=name,
        id=str(number),
        position=_AXES.points_to_export(origin),
        quaternion=_AXES.quaternions_to_export(quaternion),
        measured=_AXES.points_to_export(markers + own),
        solved=_AXES.points_to_export(markers),
        marker_names=tuple(f"{name}_{m}" for m in range(1, len(places) + 1)),
        missing=np.where(lost, SampleStatus.LOST, SampleStatus.SEEN).astype(np.int8),
    )
