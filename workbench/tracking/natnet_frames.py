"""A NatNet stream's frames as a take: the same numbers as in Motive's export of the same frames.

A stream names bodies and markers by numbers; the model definitions have the names, and the
markers' positions on the bodies. Lengths are metres, axes are those of the stream.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import HardwareError
from workbench.tracking.checks import apart, checked
from workbench.tracking.clock import jitter
from workbench.tracking.missing import without_zeros
from workbench.tracking.start_time import format_start_time
from workbench.tracking.take import BodyTake, Cloud, SampleStatus, Take, known

if TYPE_CHECKING:
    from natnet import DataFrame, LabeledMarker, RigidBodyDescription

__all__ = ["Body", "Sample", "StreamLayout", "make_take"]

Array = NDArray[np.float64]

_SNAP = 1e-3  # a rate this near to a whole number is that number
_UNIT_WITHIN = 0.01
_FITS_M = 2e-3  # a model's markers lie within 0.5 mm of those that were measured
_BETTER = 0.25


class Sample(NamedTuple):
    """One frame.

    Args:
        number: of the frame.
        time_s: of the server's clock [s].
        poses: (b, 8) x, y, z [m], qx, qy, qz, qw, mean marker error [m]; NaN while not tracked.
        markers: (k, 3) of all bodies, as the cameras saw them [m], NaN where not seen.
        loose: number and position [m] of each marker that belongs to no body.
        timecode: as streamed, 0 without a timecode generator.
        arrived_s: when it came to this computer, by `time.monotonic()` [s].
    """

    number: int
    time_s: float
    poses: Array
    markers: Array
    loose: Mapping[int, tuple[float, float, float]]
    timecode: int = 0
    arrived_s: float = 0.0


@dataclass(frozen=True)
class Body:
    """A rigid body of the model definitions.

    Args:
        name: as Motive shows it.
        number: its streaming id.
        places: (m, 3) of its markers from its pivot [m].
        first: of its markers among those of all bodies.
    """

    name: str
    number: int
    places: Array
    first: int

    @property
    def slots(self) -> slice:
        """Return the slice of its markers among those of all bodies."""
        return slice(self.first, self.first + len(self.places))


class StreamLayout:
    """Assigns the numbers in a frame to bodies and markers.

    Args:
        descriptions: the stream's rigid bodies.
    """

    def __init__(self, descriptions: Sequence[RigidBodyDescription]) -> None:
        bodies: list[Body] = []
        first = 0
        for found in descriptions:
            places = np.array([marker.pos for marker in found.markers], dtype=float).reshape(-1, 3)
            bodies.append(Body(found.name or str(found.id_num), found.id_num, places, first))
            first += len(places)
        self.bodies = tuple(bodies)
        self._markers = first
        self._by_number = {body.number: i for i, body in enumerate(bodies)}

    def sample(self, frame: DataFrame) -> Sample:
        """Return the sample of a frame.

        Raises:
            ValueError: where a tracked body's rotation is no unit quaternion: damaged bytes.
        """
        poses = np.full((len(self.bodies), 8), np.nan)
        for body in frame.rigid_bodies:
            row = self._by_number.get(body.id_num)
            if row is not None and body.tracking_valid:
                poses[row] = (*body.pos, *body.rot, body.marker_error)
        norms = np.linalg.norm(poses[:, 3:7], axis=1)
        if np.any(np.abs(norms - 1) > _UNIT_WITHIN):
            raise ValueError(f"a rotation has the length {np.nanmax(norms):.3g}")
        markers = np.full((self._markers, 3), np.nan)
        loose: dict[int, tuple[float, float, float]] = {}
        for marker in frame.labeled_markers:
            slot = self._slot(marker)
            if slot is None:
                loose[marker.id_num] = marker.pos
            elif marker.point_cloud_solved and not marker.occluded:
                markers[slot] = marker.pos
        suffix = frame.suffix
        return Sample(
            number=frame.prefix.frame_number,
            time_s=suffix.timestamp,
            poses=poses,
            markers=markers,
            loose=loose,
            timecode=suffix.timecode,
            arrived_s=time.monotonic(),
        )

    def _slot(self, marker: LabeledMarker) -> int | None:
        """Return a marker's index among those of all bodies; bodies count theirs from 1."""
        row = None if marker.unlabeled else self._by_number.get(marker.model_id)
        if row is None or not 1 <= marker.marker_id <= len(self.bodies[row].places):
            return None
        return self.bodies[row].first + marker.marker_id - 1


def make_take(
    samples: Sequence[Sample],
    layout: StreamLayout,
    version: str,
    began: datetime,
    warnings: Sequence[str] = (),
) -> Take:
    """Return recorded frames as a take, in the order of their numbers, counted from zero.

    Frames that did not arrive are steps of the index, as in an export of which a part was cut.

    Args:
        samples: as they arrived.
        layout: what their numbers belong to.
        version: of the bitstream.
        began: local wall time of the first frame.
        warnings: found while recording.

    Raises:
        HardwareError: when too few frames came for a rate.
    """
    unique = {sample.number: sample for sample in reversed(samples)}
    ordered = [unique[number] for number in sorted(unique)]
    numbers = np.array([sample.number for sample in ordered], dtype=np.int64)
    indices = numbers - numbers[0] if len(numbers) else numbers
    stamps = np.array([sample.time_s for sample in ordered])
    rate = _rate(indices, stamps)
    poses = np.stack([sample.poses for sample in ordered])
    markers = np.stack([sample.markers for sample in ordered])
    found: list[str] = []
    take = Take(
        path="",
        sha256="",
        format="natnet",
        version=version,
        rate_hz=rate,
        jitter_s=jitter(indices, stamps),
        indices=indices,
        times=indices / rate,
        bodies={
            body.name: _body(body, poses[:, i], markers[:, body.slots], indices, found)
            for i, body in enumerate(layout.bodies)
        },
        cloud=_cloud([sample.loose for sample in ordered]),
        header={
            "Capture Start Time": format_start_time(began),
            **_timecode(ordered),
            **_errors(layout, poses),
        },
        began=(began,),
    )
    return checked(replace(take, warnings=(*warnings, *_losses(samples, numbers), *found)))


