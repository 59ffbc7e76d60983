"""Angles or points that were measured by hand, without a photograph: the same fit, same result."""

from __future__ import annotations

import csv
import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, what_to_do
from workbench.photo.fit import StripPoints, fit_strip
from workbench.photo.orient import oriented, rough_numbers
from workbench.photo.reading import AsBent, as_bent
from workbench.schemas import ShapeFile

__all__ = ["read_angles", "read_points"]

Array = NDArray[np.float64]

_FEWEST_POINTS = 32  # two an increment
_END_NOISE_M = 0.0005
_DIRECTIONS: dict[str, tuple[int, int]] = {
    "x": (1, 0), "+x": (1, 0), "-x": (-1, 0), "y": (0, 1), "+y": (0, 1), "-y": (0, -1),
}  # fmt: skip
_LARGEST_DEG = 180.0


def read_angles(path: Path, target: ShapeFile) -> AsBent:
    """Read 16 measured angles, alpha_0 to alpha_15.

    Args:
        path: of a CSV file with a line an angle: degrees, and if it is known its standard error in
            degrees. A line of words above them is passed over.
        target: what the strip was bent to.

    Raises:
        InputError: when there are not 16 angles; names file and line.
    """
    rows = _numbers(path, (1, 2))
    if len(rows) != len(target.angles):
        raise InputError(
            f"{path}: {len(rows)} angles, {len(target.angles)} are needed: alpha_0 to alpha_15, a "
            "line each, in degrees"
        )
    angles = np.array([row[0] for row in rows])
    if np.abs(angles).max() > _LARGEST_DEG:
        raise InputError(
            f"{path}: {angles[np.argmax(np.abs(angles))]:g} deg is no angle between increments; "
            f"they lie within {_LARGEST_DEG:g} deg"
        )
    errors = [row[1] for row in rows if len(row) == 2]
    if errors and (len(errors) < len(rows) or min(errors) < 0):
        raise InputError(f"{path}: give a standard error, 0 deg or more, on every line or on none")
    covariance = np.diag(np.radians(errors) ** 2) if errors else None
    return AsBent(np.radians(angles), covariance, True, _source("angles", path), {})


def read_points(
    path: Path, target: ShapeFile, forward: str | None = None, up: str | None = None
) -> AsBent:
    """Fit the beam to points digitised along its centreline.

    Args:
        path: of a CSV file with x and y [mm] on each line, from root to tip, of at least 32 points
            over the whole strip. A line of words above them is passed over.
        target: what the strip was bent to.
        forward: the points' axis along which the robot hops, such as `+x`; without it alpha_0 is
            the target's.
        up: the points' axis that is up, such as `+y`; given with forward.

    Raises:
        InputError: when the points cannot be read, are too few or do not lie along a strip.
    """
    given = np.array(_numbers(path, (2,))) / 1000
    if len(given) < _FEWEST_POINTS:
        raise InputError(
            f"{path}: {len(given)} points, at least {_FEWEST_POINTS} are needed, over the whole "
            "strip from root to tip"
        )
    way = _axes(forward, up)
    positions = given if way is None else given @ way.T
    length = float(np.sum(np.linalg.norm(np.diff(positions, axis=0), axis=1)))
    if not 0.8 * target.length < length < 1.25 * target.length:
        raise InputError(
            f"{path}: the points run over {1000 * length:.0f} mm, the strip is "
            f"{1000 * target.length:.0f} mm long; give x,y in mm, in order from root to tip, both "
            "ends included"
        )
    points = StripPoints(
        positions, np.zeros(len(positions)), positions[[0, -1]], np.full(2, _END_NOISE_M)
    )
    goal = np.array(target.angles)
    if way is None:
        points, _ = oriented(path.name, points, target.length, goal, None)
    start = rough_numbers(points.positions, target.length, 0.0)
    fit = fit_strip(points, target.length, start, goal[1:])
    notes = {"points": float(len(positions)), "noise_mm": 1000 * fit.noise, "scale": fit.scale}
    foot = None if way is None else _within_half_turn
    return as_bent(fit, fit.covariance, goal, foot, _source("points", path), notes)


def _axes(forward: str | None, up: str | None) -> Array | None:
    """Return the rotation from the points' axes to forward and up, (2, 2)."""
    if forward is None and up is None:
        return None
    for name, axis in (("--forward", forward), ("--up", up)):
        if axis not in _DIRECTIONS:
            raise InputError(f"{name}: {axis!r} is no axis; give both, each of +x, -x, +y, -y")
    way = np.array([_DIRECTIONS[str(forward)], _DIRECTIONS[str(up)]], dtype=float)
    if way[0] @ way[1] != 0:
        raise InputError(f"--forward {forward} and --up {up} must be at right angles")
    return way


def _within_half_turn(heading: float) -> float:
    return float((heading + np.pi) % (2 * np.pi) - np.pi)


def _source(kind: str, path: Path) -> str:
    return f"{kind} {path.name}, SHA-256 {hashlib.sha256(path.read_bytes()).hexdigest()}"


def _numbers(path: Path, widths: tuple[int, ...]) -> list[list[float]]:
    """Return the numbers of each line; a first line of words is passed over."""
    try:
        lines = list(csv.reader(path.read_text("utf-8-sig").splitlines()))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {what_to_do(error)}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a CSV file of text") from None
    rows = []
    for number, cells in enumerate(lines, start=1):
        filled = [cell.strip() for cell in cells if cell.strip()]
        if not filled:
            continue
        try:
            row = [float(cell) for cell in filled]
        except ValueError:
            if not rows and number == 1:
                continue
            raise InputError(
                f"{path}:{number}: {','.join(cells)!r} is not numbers; write {max(widths)} a line"
            ) from None
        if len(row) not in widths or not np.isfinite(row).all():
            wanted = " or ".join(str(width) for width in widths)
            raise InputError(f"{path}:{number}: {len(row)} numbers, {wanted} are needed")
        rows.append(row)
    return rows
