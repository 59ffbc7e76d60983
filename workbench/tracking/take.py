"""One OptiTrack export in memory: what every reader returns and every writer takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean
from workbench.timeseries import TimeSeries
from workbench.tracking.axes import Axes

__all__ = [
    "BodyTake",
    "Cloud",
    "SampleStatus",
    "Take",
    "any_finite",
    "known",
    "samples_of",
    "time_last",
]

_BLOCK = 4096  # samples
_POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")


class SampleStatus(IntEnum):
    """Whether a sample of a body counts as seen, and why not."""

    SEEN = 0
    BLANK = 1
    """The cells are empty or NAN."""
    LOST = 2
    """The lost counter is above zero, or none of the body's raw markers is visible."""
    PLACEHOLDER = 3
    """An exact zero pose, as Motive writes before the first sighting."""
    FROZEN = 4
    """The last pose repeated, as Motive writes after a loss."""
    GLITCH = 5
    """Rejected by cleaning."""
    FILLED = 6
    """Interpolated by cleaning."""
    POOR = 7
    """Its error is above the limit that was stated."""


@dataclass(frozen=True, eq=False)
class BodyTake:
    """One rigid body over the n samples of a take, in the file's axes.

    Args:
        name: the body's name as the file gives it.
        id: the body's identifier as text.
        position: (n, 3) pose position [m], NaN where the file gives none.
        quaternion: (n, 4) w, x, y, z [1], NaN where the file gives none.
        measured: (n, m, 3) markers as the cameras saw them [m], NaN where not seen.
        solved: (n, m, 3) markers as the fitted body places them [m].
        marker_names: m names; a slot is the same marker in `measured` and `solved`.
        missing: (n,) values of `SampleStatus`.
        reported_error: (n,) the body's error by the export: [m] in Motive files, in an undocumented
            unit in row formats; None where the file gives none.
        marker_quality: (n, m) from 0 to 1 [1]; None where the file gives none.
        solved_only: names of the markers without measured positions in the file.
    """

    name: str
    id: str
    position: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    measured: NDArray[np.float64]
    solved: NDArray[np.float64]
    marker_names: tuple[str, ...]
    missing: NDArray[np.int8]
    reported_error: NDArray[np.float64] | None = None
    marker_quality: NDArray[np.float64] | None = None
    solved_only: frozenset[str] = frozenset()

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(n,) True where the body was really seen."""
        return self.missing == SampleStatus.SEEN

    def without(self, rows: NDArray[np.bool_], reason: SampleStatus) -> BodyTake:
        """Return the body with its seen samples in some rows made missing.

        Args:
            rows: (n,) True in those.
            reason: why they do not count as seen.
        """
        rows = rows & self.seen
        return replace(
            self,
            position=np.where(rows[:, None], np.nan, self.position),
            quaternion=np.where(rows[:, None], np.nan, self.quaternion),
            measured=np.where(rows[:, None, None], np.nan, self.measured),
            missing=np.where(rows, reason, self.missing).astype(np.int8),
        )

    @property
    def centroid_measured(self) -> NDArray[np.float64]:
        """(n, 3) centroid of the measured markers [m], NaN unless all are visible."""
        return _centroid(self.measured)

    @property
    def centroid_solved(self) -> NDArray[np.float64]:
        """(n, 3) centroid of the solved markers [m]; stays finite while a body is lost."""
        return _centroid(self.solved)

    @cached_property
    def fit_error(self) -> NDArray[np.float64]:
        """(n,) root mean square distance of visible measured to solved markers [m], or NaN."""
        squares = np.sum((self.measured - self.solved) ** 2, axis=2)
        known = np.isfinite(squares)
        count = np.where(known.any(axis=1), known.sum(axis=1), np.nan)
        return np.sqrt(np.where(known, squares, 0.0).sum(axis=1) / count)


@dataclass(frozen=True, eq=False)
class Cloud:
    """The points that belong to no body.

    Args:
        position: (n, k, 3) [m], NaN where a slot is empty. In row formats a slot is an index into
            the frame's list and may hold another marker in the next frame.
        names: (n, k) the name of the marker in each slot [text]; empty where there is none.
    """

    position: NDArray[np.float64]
    names: NDArray[np.object_]

    @classmethod
    def empty(cls, n: int) -> Cloud:
        """Return a cloud of n samples without points."""
        return cls(np.empty((n, 0, 3)), np.empty((n, 0), dtype=object))


@dataclass(frozen=True, eq=False)
class Take:
    """One export file.

    Args:
        path: the file's name as the user gave it.
        sha256: of the file's bytes.
        format: "row" (Tracking Tools), "motive", "c3d", "trc", or "natnet" (a recorded stream).
        version: the format's version, e.g. "1.1" or "1.23".
        rate_hz: samples per second.
        jitter_s: standard deviation of the file's own time steps about their median [s].
        indices: (n,) frame indices.
        times: (n,) [s]; index / rate in Motive and C3D files, in TRC files from the first frame's
            time on, the file's clock in row formats.
        bodies: by name, in the file's order.
        cloud: the points outside the bodies.
        header: the file's own keys and texts, untouched.
        warnings: what a user should know before trusting the numbers.
        began: local wall time of frame 0; two where morning or afternoon is unknown, none where the
            file has no start time.
        axes: up and forward where the file names them, None where it does not.
        unit_m: metres in the unit of length that the file was read in.
        unit_stated: whether the file says that unit.
    """

    path: str
    sha256: str
    format: str
    version: str
    rate_hz: float
    jitter_s: float
    indices: NDArray[np.int64]
    times: NDArray[np.float64]
    bodies: Mapping[str, BodyTake]
    cloud: Cloud
    header: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    began: tuple[datetime, ...] = ()
    axes: Axes | None = None
    unit_m: float = 1.0
    unit_stated: bool = True

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.indices)

    def __repr__(self) -> str:
        """Return it in two lines: the file and its clock, the bodies."""
        last = f", {self.times[0]:.3f} s to {self.times[-1]:.3f} s" if len(self) else ""
        bodies = ", ".join(
            f"{name} (seen {np.mean(body.seen):.1%})" for name, body in self.bodies.items()
        )
        return (
            f"Take {self.path}: {self.format} {self.version}, {len(self)} frames at "
            f"{self.rate_hz:.6g} Hz{last}\n  bodies: {bodies or 'none'}"
        )

    def poses(self, *bodies: str) -> TimeSeries:
        """Return poses in the file's axes: position `NAME_x_m` ... [m], quaternion `NAME_qw` ...

        A body's sample is valid where it was really seen.

        Args:
            bodies: names; all where left out.

        Raises:
            InputError: when the take has no body of a name.
        """
        columns: dict[str, NDArray[np.float64]] = {}
        valid: dict[str, NDArray[np.bool_]] = {}
        for name in bodies or tuple(self.bodies):
            if name not in self.bodies:
                has = ", ".join(self.bodies) or "none"
                near = did_you_mean(name, self.bodies)
                raise InputError(f"{self.path}: no body {name!r}{near}; its bodies are {has}")
            body = self.bodies[name]
            both = np.hstack([self.counted_position(name), body.quaternion])
            pose = {f"{name}_{end}": both[:, k] for k, end in enumerate(_POSE)}
            columns |= pose
            valid |= dict.fromkeys(pose, body.seen)
        return TimeSeries.of(self.times, columns, valid)

    def counted_position(self, name: str) -> NDArray[np.float64]:
        """Return the (n, 3) position that the quality report is based on [m].

        That is the pose position in Motive files. Row formats give no pose while a body is lost, so
        there it is the centroid of the model markers, which Appendix C of the thesis uses too. A
        body of markers alone is where the centroid of all its markers is.
        """
        body = self.bodies[name]
        if self.format == "row" and any_finite(body.solved):
            return body.centroid_solved
        return body.position if any_finite(body.position) else body.centroid_measured

    def body_path(self, name: str, some: slice = slice(None)) -> NDArray[np.float64]:
        """Return a body's path in some samples (k, 3) [m], NaN where it is not seen.

        By all its markers, else its pose.
        """
        body = self.bodies[name]
        path = _centroid(body.measured[some])
        if not known(path).any():
            path = self.counted_position(name)[some]
        return np.where(body.seen[some, None], path, np.nan)


def known(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return (...,) True where all coordinates of a point are finite.

    Args:
        points: (..., k) [any unit].
    """
    # a sum is finite where all its parts are; reducing flags along a short axis is slow
    return np.isfinite(np.einsum("...k->...", points))


