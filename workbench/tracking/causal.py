"""Positions of foot, T and rotor in one frame of a stream, from that frame and the rest before.

Bodies of a take are located with all of its frames (`body_position`): exchanges of markers are
undone, gaps bridged, glitches found from both sides. Of a stream only the rest is known, which
gives the markers' positions on the bodies; a frame in which they do not fit is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking.axes import Axes
from workbench.tracking.bodies import MarkerPlaces
from workbench.tracking.body_names import BodyNames
from workbench.tracking.body_position import POOR_FIT_M
from workbench.tracking.collinear import point_on_line
from workbench.tracking.natnet_frames import Body, Sample
from workbench.tracking.pose import fit_poses, on_a_line, pitch_of
from workbench.tracking.rigid_body import learn_places, marker_weights, order_of_places
from workbench.tracking.take import known

__all__ = ["FramePoints"]

Array = NDArray[np.float64]

_MM = 1e-3
_POINTS = {"foot": FOOT, "top": TOP, "rotor": ROTOR}


class FramePoints:
    """Learns the bodies' markers from frames at rest, and locates the bodies frame by frame.

    Args:
        rest: frames at rest.
        layout: the stream's bodies, in the order of the frames' poses.
        names: of foot, T and rotor in the stream.
        axes: of the stream.
        markers: their positions on the bodies [mm].

    Attributes:
        rest: channels of `workbench.motion` of the frames at rest, from the foot's median position.

    Raises:
        InputError: when a body is not streamed or never seen, or marker places do not fit it.
    """

    def __init__(
        self,
        rest: Sequence[Sample],
        layout: Sequence[Body],
        names: BodyNames,
        axes: Axes,
        markers: MarkerPlaces | None = None,
    ) -> None:
        self._origin, self._pitch = np.zeros(3), 0.0
        streamed = {body.name: (row, body) for row, body in enumerate(layout)}
        self._bodies: dict[str, _FrameBody] = {}
        for role, name in asdict(names).items():
            if name not in streamed:
                raise InputError(
                    f"the stream has no body {name!r}; it has {', '.join(streamed)}. Name it as "
                    "Motive does under `tracking: bodies:` of the bench file"
                )
            given = (markers or {}).get(name)
            places = None if given is None or not len(given) else _MM * np.asarray(given, float)
            row, body = streamed[name]
            self._bodies[role] = _FrameBody(row, body, rest, places, axes, upright=role == "foot")
        self.rest = self._rest(rest)

    def of(self, frame: Sample) -> dict[str, float]:
        """Return the channels of one frame, NaN where not seen; the rotor's angle is not unwrapped.

        Positions are against the foot's at rest, the pitch against its own at rest.
        """
        found: dict[str, float] = {}
        for role, body in self._bodies.items():
            position, pitch = body.of(frame)
            found |= dict(zip(_POINTS[role], (position - self._origin).tolist(), strict=True))
            if role == "foot":
                found[PITCH] = pitch - self._pitch
        across, up = (found[ROTOR[i]] - found[TOP[i]] for i in (0, 2))
        found[ROTOR_ANGLE] = float(np.arctan2(-up, across))
        return found

    def _rest(self, frames: Sequence[Sample]) -> TimeSeries:
        seen = [self.of(frame) for frame in frames]
        names = [name for name in seen[0] if name != PITCH or self._bodies["foot"].posed]
        values = np.array([[one[name] for name in names] for one in seen])
        for name, at in zip(("x", "y", "z"), np.nanmedian(values[:, :3], axis=0), strict=True):
            self._origin["xyz".index(name)] = at
        if PITCH in names:
            self._pitch = float(np.nanmedian(values[:, names.index(PITCH)]))
        origin = {n: self._origin[i] for point in _POINTS.values() for i, n in enumerate(point)}
        values -= [{**origin, PITCH: self._pitch}.get(name, 0.0) for name in names]
        still = names.index(ROTOR_ANGLE)
        values[:, still] = np.unwrap(values[:, still])
        return TimeSeries(
            np.arange(len(values), dtype=np.float64), values, tuple(names), np.isfinite(values)
        )


class _FrameBody:
    """One body: its rigid model, and its pose in a frame."""

    def __init__(
        self,
        row: int,
        body: Body,
        rest: Sequence[Sample],
        places: Array | None,
        axes: Axes,
        *,
        upright: bool,
    ) -> None:
        self._row, self._body = row, body
        self._to_bench = axes.points_to_bench(np.eye(3))  # rows of places are multiplied by it
        self._measured = any(np.isfinite(one.markers[self._slots]).any() for one in rest)
        cloud = np.array([self._cloud(one) for one in rest])
        if not np.isfinite(cloud).any():
            raise InputError(f"body {body.name!r} is never seen at rest")
        if places is not None:
            if len(places) != cloud.shape[1]:
                raise InputError(
                    f"markers of {body.name!r}: {len(places)} places are given, the stream has "
                    f"{cloud.shape[1]} markers"
                )
            places = places[order_of_places(places, cloud, POOR_FIT_M, upright=upright)]
        rigid = learn_places(cloud) if places is None else places
        self.posed = rigid is not None and not on_a_line(rigid[known(rigid)])
        self._given, self._rigid = places, rigid
        self._weights = marker_weights(rigid, cloud) if rigid is not None and self.posed else None
        self._length = float(np.nanmedian(_length(cloud)))
        self._forward = np.array([1.0, 0.0, 0.0])
        if self.posed and rigid is not None and places is None:  # forward is as at rest
            turned = fit_poses(rigid, cloud, self._weights).matrix
            first = turned[np.flatnonzero(np.isfinite(turned[:, 0, 0]))[0]]
            self._forward = first.T @ self._forward

    @property
    def _slots(self) -> slice:
        return slice(self._body.first, self._body.first + len(self._body.places))

    def _cloud(self, frame: Sample) -> Array:
        """Return the markers as seen, or as the streamed pose has them, (m, 3) in bench axes."""
        if self._measured:
            seen = frame.markers[self._slots]
            return np.where((seen == 0).all(axis=1)[:, None], np.nan, seen) @ self._to_bench
        place, (x, y, z, w) = frame.poses[self._row, :3], frame.poses[self._row, 3:7]
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turn = np.eye(3) + 2 * w * cross + 2 * cross @ cross
        return np.asarray((place + self._body.places @ turn.T) @ self._to_bench)

    def of(self, frame: Sample) -> tuple[Array, float]:
        """Return the body's point, (3,) [m], and its rotation about +y [rad], NaN where unknown."""
        cloud = self._cloud(frame)[None]
        if self.posed and self._rigid is not None:
            poses = fit_poses(self._rigid, cloud, self._weights)
            if not poses.rmsd[0] <= POOR_FIT_M:
                return np.full(3, np.nan), np.nan
            return poses.origin[0], float(pitch_of(poses.matrix @ self._forward)[0])
        if not abs(_length(cloud)[0] - self._length) <= POOR_FIT_M:
            return np.full(3, np.nan), np.nan
        return point_on_line(self._body.name, cloud, self._given).position[0], np.nan


def _length(cloud: Array) -> Array:
    """Return the length along markers on a line, (n,) [m]."""
    return np.asarray(np.linalg.norm(np.diff(cloud, axis=1), axis=2).sum(axis=1))
