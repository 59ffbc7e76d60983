"""Exports of the cameras' software: what one holds, before anyone cleans it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from workbench.tracking import Take

__all__ = ["read_take", "take_quality"]


def read_take(path: str | Path) -> Take:
    """Read an export of any version: Motive CSV, row format, C3D, TRC.

    Args:
        path: of the export.

    Returns:
        The take, in the file's axes, lengths in m: `poses("Foot").table()` is one body's position
        [m] and quaternion (w, x, y, z), null where it was not really seen.

    Raises:
        TakeError: when it cannot be read; file, line and cause are named.

    Example:
        >>> take = wb.read_take("Take 2026-03-12.csv")
        >>> take.poses("Foot").table().to_pandas()
    """
    from workbench.tracking import read_take as read

    return read(Path(path))


def take_quality(take: Take) -> dict[str, Any]:
    """Return the quality report of a take, as `workbench ingest TAKE --json` prints it.

    Args:
        take: that was read.

    Returns:
        `rate_hz`, `frames`, `first_time_s`, `last_time_s`, `warnings`, and for each of `bodies` how
        many samples are `missing`, in how many `gaps`, for which `reasons`, and `mean_position_m`.

    Example:
        >>> wb.take_quality(take)["bodies"]["Foot"]["missing"]
    """
    from workbench.tracking import quality

    return quality(take)
