"""What a run was, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from workbench.motion import DRIVEN

__all__ = ["condition"]


def condition(facts: Mapping[str, Any]) -> str:
    """Return in words what the robot was put through.

    Args:
        facts: of the run's manifest.
    """
    driven = facts["mode"] in DRIVEN
    if driven and facts.get("levels"):
        speeds = [speed for _, _, speed in facts["levels"]]
        ends = f"{speeds[0]:.2f} to {max(speeds):.2f} rad/s"
        return f"{facts['mode']}, staircase of {len(speeds)} levels, {ends}"
    if driven and facts.get("speed_rad_s") is None:
        return f"{facts['mode']}, of which no speed is known"
    if driven:
        told = f"{facts['mode']}, {facts['speed_rad_s']:.2f} rad/s"
        if facts["voltage_V"] is None:
            return told
        return f"{told} = {facts['voltage_V']:g} V by calibration {facts['calibration']}"
    release = facts.get("release")
    if release is None:
        return f"{facts['mode']}, of which no release is known"
    pull, height, error = (release[key] for key in ("pull_N", "height_m", "standard_error"))
    if facts["mode"] == "decay":
        found = "" if error is None else f" \N{PLUS-MINUS SIGN} {error:.2g} N, found in the data"
        up = release.get("pull_up_N")
        upward = f" and upward with {up:.3g} N" if up else ""
        return f"decay, T pulled forward with {pull:.3g} N{upward}{found}"
    found = (
        "" if error is None else f" \N{PLUS-MINUS SIGN} {1000 * error:.2g} mm, found in the data"
    )
    return f"drop from {1000 * height:.3g} mm{found}"
