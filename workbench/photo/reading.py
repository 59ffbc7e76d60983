"""A photograph, digitised points or measured angles in; the beam as it was bent out."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, what_to_do
from workbench.photo.board import FOOT_TURN_RAD
from workbench.photo.camera import Camera, calibrate
from workbench.photo.edges import refined_points
from workbench.photo.fit import StripFit, StripPoints, fit_strip
from workbench.photo.markers import find_corners
from workbench.photo.opencv import opencv
from workbench.photo.orient import oriented, rough_numbers
from workbench.photo.strip import TAPES, StripView, find_path, make_view
from workbench.schemas import ShapeFile

__all__ = ["FOOT_SIGMA_RAD", "AsBent", "as_bent", "read_photo"]

Array = NDArray[np.float64]

FOOT_SIGMA_RAD = np.radians(1.0)
"""How well a strip is set into its foot by hand: alpha_0's, where only the strip is seen."""

_USUAL_THICKNESS_M = 0.002, 0.0007  # where the shape file does not say: guess and its spread
_USUAL_WIDTH_M = 0.016
_THICKNESS_SIGMA_M = 0.00015
_LEAST_SCALE = 1.003  # below, how much larger the strip appears gives no height
_REFINEMENTS = 3
_ROUGH_NOISE_M = 0.001
_ROUGH_POINTS = 400


@dataclass(frozen=True, eq=False)
class AsBent:
    """A beam as it was bent.

    Args:
        angles: (16,) alpha_0 to alpha_15 of the free strip [rad].
        covariance: (16, 16) [rad^2]; None where it is not known.
        foot_seen: whether alpha_0 was measured; else it is the target's.
        source: what it was read from, with its hash.
        notes: what was found on the way: name -> number, units in the names.
    """

    angles: Array
    covariance: Array | None
    foot_seen: bool
    source: str
    notes: dict[str, float]

    @property
    def uncertainty(self) -> Array | None:
        """Return each angle's standard error, (16,) [rad]."""
        return None if self.covariance is None else np.sqrt(np.diag(self.covariance))


def read_photo(
    path: Path,
    target: ShapeFile,
    *,
    tape: str = "none",
    foot_aligned: bool = False,
    printed: tuple[float, float] = (1.0, 1.0),
) -> AsBent:
    """Read the angles of a strip that lies on a marker board, as seen in one photograph.

    Which end is the root, and on which of its edges the strip lies, is found by the target. The
    photograph may be turned.

    Args:
        path: of the photograph.
        target: what the strip was bent to: its length, thickness and width, and near which angles
            it is.
        tape: what marks the strip's upper edge, a key of `TAPES`.
        foot_aligned: whether the foot lay along the board's foot line, so that alpha_0 is seen.
        printed: what a metre of the board's width and height became on paper [m].

    Raises:
        InputError: when the photograph does not show the board and the strip well enough, with what
            to do about it; when the extra `photo` is not installed.
    """
    photo, digest = _load(path)
    camera, view = _seen(path.name, photo, tape, printed)
    goal = np.array(target.angles)
    foot = _from_foot_line if foot_aligned else None
    rough = _rough(find_path(view, target.length))
    rough, mirrored = oriented(path.name, rough, target.length, goal, foot)
    view = replace(view, side=-1.0 if mirrored else 1.0)
    start = rough_numbers(rough.positions, target.length, 0.0)
    fit = fit_strip(rough, target.length, start, goal[1:])
    view, points, fit = _refined(view, rough, fit, target)
    covariance = fit.covariance + _by_camera(view, points, fit)
    notes = {
        "corners": float(camera.corners),
        "board_residual_mm": 1000 * camera.residual,
        "edge_noise_mm": 1000 * fit.noise,
        "scale": fit.scale,
        "camera_height_mm": 1000 * view.below()[1],
        "mirrored": float(mirrored),
    }
    source = f"photograph {path.name}, SHA-256 {digest}"
    return as_bent(fit, covariance, goal, foot, source, notes)


