"""Where foot, T and rotor are, in bench axes, and which of a take's numbers say so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from workbench.errors import InputError, did_you_mean
from workbench.tracking.axes import Axes
from workbench.tracking.pose import fit_poses, pitch_from_matrices
from workbench.tracking.take import BodyTake, Missing, Take, known

__all__ = ["BodyNames", "MarkerPlaces", "RawBody", "RawPoints", "raw_points"]

MarkerPlaces = Mapping[str, NDArray[np.float64] | Sequence[Sequence[float]]]
"""By body name: (m, 3) places of its markers on the body, forward, left, up [mm]."""

_POOR_FIT_M = 3e-3
_WORTH = 0.5  # share of seen samples that show all markers
_OFF_CENTRE_MM = 1.0


@dataclass(frozen=True)
class BodyNames:
    """What the export calls the robot's three bodies."""

    foot: str = "Foot"
    top: str = "T"
    rotor: str = "Rotor"


@dataclass(frozen=True, eq=False)
class RawBody:
    """One body's path before cleaning.

    Args:
        name: as the export calls it.
        position: (n, 3) in bench axes [m], NaN where not seen.
        solved: (n, 3) centroid of the solved markers [m], with what the file holds while the body
            is lost; the pose position where the file has no solved markers.
        pitch: (n,) rotation about +y [rad], NaN where unknown; None when the file cannot tell.
        missing: (n,) values of `Missing`.
        source: which numbers `position` was made of, for the report.
        solved_source: the same for `solved`.
    """

    name: str
    position: NDArray[np.float64]
    solved: NDArray[np.float64]
    pitch: NDArray[np.float64] | None
    missing: NDArray[np.int8]
    source: str
    solved_source: str


@dataclass(frozen=True, eq=False)
class RawPoints:
    """Foot, T and rotor before cleaning.

    Args:
        times: (n,) of the take [s].
        rate_hz: of the take.
        foot: the foot.
        top: the point T.
        rotor: the rotating mass.
        warnings: found on the way.
    """

    times: NDArray[np.float64]
    rate_hz: float
    foot: RawBody
    top: RawBody
    rotor: RawBody
    warnings: tuple[str, ...] = ()

    @property
    def bodies(self) -> dict[str, RawBody]:
        """The three bodies by role."""
        return {"foot": self.foot, "top": self.top, "rotor": self.rotor}


def raw_points(
    take: Take, names: BodyNames, axes: Axes, markers: MarkerPlaces | None = None
) -> RawPoints:
    """Take foot, T and rotor out of a take.

    A body is where the centroid of its measured markers is, in samples that show them all: the
    centroid of some of them jumps when a marker drops out. Where the file has no measured markers,
    or seldom shows all of them, it is the centroid of the solved ones, else the pose position. With
    `markers` a body with three or more visible ones is placed by a least-squares fit, and its point
    is the body's origin.

    Args:
        take: the export.
        names: what it calls the bodies.
        axes: how its axes lie.
        markers: where markers sit on the bodies [mm], in the order of the file's markers.

    Raises:
        InputError: a body is not in the take, or marker places do not fit its markers.
    """
    places = markers or {}
    _check_names(take, names, places)
    warnings: list[str] = []
    found = {
        field.name: _raw_body(take, getattr(names, field.name), axes, places, warnings)
        for field in fields(names)
    }
    return RawPoints(take.times, take.rate_hz, **found, warnings=tuple(warnings))


def _check_names(take: Take, names: BodyNames, places: MarkerPlaces) -> None:
    roles = {field.name: getattr(names, field.name) for field in fields(names)}
    for role, name in roles.items():
        if name not in take.bodies:
            raise InputError(f"{take.path}: the {role} {_unknown(name, list(take.bodies))}")
    if len(set(roles.values())) < len(roles):
        raise InputError(f"foot, top and rotor need three bodies; named are {roles}")
    for name in places:
        if name not in take.bodies:
            raise InputError(f"{take.path}: markers: body {_unknown(name, list(take.bodies))}")


def _unknown(name: str, names: list[str]) -> str:
    hint = did_you_mean(name, names, likeness=0.4)
    return f"{name!r} is not in the take; there are {', '.join(map(repr, names))}{hint}"


