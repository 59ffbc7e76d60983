"""What the operator does in the modes without a drive: hold the robot, then let it go."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PlannedRelease", "drop", "pull"]

_GRAVITY = 9.81  # [m/s^2] turns a pull into the weight that gives it


@dataclass(frozen=True)
class PlannedRelease:
    """A robot that is held, still, and let go.

    Args:
        asked: what is asked for, in words.
        name: short name for folders, `0.39N`.
        ready: prompts the operator what to hold and how, before the cameras start.
        now: prompts the operator to let go, after the rest.
        pull: force on T, in mode decay [N].
        height: of the foot above the floor, in mode drop [m].
    """

    asked: str
    name: str
    ready: str
    now: str
    pull: float | None = None
    height: float | None = None


def pull(force: float) -> PlannedRelease:
    """Return the release of a T that is pulled forward by a force [N]."""
    weight = 1000 * force / _GRAVITY
    return PlannedRelease(
        asked=f"pull {force:g} N",
        name=f"{force:g}N",
        ready=f"Clamp the foot. Pull T forward with {force:g} N, for example by a thread over a "
        f"pulley and a weight of {weight:.0f} g. Wait until all is still, then confirm.",
        now="Burn or cut the thread now, then confirm.",
        pull=force,
    )


def drop(height: float) -> PlannedRelease:
    """Return the release of a robot whose foot is held at a height above the floor [m]."""
    return PlannedRelease(
        asked=f"height {1000 * height:g} mm",
        name=f"{1000 * height:g}mm",
        ready=f"Hold the foot level, {1000 * height:g} mm above the floor. Wait until the beam is "
        "still, then confirm.",
        now="Let go of the foot now, then confirm.",
        height=height,
    )
