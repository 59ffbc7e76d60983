"""What a run was, in words."""

from __future__ import annotations

from workbench.bundle import Asked, ReleaseFacts
from workbench.modes import DRIVEN

__all__ = ["condition"]


def condition(asked: Asked, release: ReleaseFacts | None) -> str:
    """Return in words what the robot was put through.

    Args:
        asked: of the run.
        release: from where it was let go; None where nobody knows, or the motor drove it.
    """
    if asked.mode in DRIVEN:
        return _driven(asked)
    if release is None:
        return f"{asked.mode}, of which no release is known"
    if asked.mode == "decay":
        found = _found(release, 1.0, "N")
        upward = f" and upward with {release.pull_up_N:.3g} N" if release.pull_up_N else ""
        return f"decay, T pulled forward with {release.pull_N:.3g} N{upward}{found}"
    return f"drop from {1000 * release.height_m:.3g} mm{_found(release, 1000.0, 'mm')}"


def _driven(asked: Asked) -> str:
    if asked.levels:
        ends = f"{asked.speeds[0]:.2f} to {max(asked.speeds):.2f} rad/s"
        return f"{asked.mode}, staircase of {len(asked.levels)} levels, {ends}"
    if asked.speed_rad_s is None:
        return f"{asked.mode}, of which no speed is known"
    speed = f"{asked.mode}, {asked.speed_rad_s:.2f} rad/s"
    if asked.voltage_V is None:
        return speed
    return f"{speed} = {asked.voltage_V:g} V by calibration {asked.calibration}"


def _found(release: ReleaseFacts, scale: float, unit: str) -> str:
    if release.standard_error is None:
        return ""
    error = f"{scale * release.standard_error:.2g} {unit}"
    return f" \N{PLUS-MINUS SIGN} {error}, found in the data"
