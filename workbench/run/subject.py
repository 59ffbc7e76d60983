"""The robot that a run is made with, and when the cameras saw it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from workbench.run.takes import CameraTime
from workbench.schemas import Mode, ModelFile, ShapeFile

__all__ = ["CameraSpan", "Subject"]


@dataclass(frozen=True)
class Subject:
    """The robot that a run is made with."""

    model: ModelFile
    shape: ShapeFile
    mode: Mode
    pull: float | None = None
    """Force on T before the release [N], in mode decay."""
    height: float | None = None
    """Of the foot above the floor before the release [m], in mode drop."""


@dataclass(frozen=True)
class CameraSpan:
    """When the cameras ran.

    Args:
        start: by the bench's clock [s].
        stop: by the bench's clock [s].
        began: local wall time of the start.
        asked: when the operator was asked to let go, by the bench's clock [s]; None with a drive.
    """

    start: float
    stop: float
    began: datetime
    asked: float | None = None

    @property
    def cameras(self) -> CameraTime:
        """Return what a take of this span has to show."""
        return CameraTime(self.began, self.stop - self.start)
