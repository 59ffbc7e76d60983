"""From a take to a track: cleaned, in bench axes, with the origin and time zero of a motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.motion import (
    FOOT,
    PITCH,
    RELEASED,
    ROTOR,
    ROTOR_ANGLE,
    ROTOR_SPEED,
    TOP,
    Mode,
    first_motion,
    release,
    rotor_speed,
    seen_median,
)
from workbench.timeseries import TimeSeries
from workbench.tracking.axes import Axes
from workbench.tracking.bodies import MarkerPlaces, RawPoints, raw_points
from workbench.tracking.body_names import BodyNames
from workbench.tracking.cleaning import recipe_named
from workbench.tracking.floor import Floor, fit_floor
from workbench.tracking.plausibility import implausible
from workbench.tracking.recipe import Cleaned, advancing
from workbench.tracking.rotor import RotorAngle, unwrapped
from workbench.tracking.take import SampleStatus, Take, samples_of

__all__ = ["Track", "make_track"]

_LONGEST_REST_S = 2.0
_STILL_M = 3e-3
_LEAST_REST_S = 0.1
_HINT_APART_S = 0.5
_POINTS = {TOP: "T", FOOT: "the foot"}


@dataclass(frozen=True, eq=False)
class Track:
    """The cleaned, time-aligned motion of one take.

    Args:
        motion: channels of `workbench.motion`, evenly sampled; a sample is valid where every body
            it needs was really seen. Origin: the foot at rest, in a drop still held. Time zero: the
            rotor's first motion, or the release in decay and drop.
        raw: the same channels, origin and time zero on the take's own samples: no filter, nothing
            filled. NaN where not seen; rejected samples keep their value and are not valid.
            Its rotor speed is the local parabola of `motion`'s, through the raw angle.
        missing: role, foot, top or rotor -> (n,) values of `SampleStatus` for each sample of
            `motion`: why it was not seen, FILLED where it has a value all the same.
        raw_missing: the same, (m,) for each sample of `raw`, GLITCH where cleaning rejected it.
        floor: the plane that the foot stood on, None where unknown. It is never subtracted.
        start_angle_rad: the rotor's angle at rest [rad].
        rest_s: how long foot and T stood still before time zero [s].
        zero_in_take_s: time zero on the take's clock [s].
        recipe: the name of the cleaning recipe.
        report: of the cleaning, for JSON.
        take_sha256: of the file it was made from.
        warnings: of the take, the cleaning and the plausibility checks.
    """

    motion: TimeSeries
    raw: TimeSeries
    missing: Mapping[str, NDArray[np.int8]]
    raw_missing: Mapping[str, NDArray[np.int8]]
    floor: Floor | None
    start_angle_rad: float
    rest_s: float
    zero_in_take_s: float
    recipe: str
    report: dict[str, Any]
    take_sha256: str
    warnings: tuple[str, ...]


def make_track(
    take: Take,
    *,
    bodies: BodyNames,
    axes: Axes,
    markers: MarkerPlaces | None = None,
    recipe: str = "default",
    start_hint: float | None = None,
    mode: Mode = "hop",
) -> Track:
    """Make the track of a take.

    Args:
        take: the export.
        bodies: its names of foot, T and rotor.
        axes: of the export.
        markers: their positions on the bodies: forward, left, up [mm].
        recipe: a name of `CLEANING`.
        start_hint: time zero where nothing moves, from the take's first sample [s].
        mode: determines time zero: the rotor turns, T is released or the foot falls.

    Raises:
        InputError: a body, marker place or recipe does not fit the take.
    """
    points = raw_points(take, bodies, axes, markers)
    cleaned = recipe_named(recipe)(points)
    columns, report = cleaned.columns, cleaned.report
    turned = _turned(columns)
    warnings = [*take.warnings, *points.warnings, *report.warnings, *_lost_turns(turned)]
    zero = _zero(columns.times, _onset(mode, columns, turned.angle), start_hint, warnings)
    rest, rest_s = _rest(columns, zero, warnings)
    origin = _origin(columns, rest, report.origin_m)
    motion = _motion(columns, turned.angle, origin).shifted(-(zero or 0.0))
    floor = fit_floor(motion)
    warnings.extend(implausible(motion, axes, floor))
    if take.axes is not None and take.axes.up != axes.up:
        warnings.append(
            f"the file says that its axis {take.axes.up} points up; the tracking axes have "
            f"{axes.up}"
        )
    return Track(
        motion=motion,
        raw=_raw(points, cleaned, turned.angle, origin).shifted(-(zero or 0.0)),
        missing=cleaned.missing,
        raw_missing=cleaned.raw_missing,
        floor=floor,
        start_angle_rad=seen_median(turned.angle[rest]),
        rest_s=rest_s,
        zero_in_take_s=zero or 0.0,
        recipe=recipe,
        report=report.as_json(),
        take_sha256=take.sha256,
        warnings=tuple(dict.fromkeys(warnings)),
    )


def _path(columns: TimeSeries, names: tuple[str, str, str]) -> NDArray[np.float64]:
    return np.column_stack([columns[name] for name in names])


def _wrapped(columns: TimeSeries) -> NDArray[np.float64]:
    """Return the direction from T to the rotor up to whole turns, (n,) [rad]."""
    x, _, z = (_path(columns, ROTOR) - _path(columns, TOP)).T
    return np.arctan2(-z, x)


def _turned(columns: TimeSeries) -> RotorAngle:
    """Return the rotor's angle, short gaps filled, turns in longer ones counted where possible."""
    turned = unwrapped(columns.times, _wrapped(columns))
    if not np.isfinite(turned.angle).any():
        raise InputError("T and rotor are never known at the same time; the rotor has no angle")
    return turned