def _refined(
    view: StripView, rough: StripPoints, fit: StripFit, target: ShapeFile
) -> tuple[StripView, StripPoints, StripFit]:
    """Return the view with its height, the contour's points and their fit."""
    points, half = rough, (target.thickness or _USUAL_THICKNESS_M[0]) / 2
    width = target.width or _USUAL_WIDTH_M
    for _ in range(_REFINEMENTS):
        view = replace(view, height=_height(target, fit))
        points = refined_points(view, fit.arcs, _apparent_thickness(target, fit), width)
        begin = np.append(fit.numbers[:19], fit.numbers[19] or half)
        fit = fit_strip(points, target.length, begin, np.array(target.angles[1:]))
    return view, points, fit


def as_bent(
    fit: StripFit,
    covariance: Array,
    target: Array,
    foot: Callable[[float], float] | None,
    source: str,
    notes: dict[str, float],
) -> AsBent:
    """Return a fitted strip as angles.

    Args:
        fit: of the strip.
        covariance: (20, 20) of its numbers [their units squared].
        target: (16,) angles [rad]; alpha_0 is taken from it where the foot is not seen.
        foot: from the root's heading to alpha_0 [rad], when the way forward is known.
        source: what was read.
        notes: about it.
    """
    angles, covariance_now = fit.angles.copy(), covariance[2:18, 2:18].copy()
    if foot is not None:
        angles[0] = foot(float(angles[0]))
    else:
        angles[0] = target[0]
        covariance_now[0] = covariance_now[:, 0] = 0.0
        covariance_now[0, 0] = FOOT_SIGMA_RAD**2
    return AsBent(angles, covariance_now, foot is not None, source, notes)


def _load(path: Path) -> tuple[NDArray[np.uint8], str]:
    """Return the picture (rows, columns, 3) and the file's hash."""
    cv2 = opencv()
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {what_to_do(error)}") from None
    photo = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR) if data else None
    if photo is None:
        raise InputError(f"{path}: is not a picture that can be read; save it as JPEG or PNG")
    return photo, hashlib.sha256(data).hexdigest()


def _seen(
    name: str, photo: NDArray[np.uint8], tape: str, printed: tuple[float, float]
) -> tuple[Camera, StripView]:
    if tape not in TAPES:
        raise InputError(f"tape {tape!r} is not known; it is one of {', '.join(TAPES)}")
    corners = find_corners(name, opencv().cvtColor(photo, opencv().COLOR_BGR2GRAY))
    rows, columns = photo.shape[:2]
    camera = calibrate(name, corners, (columns, rows), printed)
    return camera, make_view(name, photo, camera, corners.board, tape)


def _rough(path: Array) -> StripPoints:
    """Return a rough path as points of the centreline."""
    sparse = path[:: max(1, len(path) // _ROUGH_POINTS)]
    return StripPoints(sparse, np.zeros(len(sparse)), path[[0, -1]], np.full(2, 2 * _ROUGH_NOISE_M))


def _apparent_thickness(target: ShapeFile, fit: StripFit) -> tuple[float, float]:
    if target.thickness is None:
        return _USUAL_THICKNESS_M
    return target.thickness * fit.scale, _THICKNESS_SIGMA_M


def _height(target: ShapeFile, fit: StripFit) -> float | None:
    """Return how high the camera hung by how much larger the strip's edge appears [m]."""
    if fit.scale <= _LEAST_SCALE:
        return None
    return (target.width or _USUAL_WIDTH_M) * fit.scale / (fit.scale - 1)


def _by_camera(view: StripView, points: StripPoints, fit: StripFit) -> Array:
    """Return what the camera's own uncertainty adds to the covariance, (20, 20)."""
    across = np.sum(view.shifts(points.positions) * fit.normals, axis=-1)
    change = fit.influence @ across.T
    return change @ view.camera.covariance @ change.T


def _from_foot_line(heading: float) -> float:
    """Return alpha_0 of a root's heading on the board, within half a turn [rad]."""
    return float((heading + FOOT_TURN_RAD + np.pi) % (2 * np.pi) - np.pi)
