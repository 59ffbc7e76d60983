"""Print the quality of a take, for the verbs that read an export or record one."""

from __future__ import annotations

from typing import Any

from workbench.cli.console import print_notes, show_table
from workbench.tracking import BodyNames

__all__ = ["print_quality"]

_KINDS = {"row": "row format", "motive": "Motive", "natnet": "NatNet", "c3d": "C3D", "trc": "TRC"}
_MOST_POINTS = 20
_MOST_IDS = 3


def print_quality(source: str, report: dict[str, Any], guess: BodyNames | None) -> None:
    """Print the quality report of one take, and which bodies look like the robot's."""
    kind = _KINDS[report["format"]]
    title = (
        f"{source}: {' '.join(filter(None, (kind, report['version'])))}, "
        f"{report['frames']} frames at {report['rate_hz']:.6g} Hz, "
        f"{report['first_time_s']:.3f} s to {report['last_time_s']:.3f} s"
    )
    rows = [
        [name, _reasons(body), str(body["gaps"]), str(body["longest_gap"]), _hidden(body),
         _position(body["mean_position_m"])]
        for name, body in report["bodies"].items()
    ]  # fmt: skip
    head = ["body", "missing", "gaps", "longest gap", "hidden markers", "mean position [m]"]
    if report["bodies"]:
        show_table(title, head, rows)
    else:
        _print_points(title, report["points"])
    print(f"clock: steps scatter by {1e3 * report['jitter_s']:.3f} ms")
    if report["start_time"]:
        print(f"start: {report['start_time']}")
    if guess is not None:
        print(f"looks like: foot {guess.foot}, top {guess.top}, rotor {guess.rotor}")
    print_notes(report["warnings"])


def _print_points(title: str, points: list[dict[str, Any]]) -> None:
    """Print the markers of a take without bodies; ids that follow one another are one marker."""
    rows = [
        [_ids(point["names"]), str(point["missing"]), str(point["gaps"]),
         str(point["longest_gap"]), _position(point["mean_position_m"])]
        for point in points[:_MOST_POINTS]
    ]  # fmt: skip
    show_table(title, ["marker", "missing", "gaps", "longest gap", "mean position [m]"], rows)
    if len(points) > _MOST_POINTS:
        print(f"and {len(points) - _MOST_POINTS} more markers; --json has all of them")


def _ids(names: list[str]) -> str:
    """Return the ids that a marker had, the first and the last of many."""
    if len(names) <= _MOST_IDS:
        return ", ".join(names)
    return f"{names[0]}, ... {names[-1]} ({len(names)} ids)"


def _reasons(body: dict[str, Any]) -> str:
    """Return how many samples of a body are missing, and why."""
    return " + ".join(f"{count} {reason}" for reason, count in body["reasons"].items()) or "0"


def _hidden(body: dict[str, Any]) -> str:
    """Return in how many samples each marker is hidden; a dash where the file does not say."""
    counts = list(body["markers"].values())
    if all(count is None for count in counts):
        return "-"
    return " ".join("-" if count is None else str(count) for count in counts)


def _position(mean: list[float] | None) -> str:
    return "never seen" if mean is None else ", ".join(f"{value:.3f}" for value in mean)