def _lost_turns(turned: RotorAngle) -> list[str]:
    if not turned.unresolved_s:
        return []
    return [
        f"in {len(turned.unresolved_s)} gap(s), the longest {max(turned.unresolved_s):.2f} s, the "
        "rotor may have made unseen turns; its angle is uncertain by whole turns after them"
    ]


class _Onset(NamedTuple):
    """The body whose motion begins at time zero, and when on the take's clock [s], or None."""

    who: str
    found: float | None


def _onset(mode: Mode, columns: TimeSeries, angle: NDArray[np.float64]) -> _Onset:
    if mode not in RELEASED:
        return _Onset("the rotor", first_motion(columns.times, angle))
    point = RELEASED[mode]
    return _Onset(_POINTS[point], release(columns.times, _path(columns, point)))


def _zero(
    times: NDArray[np.float64], onset: _Onset, hint: float | None, warnings: list[str]
) -> float | None:
    """Return the onset on the take's clock [s], else the hint, else None."""
    who, found = onset
    hinted = None if hint is None else float(times[0]) + hint
    if found is not None:
        if hinted is not None and abs(found - hinted) > _HINT_APART_S:
            warnings.append(
                f"{who} first moves {found - times[0]:.2f} s into the take, {hint:g} s were "
                "expected; the measured time is used"
            )
        return float(np.clip(found, times[0], times[-1]))
    if hinted is not None and times[0] <= hinted <= times[-1]:
        warnings.append(f"{who} never moves; time zero is {hint:g} s into the take, as given")
        return hinted
    warnings.append(f"{who} never moves; times are those of the take")
    return None


def _rest(
    columns: TimeSeries, zero: float | None, warnings: list[str]
) -> tuple[NDArray[np.bool_], float]:
    """Return the samples at rest, at most 2 s, and the duration of the rest [s]."""
    times = columns.times
    before = times <= (times[0] + _LONGEST_REST_S if zero is None else zero)
    still = _still(columns, before)
    seconds = 0.0 if zero is None else max(0.0, zero - float(times[still][0]))
    if zero is not None and seconds < _LEAST_REST_S:
        warnings.append(
            f"foot and T stand still for only {seconds:.3f} s before time zero; "
            "origin and start angle are uncertain"
        )
    return still & (times >= times[still][-1] - _LONGEST_REST_S), seconds


def _still(columns: TimeSeries, before: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the samples after which foot and T stay within 3 mm of their last position."""
    times = columns.times
    count = int(np.count_nonzero(before))
    last = before & (times >= times[count - 1] - _LEAST_REST_S)
    still = before.copy()
    for names in (FOOT, TOP):
        path = _path(columns, names)[:count]
        end = [seen_median(column[last[:count]]) for column in path.T]
        moved = np.flatnonzero(np.linalg.norm(path - end, axis=1) > _STILL_M)
        if len(moved):
            still[: moved[-1] + 1] = False
    return still if still.any() else last


def _origin(
    columns: TimeSeries, rest: NDArray[np.bool_], base: tuple[float, float, float] | None
) -> dict[str, float]:
    """Return the origin by column: the resting foot, or none where the recipe had its own."""
    origin: dict[str, float] = {}
    if base is None:
        for names in (FOOT, TOP, ROTOR):
            for name, foot in zip(names, FOOT, strict=True):
                origin[name] = _at_rest(columns[foot], rest)
    if PITCH in columns:
        origin[PITCH] = _at_rest(columns[PITCH], rest)
    return origin


def _at_rest(column: NDArray[np.float64], rest: NDArray[np.bool_]) -> float:
    """Return the median at rest, or of all samples when the body is not seen at rest."""
    value = seen_median(column[rest])
    return value if np.isfinite(value) else seen_median(column)


def _motion(
    columns: TimeSeries, angle: NDArray[np.float64], origin: Mapping[str, float]
) -> TimeSeries:
    """Return the channels of a motion: columns from their origin, angle and speed of the rotor."""
    out = {name: columns[name] - origin.get(name, 0.0) for name in columns.names}
    valid = {name: columns.validity(name) for name in columns.names}
    out[ROTOR_ANGLE], out[ROTOR_SPEED] = angle, rotor_speed(columns.times, angle)
    valid[ROTOR_ANGLE] = valid[ROTOR_SPEED] = valid[TOP[0]] & valid[ROTOR[0]]
    return TimeSeries.of(columns.times, out, valid)


def _raw(
    points: RawPoints, cleaned: Cleaned, angle: NDArray[np.float64], origin: Mapping[str, float]
) -> TimeSeries:
    """Return the take's own samples as a motion; the turns are those of the cleaned angle."""
    keep = advancing(points.times)
    base = cleaned.report.origin_m or (0.0, 0.0, 0.0)
    columns: dict[str, NDArray[np.float64]] = {}
    valid: dict[str, NDArray[np.bool_]] = {}
    for names, role in ((FOOT, "foot"), (TOP, "top"), (ROTOR, "rotor")):
        path = samples_of(points.bodies[role].position, keep) - base
        columns |= dict(zip(names, path.T, strict=True))
        valid |= dict.fromkeys(names, cleaned.raw_missing[role] == SampleStatus.SEEN)
    if points.foot.pitch is not None and PITCH in cleaned.columns:
        columns[PITCH], valid[PITCH] = points.foot.pitch[keep], valid[FOOT[0]]
    series = TimeSeries.of(points.times[keep], columns, valid)
    known = np.isfinite(angle)
    near = np.interp(series.times, cleaned.columns.times[known], angle[known])
    direction = _wrapped(series)
    whole = np.round((near - direction) / (2 * np.pi))
    return _motion(series, direction + 2 * np.pi * whole, origin)
