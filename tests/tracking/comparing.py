"""Whether a take is what a changed export must give."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from mutations import Answer

from workbench.tracking import SampleStatus, Take


def differences(take: Take, base: Take, answer: Answer) -> list[str]:
    """Return how a take differs from what it must be; nothing when it is right."""
    rows = list(answer.frames)
    if len(take) != len(rows):
        return [f"{len(take)} frames, {len(rows)} expected"]
    told = _Comparison()
    told.same("indices", take.indices, base.indices[rows] + answer.shift)
    at = base.times[rows] + (answer.shift / base.rate_hz if base.format == "motive" else 0.0)
    told.same("times", take.times, at)
    told.equal("bodies", set(take.bodies), set(base.bodies))
    for name in sorted(set(base.bodies) & set(take.bodies)):
        _compare_body(told, take, base, name, answer)
    if answer.same_cloud:
        points = _cloud(base, answer.scale, rows)
        told.equal("cloud", _cloud(take, 1.0), [
            set() if frame in answer.dark else seen
            for frame, seen in zip(rows, points, strict=True)
        ])  # fmt: skip
    return told.found


@dataclass
class _Comparison:
    found: list[str] = field(default_factory=list)

    def same(self, what: str, a: np.ndarray, b: np.ndarray) -> None:
        if a.shape != b.shape or not np.allclose(a, b, rtol=1e-12, atol=1e-13, equal_nan=True):
            self.found.append(f"{what} differ")

    def equal(self, what: str, a: object, b: object) -> None:
        if a != b:
            self.found.append(f"{what}: {a} instead of {b}")


def _compare_body(told: _Comparison, take: Take, base: Take, name: str, answer: Answer) -> None:
    body, other, rows = take.bodies[name], base.bodies[name], list(answer.frames)
    measured, missing = other.measured.copy(), other.missing.copy()
    position, quaternion = other.position.copy(), other.quaternion.copy()
    for owner, frame, marker in answer.hidden:
        if owner == name:
            measured[frame, marker] = np.nan
    for owner, frame, reason in answer.lost:
        if owner == name:
            missing[frame] = reason
            if reason == SampleStatus.BLANK:
                position[frame], quaternion[frame] = np.nan, np.nan
    dark, solved = list(answer.dark), other.solved.copy()
    measured[dark], position[dark], quaternion[dark] = np.nan, np.nan, np.nan
    missing[dark] = SampleStatus.LOST if base.format == "row" else SampleStatus.BLANK
    if base.format == "motive":  # row formats repeat the last model markers
        solved[dark] = np.nan
    told.equal(f"markers of {name}", set(body.marker_names), set(other.marker_names))
    if set(body.marker_names) != set(other.marker_names):
        return
    slots = [body.marker_names.index(label) for label in other.marker_names]
    told.same(f"position of {name}", body.position, position[rows] * answer.scale)
    told.same(f"quaternion of {name}", body.quaternion, quaternion[rows])
    told.same(f"measured of {name}", body.measured[:, slots], measured[rows] * answer.scale)
    told.same(f"solved of {name}", body.solved[:, slots], solved[rows] * answer.scale)
    told.same(f"missing of {name}", body.missing, missing[rows])


def _cloud(
    take: Take, scale: float, rows: list[int] | None = None
) -> list[set[tuple[object, ...]]]:
    """Return the points of each frame as names and rounded places."""
    cloud = take.cloud
    frames = rows if rows is not None else range(len(take))
    return [
        {
            (name, *(round(float(x) * scale, 9) for x in place))
            for name, place in zip(cloud.names[i], cloud.position[i], strict=True)
            if np.isfinite(place).all()
        }
        for i in frames
    ]