def any_finite(values: NDArray[np.float64]) -> bool:
    """Return whether any value is finite; stop at the first.

    Args:
        values: (n, ...) [any unit].
    """
    starts = range(0, len(values), _BLOCK)
    return any(bool(np.isfinite(values[at : at + _BLOCK]).any()) for at in starts)


def samples_of(values: NDArray[np.float64], rows: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return some samples, (k, ...) [as given], with samples along the fast axis.

    A fifth of the time of `values[rows]`, and what follows along that axis is faster too. Nothing
    is copied where all samples are wanted.

    Args:
        values: (n, ...) [any unit].
        rows: (k,) which of them.
    """
    if len(rows) == len(values) and (rows == np.arange(len(rows))).all():
        return values
    return np.moveaxis(np.moveaxis(values, 0, -1).take(rows, axis=-1), -1, 0)


def time_last(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (..., n) [as given] in one piece of memory, for compiled loops over samples.

    Nothing is copied where samples run along the fast axis already, as they do behind a reader.

    Args:
        values: (n, ...) [any unit].
    """
    return np.ascontiguousarray(np.moveaxis(values, 0, -1))


def _centroid(markers: NDArray[np.float64]) -> NDArray[np.float64]:
    if markers.shape[1] == 0:
        return np.full((len(markers), 3), np.nan)
    return np.einsum("nmk->nk", markers) / markers.shape[1]
