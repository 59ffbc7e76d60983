"""Write a take as Tracking Tools would export it: the virtual bench's camera, and our test data."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.tracking.quaternions import euler_degrees
from workbench.tracking.take import BodyTake, Take, any_finite, known

__all__ = ["write_row"]

_KEYWORD = {"1.0": "trackable", "1.1": "rigidbody"}
_TITLE = {"1.0": "NaturalPoint Trackable Export Data", "1.1": "OptiTrack Export Data"}
_DESCRIPTION = """\
Every row starts with a word that says what the row holds.
comment: text for the reader
info: a key and its value
{body} before the first frame: name, id, marker count, x y z of each marker from the pivot
frame: index, time [s], count of tracked bodies,
  for each of them id, x y z, qx qy qz qw, yaw pitch roll,
  count of visible markers, for each of them {point}
{body} after a frame: index, time [s], name, id, frames since last tracked, marker count,
  model position of each marker {model}, seen position of each marker x y z or NAN,
  1 or 0 for each marker (tracked or not), quality from 0 to 1 of each marker, mean error
righthanded or lefthanded: the kind of axes"""
_POINT = {"1.0": "x y z id", "1.1": "x y z id name"}
_MODEL = {"1.0": "x y z", "1.1": "x y z id"}


def write_row(take: Take, path: str | Path, version: Literal["1.0", "1.1"] = "1.0") -> None:
    """Write a take in row format.

    Reading the file gives the take back within the printed 8 decimals. As in genuine files the
    model markers of a lost body stay finite: where the take has none, its last ones are repeated.

    Args:
        take: every body needs markers; a body without solved markers shows its measured ones.
        path: the file; it is replaced.
        version: of the format.

    Raises:
        InputError: unknown version, or a body without markers.
    """
    if version not in _KEYWORD:
        raise InputError(f"row format version {version!r} is unknown; there are 1.0 and 1.1")
    bodies = [_Writable(body, number, version) for number, body in enumerate(take.bodies.values())]
    lines = [*_head(take, bodies, version), *_frames(take, bodies, version)]
    Path(path).write_bytes("".join(f"{line}\r\n" for line in lines).encode())


class _Writable:
    """One body, its columns prepared for printing row by row."""

    def __init__(self, body: BodyTake, number: int, version: str) -> None:
        if not body.marker_names:
            raise InputError(
                f"body {body.name!r} has no markers; the row format has positions of markers only"
            )
        self.body, self.version = body, version
        self.id = body.id if body.id.isdecimal() else str(number + 1)
        self.m = len(body.marker_names)
        self.lost = _frames_since_seen(body.seen)
        self.solved = _held(body.solved if any_finite(body.solved) else body.measured)
        self.measured = np.where(body.seen[:, None, None], body.measured, np.nan)
        self.visible = known(self.measured)
        self.posed = body.seen & known(np.hstack([body.position, body.quaternion]))
        self.pose = np.hstack(
            [body.position, body.quaternion[:, [1, 2, 3, 0]], _yaw_pitch_roll(body, version)]
        )
        self.error = np.nan_to_num(body.fit_error)

    def row(self, i: int) -> str:
        """Return the fields after name and time of one body row."""
        if self.version == "1.0":
            model = _numbers(self.solved[i].ravel())
        else:
            model = ",".join(f"{_numbers(p)},{k + 1}" for k, p in enumerate(self.solved[i]))
        seen = self.visible[i].astype(float)
        tracked = ",".join("1" if s else "0" for s in seen)
        return (
            f"{self.id},{self.lost[i]},{self.m},{model},{_numbers(self.measured[i].ravel())},"
            f"{tracked},{_numbers(seen)},{self.error[i]:.8f}"
        )

    def definition(self) -> str:
        """Return the fields of the definition after the keyword."""
        first = int(np.argmax(self.body.seen))
        markers = self.solved[first] - self.solved[first].mean(axis=0)
        if self.posed[first]:
            turn = scipy.spatial.transform.Rotation.from_quat(
                self.body.quaternion[first], scalar_first=True
            )
            markers = turn.inv().apply(self.solved[first] - self.body.position[first])
        return f"{_quoted(self.body.name)},{self.id},{self.m},{_numbers(markers.ravel())}"


def _head(take: Take, bodies: list[_Writable], version: str) -> Iterator[str]:
    word = _KEYWORD[version]
    text = _DESCRIPTION.format(body=word, point=_POINT[version], model=_MODEL[version])
    for line in (_TITLE[version], *text.splitlines()):
        yield f"comment,{_quoted(line)}"
    yield "righthanded"
    if version != "1.0":
        yield f"info,version,{version}"
    yield f"info,framecount,{len(take)}"
    yield f"info,{word}count,{len(bodies)}"
    for body in bodies:
        yield f"{word},{body.definition()}"


def _frames(take: Take, bodies: list[_Writable], version: str) -> Iterator[str]:
    word = _KEYWORD[version]
    for i, (index, time) in enumerate(zip(take.indices, take.times, strict=True)):
        poses = [f"{b.id},{_numbers(b.pose[i])}" for b in bodies if b.posed[i]]
        points = list(_points(take, bodies, i, version))
        yield ",".join(
            [f"frame,{index},{time:.8f},{len(poses)}", *poses, str(len(points)), *points]
        )
        for b in bodies:
            yield f"{word},{index},{time:.8f},{_quoted(b.body.name)},{b.row(i)}"


def _points(take: Take, bodies: list[_Writable], i: int, version: str) -> Iterator[str]:
    """Yield the visible points of one frame: first the bodies', then the others."""
    number = 0
    for b in bodies:
        for k in range(b.m):
            number += 1
            if b.visible[i, k]:
                name = f",{_quoted(f'{b.body.name}-{b.body.marker_names[k]}')}"
                yield f"{_numbers(b.measured[i, k])},{number}{name if version != '1.0' else ''}"
    for position, name in zip(take.cloud.position[i], take.cloud.names[i], strict=True):
        number += 1
        if np.isfinite(position).all():
            label = (
                f"{number},{_quoted(name)}" if version != "1.0" else _quoted(name or str(number))
            )
            yield f"{_numbers(position)},{label}"


def _frames_since_seen(seen: NDArray[np.bool_]) -> NDArray[np.int64]:
    index = np.arange(len(seen))
    return index - np.maximum.accumulate(np.where(seen, index, -1))


def _held(markers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Repeat the last known markers in place of NaN, and the first known ones before them."""
    whole = np.asarray(known(markers).all(axis=1))
    if not whole.any():
        return markers
    first = int(np.argmax(whole))
    index = np.where(whole, np.arange(len(markers)), first)
    return markers[np.maximum.accumulate(np.where(np.arange(len(markers)) < first, first, index))]


def _yaw_pitch_roll(body: BodyTake, version: str) -> NDArray[np.float64]:
    """Return (n, 3) [deg]: R = Rx(roll) Rz(pitch) Ry(yaw); format 1.0 has the pitch reversed."""
    roll, pitch, yaw = euler_degrees(body.quaternion, "XZY").T
    return np.column_stack([yaw, -pitch if version == "1.0" else pitch, roll])


def _numbers(values: NDArray[np.float64]) -> str:
    return ",".join([f"{value:.8f}" for value in values.tolist()]).replace("nan", "NAN")


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"'
