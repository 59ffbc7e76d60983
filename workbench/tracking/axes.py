"""The axes of an export in the bench, which the user states, as the file does not have them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError

__all__ = ["Axes"]

_LETTERS = "xyz"
_NAMES = ("x", "-x", "y", "-y", "z", "-z")


@dataclass(frozen=True)
class Axes:
    """Which axis of the export points up and which one forward.

    Bench axes are x forward, y left, z up. The default is Motive's: x_bench = -z, y_bench = -x,
    z_bench = y.

    Args:
        up: signed axis name, e.g. "y" or "-z".
        forward: signed axis name, not along `up`.

    Raises:
        InputError: an unknown name, or both along the same line.
    """

    up: str = "y"
    forward: str = "-z"

    def __post_init__(self) -> None:
        """Refuse axes that are not perpendicular."""
        for role, name in (("up", self.up), ("forward", self.forward)):
            if _plain(name) not in _NAMES:
                raise InputError(
                    f"tracking axis {role}: {name!r} is unknown; allowed are {', '.join(_NAMES)}"
                )
        if _plain(self.up)[-1] == _plain(self.forward)[-1]:
            raise InputError(
                f"tracking axes: forward {self.forward!r} is parallel to up {self.up!r}; "
                f"forward must lie along another axis, e.g. up 'y' and forward '-z'"
            )

    @property
    def export_to_bench(self) -> NDArray[np.float64]:
        """(3, 3) rotation matrix [1]; its rows are forward, left and up in the export's axes."""
        up, forward = _vector(self.up), _vector(self.forward)
        return np.array([forward, np.cross(up, forward), up])

    def points_to_bench(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points in bench axes, (..., 3) [m].

        Args:
            points: (..., 3) in the export's axes [m].
        """
        return _mapped(points, self.export_to_bench)

    def points_to_export(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points in the export's axes, (..., 3) [m].

        Args:
            points: (..., 3) in bench axes [m].
        """
        return _mapped(points, self.export_to_bench.T)

    def quaternions_to_bench(self, quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return rotations in bench axes, (..., 4) w, x, y, z [1].

        A rotation keeps its angle and its axis in space, only the axis' coordinates change. So a
        body that stands as it was defined has the identity in both.

        Args:
            quaternions: (..., 4) w, x, y, z in the export's axes [1].
        """
        return _turned(quaternions, self.export_to_bench)

    def quaternions_to_export(self, quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return rotations in the export's axes, (..., 4) w, x, y, z [1].

        Args:
            quaternions: (..., 4) w, x, y, z in bench axes [1].
        """
        return _turned(quaternions, self.export_to_bench.T)


def _plain(name: str) -> str:
    return name.strip().casefold().removeprefix("+")


def _vector(name: str) -> NDArray[np.float64]:
    vector = np.zeros(3)
    vector[_LETTERS.index(_plain(name)[-1])] = -1.0 if _plain(name).startswith("-") else 1.0
    return vector


def _mapped(points: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pick coordinates and signs: for long takes ten times as fast as a matrix product.

    The first axis, which is time, becomes the fast one.
    """
    pick, sign = np.abs(matrix).argmax(axis=1), matrix.sum(axis=1)
    if points.ndim == 1:
        return points[pick] * sign
    given = np.moveaxis(points, 0, -1)
    mapped = np.empty(given.shape)
    for i in range(3):
        np.multiply(given[..., pick[i], :], sign[i], out=mapped[..., i, :])
    return np.moveaxis(mapped, -1, 0)


def _turned(quaternions: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([quaternions[..., :1], quaternions[..., 1:] @ matrix.T], axis=-1)