def _body(
    body: Body, poses: Array, measured: Array, indices: NDArray[np.int64], warnings: list[str]
) -> BodyTake:
    position, quaternion = poses[:, :3].copy(), poses[:, [6, 3, 4, 5]]
    seen = known(position)
    measured = without_zeros(measured, f"markers of {body.name!r}", indices, warnings.append)
    solved = _solved(body.places, position, quaternion)
    mirrored = _mirrored(body, position, quaternion, measured)
    if mirrored is not None:
        axis, places = mirrored
        warnings.append(
            f"the stream's model of {body.name!r} has {axis} mirrored, as Motive 2.1 sends it: its "
            f"markers lay {1e3 * apart(solved, measured):.1f} mm from the measured ones (median), "
            f"and {1e3 * np.nanmedian(poses[:, 7]):.1f} mm are streamed as the error; mended"
        )
        solved = _solved(places, position, quaternion)
    return BodyTake(
        name=body.name,
        id=str(body.number),
        position=position,
        quaternion=quaternion,
        measured=measured,
        solved=solved,
        marker_names=tuple(f"Marker {k + 1}" for k in range(len(body.places))),
        missing=np.where(seen, SampleStatus.SEEN, SampleStatus.LOST).astype(np.int8),
        reported_error=poses[:, 7],
    )


def _solved(places: Array, position: Array, quaternion: Array) -> Array:
    """Return the model's markers at poses, (n, m, 3) [m], NaN where there is no pose."""
    seen = known(position)
    solved = np.full((len(position), len(places), 3), np.nan)
    if seen.any():
        turn = scipy.spatial.transform.Rotation.from_quat(
            quaternion[seen], scalar_first=True
        ).as_matrix()
        solved[seen] = position[seen, None] + np.einsum("nij,mj->nmi", turn, places)
    return solved


def _mirrored(
    body: Body, position: Array, quaternion: Array, measured: Array
) -> tuple[str, Array] | None:
    """Return the axis of a model that is mirrored against the measured markers, and it corrected.

    None where the model fits as it is, or not better in any mirror.
    """
    off = apart(_solved(body.places, position, quaternion), measured)
    if not off > _FITS_M:
        return None
    best: tuple[float, str, Array] | None = None
    for axis, name in enumerate("xyz"):
        places = body.places * np.where(np.arange(3) == axis, -1.0, 1.0)
        residual = apart(_solved(places, position, quaternion), measured)
        if residual < _BETTER * off and (best is None or residual < best[0]):
            best = residual, name, places
    return None if best is None else best[1:]


def _cloud(loose: Sequence[Mapping[int, tuple[float, float, float]]]) -> Cloud:
    """Return loose markers in slots; a marker keeps its slot while it is seen."""
    width = max(map(len, loose))
    position = np.full((len(loose), width, 3), np.nan)
    names = np.full((len(loose), width), "", dtype=object)
    held: dict[int, int] = {}
    for k, found in enumerate(loose):
        held = {number: slot for number, slot in held.items() if number in found}
        free = iter(sorted(set(range(width)) - set(held.values())))
        held |= {number: next(free) for number in found if number not in held}
        for number, place in found.items():
            position[k, held[number]] = place
            names[k, held[number]] = f"Unlabeled {number}"
    return Cloud(position, names)


def _rate(indices: NDArray[np.int64], stamps: Array) -> float:
    """Return frames per second by the server's clock, over all that came [Hz]."""
    seconds = float(stamps[-1] - stamps[0]) if len(stamps) > 1 else 0.0
    if not seconds > 0:
        raise HardwareError(
            f"no rate can be found from {len(stamps)} frame(s) over {seconds:g} s of the server's "
            "clock; record for longer, and see that Motive is live or playing"
        )
    rate = float(indices[-1]) / seconds
    return float(round(rate)) if abs(rate - round(rate)) < _SNAP * rate else rate


def _timecode(samples: Sequence[Sample]) -> dict[str, str]:
    """Return hours, minutes, seconds and frames of the first frame's SMPTE timecode."""
    code = samples[0].timecode
    if not code:
        return {}
    return {"Timecode": ":".join(f"{code >> shift & 0xFF:02d}" for shift in (24, 16, 8, 0))}


def _losses(samples: Sequence[Sample], numbers: NDArray[np.int64]) -> Iterator[str]:
    expected = int(numbers[-1] - numbers[0]) + 1
    lost = expected - len(numbers)
    if lost:
        longest = int(np.diff(numbers).max()) - 1
        yield (
            f"{lost} of {expected} frames did not arrive, at most {longest} in a row; "
            "is the network wireless or busy?"
        )
    if len(samples) > len(numbers):
        yield f"{len(samples) - len(numbers)} frame(s) came twice; the first counts"
    if any(b.number < a.number for a, b in pairwise(samples)):
        yield "frames came out of order, or Motive played a take in a loop; sorted by number"


def _errors(layout: StreamLayout, poses: Array) -> dict[str, str]:
    """Return the mean of each body's streamed mean marker error, where it was tracked."""
    found = {body.name: poses[known(poses[:, i, :3]), i, 7] for i, body in enumerate(layout.bodies)}
    return {
        f"Mean Marker Error of {name} [m]": f"{errors.mean():.6f}"
        for name, errors in found.items()
        if len(errors)
    }