def _raw_body(
    take: Take, name: str, axes: Axes, places: MarkerPlaces, warnings: list[str]
) -> RawBody:
    body = take.bodies[name]
    solved, solved_source = _solved(body)
    pitch: NDArray[np.float64] | None = None
    if name in places and len(np.asarray(places[name])) >= 3:
        position, pitch, source = _fitted(body, np.asarray(places[name]), axes, warnings)
    else:
        position, source = _centroid(body, solved, solved_source)
        position = axes.points_to_bench(position)
        pitch = _pose_pitch(body, axes)
        _warn_of_unused(name, places, warnings)
    missing = body.missing.copy()
    position = np.where(body.seen[:, None], position, np.nan)
    missing[body.seen & ~known(position)] = Missing.BLANK
    if not np.isfinite(position).any():
        raise InputError(f"{take.path}: body {name!r} is never seen; nothing can be made of it")
    solved = axes.points_to_bench(solved)
    return RawBody(name, position, solved, pitch, missing, source, solved_source)


def _solved(body: BodyTake) -> tuple[NDArray[np.float64], str]:
    if np.isfinite(body.centroid_solved).any():
        return body.centroid_solved, "centroid of the solved markers"
    return body.position, "pose position"


def _centroid(
    body: BodyTake, solved: NDArray[np.float64], solved_source: str
) -> tuple[NDArray[np.float64], str]:
    whole = known(body.centroid_measured[body.seen])
    if not whole.any():
        return solved, solved_source
    if whole.mean() < _WORTH and body.solved.shape[1]:
        share = f"all measured ones visible in {100 * whole.mean():.0f} % only"
        return solved, f"{solved_source} ({share})"
    return body.centroid_measured, "centroid of the measured markers, all visible"


def _warn_of_unused(name: str, places: MarkerPlaces, warnings: list[str]) -> None:
    if name not in places or len(np.asarray(places[name])) == 0:
        return
    middle = np.asarray(places[name], dtype=float).mean(axis=0)
    if np.linalg.norm(middle) > _OFF_CENTRE_MM:
        warnings.append(
            f"the markers of {name!r} have their centroid {np.linalg.norm(middle):.1f} mm off the "
            "body's point; fewer than 3 markers define no pose, so this is not corrected"
        )


def _fitted(
    body: BodyTake, places_mm: NDArray[np.float64], axes: Axes, warnings: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.float64], str]:
    measured = known(body.measured).any()
    cloud = body.measured if measured else body.solved
    if places_mm.shape != (cloud.shape[1], 3):
        raise InputError(
            f"markers of {body.name!r}: {len(places_mm)} places are given, "
            f"the take has {cloud.shape[1]} markers ({', '.join(body.marker_names)})"
        )
    poses = fit_poses(places_mm * 1e-3, axes.points_to_bench(cloud))
    if not np.isfinite(poses.rmsd).any():
        raise InputError(f"markers of {body.name!r}: no sample shows 3 of them that span a plane")
    rmsd = float(np.nanmedian(poses.rmsd))
    if rmsd > _POOR_FIT_M:
        warnings.append(
            f"the marker places of {body.name!r} fit the take only to {1e3 * rmsd:.1f} mm; "
            "check their order, unit (mm) and the tracking axes"
        )
    kind = "measured" if measured else "solved"
    source = f"body origin, fitted to the {kind} markers (median misfit {1e3 * rmsd:.2f} mm)"
    return poses.origin, pitch_from_matrices(poses.matrix), source


def _pose_pitch(body: BodyTake, axes: Axes) -> NDArray[np.float64] | None:
    """Return the pitch of the pose relative to its mean over the body's first half second or so."""
    posed = np.flatnonzero(body.seen & known(body.quaternion))
    if len(posed) < 2:
        return None
    turned = Rotation.from_quat(
        axes.quaternions_to_bench(body.quaternion[posed]), scalar_first=True
    )
    relative = turned * turned[:60].mean().inv()
    pitch = np.full(len(body.quaternion), np.nan)
    pitch[posed] = pitch_from_matrices(relative.as_matrix())
    return pitch
