"""A body's position from its markers: a pose where they span a plane, else a point on a line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.tracking.bridging import Offsets, bridge
from workbench.tracking.collinear import point_on_line
from workbench.tracking.pose import Poses, fit_poses, on_a_line, pitch_of
from workbench.tracking.rigid_body import learn_places, marker_weights, sample_of
from workbench.tracking.take import known

__all__ = ["POOR_FIT_M", "BodyPosition", "locate_body"]

Array = NDArray[np.float64]

POOR_FIT_M = 3e-3
"""Misfit of markers above which their given positions are wrong [m]."""
_USUAL_TIMES = 8.0  # a misfit this many times the usual one is not noise
_REST_SAMPLES = 60  # half a second or so


@dataclass(frozen=True, eq=False)
class BodyPosition:
    """One body's path by its markers, n samples, bench axes.

    Args:
        position: (n, 3) the body's point [m], NaN where its markers do not determine it.
        pitch: (n,) rotation about +y [rad], NaN where unknown; None where there is no pose.
        residual: (n,) misfit of the visible markers to the rigid body [m], NaN where unknown.
        bridged: (n,) True where the point was extrapolated from some of the markers.
        strays: (n,) True where the markers do not fit the body; `position` is NaN there.
        source: description of the point; {} is replaced by measured or solved.
        warnings: what the user should know.
    """

    position: Array
    pitch: Array | None
    residual: Array
    bridged: NDArray[np.bool_]
    strays: NDArray[np.bool_]
    source: str
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Fit:
    """Fit of a pose or line, as in `BodyPosition`, and the offsets of the markers."""

    position: Array
    pitch: Array | None
    residual: Array
    limit: float
    about: Offsets
    source: str
    warnings: tuple[str, ...]


def locate_body(name: str, times: Array, cloud: Array, places: Array | None) -> BodyPosition | None:
    """Locate a body by its markers.

    Three or more visible markers that span a plane give a weighted least-squares pose; without
    places the rigid body is learned from the take, and its point is the markers' centroid. Other
    markers give a point where all are visible. Where too few are, `bridge` extrapolates the point.

    Args:
        name: of the body, for messages.
        times: (n,) [s].
        cloud: (n, m, 3) its markers, exchanges undone [m], NaN where not seen.
        places: (m, 3) on the body, forward, left, up [m]; None if not given.

    Returns:
        None where no sample shows enough markers.
    """
    fit = _fit(name, cloud, places)
    strays = fit.residual > fit.limit
    position = np.where(strays[:, None], np.nan, fit.position)
    if not known(position).any():
        return None
    source, bridged = fit.source, np.zeros(len(times), dtype=np.bool_)
    if (~known(position) & ~strays).any():
        usable = np.where(strays[:, None, None], np.nan, cloud) if strays.any() else cloud
        position, bridged, error = bridge(times, usable, position, fit.about)
        text = f"; {np.count_nonzero(bridged)} samples from some of them"
        source += f"{text} (error {1e3 * error:.1f} mm)" if bridged.any() else ""
    return BodyPosition(
        position=position,
        pitch=None if fit.pitch is None else np.where(strays, np.nan, fit.pitch),
        residual=fit.residual,
        bridged=bridged,
        strays=strays,
        source=source,
        warnings=(*fit.warnings, *_stray_warning(name, strays, fit.limit)),
    )


def _fit(name: str, cloud: Array, places: Array | None) -> _Fit:
    some = sample_of(cloud)
    rigid = learn_places(some) if places is None else places
    if rigid is None or on_a_line(rigid[known(rigid)]):
        return _fit_line(name, cloud, places)
    return _fit_pose(name, cloud, rigid, marker_weights(rigid, some), given=places is not None)


def _stray_warning(name: str, strays: NDArray[np.bool_], limit: float) -> tuple[str, ...]:
    count = int(np.count_nonzero(strays))
    if not count:
        return ()
    return (
        f"the markers of {name!r} do not fit the rigid body in {count} samples (misfit above "
        f"{1e3 * limit:.1f} mm); these samples are left out",
    )


def _fit_pose(name: str, cloud: Array, places: Array, weights: Array, *, given: bool) -> _Fit:
    poses = fit_poses(places, cloud, weights)
    usual = _median(poses.rmsd)
    limit = max(POOR_FIT_M, _USUAL_TIMES * usual)
    if (poses.rmsd > limit).any():
        poses = _without_one_marker(poses, limit, places, cloud, weights)
    warnings = ()
    if usual > POOR_FIT_M:
        warnings = (
            f"the marker places of {name!r} fit the take only to {1e3 * usual:.1f} mm; check their "
            "order, unit (mm) and the tracking axes",
        )
    point = "body origin" if given else "centroid of the rigid body that the take shows"
    used = int(np.count_nonzero(known(places)))
    if used < len(places):
        point += f" ({used} of its {len(places)} markers)"
    return _Fit(
        position=poses.origin,
        pitch=pitch_of(poses.matrix[:, :, 0] if given else _forward(poses.matrix)),
        residual=poses.rmsd,
        limit=limit,
        about=lambda samples: np.einsum("nij,mj->nmi", poses.matrix[samples], places),
        source=f"{point}, fitted to the {{}} markers (median misfit {1e3 * usual:.2f} mm)",
        warnings=warnings,
    )


def _without_one_marker(
    poses: Poses, limit: float, places: Array, cloud: Array, weights: Array
) -> Poses:
    """Fit samples with one stray marker to the others, where these agree within the limit."""
    kept = Poses(*(values.copy() for values in poses))
    strays = np.flatnonzero(poses.rmsd > limit)
    for k in range(len(places)):
        others = cloud[strays].copy()
        others[:, k] = np.nan
        fitted = fit_poses(places, others, weights)
        better = fitted.rmsd < np.minimum(limit, kept.rmsd[strays])
        for old, new in zip(kept, fitted, strict=True):
            old[strays[better]] = new[better]
    return kept


def _forward(matrix: Array) -> Array:
    """Return where rotations (n, 3, 3) turn what pointed along +x at first, (n, 3).

    At first is in the mean over the first half second or so.
    """
    posed = np.flatnonzero(np.isfinite(matrix[:, 0, 0]))[:_REST_SAMPLES]
    rest = scipy.spatial.transform.Rotation.from_matrix(matrix[posed]).mean().as_matrix()
    return np.einsum("nij,j->ni", matrix, rest[0])


def _fit_line(name: str, cloud: Array, places: Array | None) -> _Fit:
    point = point_on_line(name, cloud, places)
    spread = np.linalg.norm(np.diff(cloud, axis=1), axis=2).sum(axis=1) / 2
    residual = np.abs(spread - _median(spread))
    return _Fit(
        position=point.position,
        pitch=point.pitch,
        residual=residual,
        limit=max(POOR_FIT_M, _USUAL_TIMES * _median(residual)),
        about=lambda samples: cloud[samples] - point.position[samples, None],
        source=point.source,
        warnings=point.warnings,
    )


def _median(values: Array) -> float:
    """Return the median of the finite values, NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else float("nan")
