"""Positions of foot, T and rotor in bench axes, and the data of the take they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import chain

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.tracking.axes import Axes
from workbench.tracking.body_names import BodyNames, check_names
from workbench.tracking.body_position import POOR_FIT_M, BodyPosition, locate_body
from workbench.tracking.exchanges import without_exchanges
from workbench.tracking.identity import exchange_summary, untangle
from workbench.tracking.length_unit import in_plausible_unit
from workbench.tracking.parallel import parallel_map
from workbench.tracking.pose import pitch_of
from workbench.tracking.rigid_body import order_of_places
from workbench.tracking.take import BodyTake, SampleStatus, Take, any_finite, known

__all__ = ["MarkerPlaces", "RawBody", "RawPoints", "raw_points"]

Array = NDArray[np.float64]

MarkerPlaces = Mapping[str, Array | Sequence[Sequence[float]]]
"""By body name: (m, 3) places of its markers on the body, forward, left, up [mm]."""

_LEAST_SHARE = 0.5  # of seen samples whose measured markers give the body's position
_MM = 1e-3


@dataclass(frozen=True, eq=False)
class RawBody:
    """One body's path before cleaning.

    Args:
        name: as the export calls it.
        position: (n, 3) in bench axes [m], NaN where not seen.
        solved: (n, 3) centroid of the solved markers [m], with what the file holds while the body
            is lost; the pose position where the file has no solved markers.
        pitch: (n,) rotation about +y [rad], NaN where unknown; None where the markers give none, of
            the foot where the file's pose gives none either. From given marker places it is
            absolute, else relative to the take's first half second.
        missing: (n,) values of `SampleStatus`; SEEN wherever `position` is known, GLITCH where the
            markers do not fit the body.
        source: data that `position` was computed from, for the report.
        solved_source: the same for `solved`.
        residual: (n,) misfit of the visible markers to the rigid body [m], NaN where unknown.
        bridged: (n,) True where only some markers were visible and their offsets from the point
            were carried over from samples nearby: less accurate by the error in `source`.
    """

    name: str
    position: Array
    solved: Array
    pitch: Array | None
    missing: NDArray[np.int8]
    source: str
    solved_source: str
    residual: Array
    bridged: NDArray[np.bool_]


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

    times: Array
    rate_hz: float
    foot: RawBody
    top: RawBody
    rotor: RawBody
    warnings: tuple[str, ...] = ()

    @property
    def bodies(self) -> dict[str, RawBody]:
        """The three bodies by role."""
        return {"foot": self.foot, "top": self.top, "rotor": self.rotor}


@dataclass(frozen=True, eq=False)
class _Marked:
    """A body of the take with its markers in bench axes, (n, m, 3) [m], and which ones they are."""

    body: BodyTake
    cloud: Array
    kind: str


def raw_points(
    take: Take, names: BodyNames, axes: Axes, markers: MarkerPlaces | None = None
) -> RawPoints:
    """Return foot, T and rotor of a take.

    Exchanged bodies and markers are put back first. Three or more markers then give a pose; with
    `markers` the body's point is its origin, else the centroid of the rigid body that the take
    itself shows. Two markers give a point and a direction. Neither jumps when a marker is hidden.
    Where the file has no measured markers, or they seldom give the position, the solved ones are
    used, else the pose position.

    Args:
        take: the export.
        names: of the bodies in the export.
        axes: of the export.
        markers: their positions on the bodies [mm]; best in the order of the file's markers,
            another order is noticed.

    Raises:
        InputError: a body is not in the take, marker places do not fit its markers, or the unit of
            length that the file states cannot be its own.
    """
    places = {name: np.asarray(given, dtype=float) for name, given in (markers or {}).items()}
    check_names(take, names, places, axes)
    take, unit = in_plausible_unit(take, names)
    take, exchanges = without_exchanges(take, names)
    marked = {role: _marked(take.bodies[name], axes) for role, name in asdict(names).items()}
    marked = _untangled(take, marked, exchanges)
    noted: dict[str, list[str]] = {role: [] for role in marked}

    def raw_body(role: str) -> RawBody:
        each = marked[role]
        return _raw_body(take, role, each, axes, places.get(each.body.name), noted[role])

    found = dict(zip(marked, parallel_map(raw_body, marked), strict=True))
    warnings = (*unit, *exchanges, *chain(*noted.values()))
    return RawPoints(take.times, take.rate_hz, **found, warnings=warnings)


def _marked(body: BodyTake, axes: Axes) -> _Marked:
    if any_finite(body.measured):
        return _Marked(body, axes.points_to_bench(body.measured), "measured")
    return _solved_marked(body, axes)


def _solved_marked(body: BodyTake, axes: Axes) -> _Marked:
    believed = np.where(body.seen[:, None, None], body.solved, np.nan)
    return _Marked(body, axes.points_to_bench(believed), "solved")


def _untangled(take: Take, marked: dict[str, _Marked], warnings: list[str]) -> dict[str, _Marked]:
    """Undo exchanges within each body, then those between T and rotor."""
    out = dict(marked)
    measured = {role: each for role, each in marked.items() if each.kind == "measured"}
    found = parallel_map(lambda each: untangle(take.times, each.cloud), measured.values())
    for (role, each), mine in zip(measured.items(), found, strict=True):
        _warn(warnings, exchange_summary(take.times, mine.exchanged, repr(each.body.name)))
        out[role] = replace(each, cloud=mine.cloud)
    top, rotor = out["top"], out["rotor"]
    if top.kind == rotor.kind == "measured":
        both = untangle(take.times, np.concatenate([top.cloud, rotor.cloud], axis=1), partly=False)
        whose = f"{top.body.name!r} and {rotor.body.name!r}"
        _warn(warnings, exchange_summary(take.times, both.exchanged, whose))
        if both.exchanged.any():
            count = top.cloud.shape[1]
            out["top"] = replace(top, cloud=both.cloud[:, :count])
            out["rotor"] = replace(rotor, cloud=both.cloud[:, count:])
    return out


def _raw_body(
    take: Take, role: str, marked: _Marked, axes: Axes, places: Array | None, warnings: list[str]
) -> RawBody:
    body = marked.body
    solved, solved_source = _solved(body)
    solved = axes.points_to_bench(solved)
    located = _located(take, role, marked, axes, places, warnings)
    if located is None:
        position = np.where(body.seen[:, None], solved, np.nan)
        never = np.zeros(len(position), dtype=np.bool_)
        unknown = np.full(len(position), np.nan)
        located = BodyPosition(position, None, unknown, never, never, solved_source)
    warnings.extend(located.warnings)
    given = known(located.position)
    if not given.any():
        raise InputError(
            f"{take.path}: body {body.name!r} is never seen; nothing can be made of it"
        )
    missing = body.missing.copy()
    missing[body.seen] = SampleStatus.BLANK
    missing[located.strays] = SampleStatus.GLITCH
    missing[given] = SampleStatus.SEEN
    return RawBody(
        name=body.name,
        position=located.position,
        solved=solved,
        pitch=_pose_pitch(body, axes)
        if located.pitch is None and role == "foot"
        else located.pitch,
        missing=missing,
        source=located.source,
        solved_source=solved_source,
        residual=located.residual,
        bridged=located.bridged,
    )


def _located(
    take: Take, role: str, marked: _Marked, axes: Axes, places: Array | None, warnings: list[str]
) -> BodyPosition | None:
    """Return the position by the measured markers, or by the solved ones where those seldom do."""
    body = marked.body
    if places is not None and len(places):
        places = _ordered(take, role, marked, places * _MM, warnings)
    else:
        places = None
    located = _locate(take, marked, places)
    if marked.kind == "solved":
        return located
    share = 0.0 if located is None else float(known(located.position)[body.seen].mean())
    if share >= _LEAST_SHARE or not any_finite(body.solved):
        return located
    solved = _locate(take, _solved_marked(body, axes), places)
    why = f"the measured ones give its place in {100 * share:.0f} % only"
    return solved and replace(solved, source=f"{solved.source} ({why})")


def _locate(take: Take, marked: _Marked, places: Array | None) -> BodyPosition | None:
    if not any_finite(marked.cloud):
        return None
    located = locate_body(marked.body.name, take.times, marked.cloud, places)
    return located and replace(located, source=located.source.format(marked.kind))


def _ordered(take: Take, role: str, marked: _Marked, places: Array, warnings: list[str]) -> Array:
    """Return the places in the order of the take's markers."""
    body, count = marked.body, marked.cloud.shape[1]
    if places.shape != (count, 3):
        raise InputError(
            f"{take.path}: markers of {body.name!r}: {len(places)} places are given, "
            f"the take has {count} markers ({', '.join(body.marker_names)})"
        )
    order = order_of_places(places, marked.cloud, POOR_FIT_M, upright=role == "foot")
    if (order != np.arange(count)).any():
        warnings.append(
            f"the marker places of {body.name!r} are in another order than the take's markers; "
            f"used are the places number {', '.join(str(i + 1) for i in order)}, in this order"
        )
    return places[order]


def _warn(warnings: list[str], text: str | None) -> None:
    if text is not None:
        warnings.append(text)


def _solved(body: BodyTake) -> tuple[Array, str]:
    solved = body.centroid_solved
    if any_finite(solved):
        return solved, "centroid of the solved markers"
    return body.position, "pose position"


def _pose_pitch(body: BodyTake, axes: Axes) -> Array | None:
    """Return the pitch of the pose relative to its mean over the body's first half second or so."""
    posed = np.flatnonzero(body.seen & known(body.quaternion))
    if len(posed) < 2:
        return None
    turned = scipy.spatial.transform.Rotation.from_quat(
        axes.quaternions_to_bench(body.quaternion[posed]), scalar_first=True
    )
    relative = turned * turned[:60].mean().inv()
    pitch = np.full(len(body.quaternion), np.nan)
    pitch[posed] = pitch_of(relative.as_matrix()[:, :, 0])
    return pitch
