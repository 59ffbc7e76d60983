"""Small exports, written out: the smallest files that show what public ones taught."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from workbench.tracking import Take

__all__ = [
    "DARK",
    "DARK_BODY",
    "DEFINED",
    "ROWS",
    "ROW_HEAD",
    "SEEN",
    "SEEN_BODY",
    "motive",
    "points",
    "six",
    "told",
]

ROW_HEAD = """\
comment,"NaturalPoint Trackable Export Data"
righthanded
info,framecount,2
info,trackablecount,1
"""
DEFINED = 'trackable,"Foot",1,3,0,0,0,0,0,.1,0,.1,0\n'
SEEN = """\
frame,0,0.000000,1,{id},0.1,0.2,0.3,0,0,0,1,0,0,0,3,0.1,0.2,0.3,1,0.1,0.2,0.4,2,0.1,0.3,0.3,3
"""
SEEN_BODY = (
    'trackable,0,0.000000,"Foot",1,0,3,0.1,0.2,0.3,0.1,0.2,0.4,0.1,0.3,0.3,'
    "0.1,0.2,0.3,0.1,0.2,0.4,0.1,0.3,0.3,1,1,1,1,1,1,0.0005\n"
)
DARK = "frame,1,0.010000,0,0\n"
DARK_BODY = (
    'trackable,1,0.010000,"Foot",1,1,3,0.1,0.2,0.3,0.1,0.2,0.4,0.1,0.3,0.3,'
    "NAN,NAN,NAN,NAN,NAN,NAN,NAN,NAN,NAN,0,0,0,1,1,1,0.0005\n"
)
ROWS = SEEN.format(id=1) + SEEN_BODY + DARK + DARK_BODY


def motive(
    columns: Sequence[tuple[str, str, str]],
    rows: Sequence[Sequence[object]],
    times: Sequence[float] | None = None,
    blank: str = "\n",
    **keys: Any,
) -> bytes:
    """Return a Motive file of columns (type, name, axis of the place, or nothing for the error)."""
    told = {
        "Format Version": "1.23", "Capture_Frame_Rate": 120, "Export_Frame_Rate": 120,
        "Total_Exported_Frames": len(rows), "Rotation_Type": "Quaternion",
        "Length_Units": "Meters", "Coordinate_Space": "Global",
    } | keys  # fmt: skip
    pairs = [f"{key.replace('_', ' ')},{value}" for key, value in told.items() if value is not None]
    kinds, names, axes = zip(*columns, strict=True)
    parts = ["Position" if axis in (*"XYZ",) else "Mean Marker Error" for axis in axes]
    head = [",".join(pairs) + blank, ",Type," + ",".join(kinds), ",Name," + ",".join(names)]
    head += [",ID," + ",".join('"1"' for _ in names), ",," + ",".join(parts)]
    head += ["Frame,Time (Seconds)," + ",".join(axis.upper() for axis in axes)]
    stamps = [k / 120 for k in range(len(rows))] if times is None else times
    body = [
        f"{k},{time:.6f}," + ",".join("" if cell is None else str(cell) for cell in row)
        for k, (time, row) in enumerate(zip(stamps, rows, strict=True))
    ]
    return "\n".join([*head, *body, ""]).encode()


def points(name: str, kind: str = "Rigid Body") -> list[tuple[str, str, str]]:
    """Return the columns of a place."""
    return [(kind, name, axis) for axis in "XYZ"]


def told(take: Take, words: str) -> bool:
    """Tell whether a warning has these words."""
    return any(words in warning for warning in take.warnings)


def six(k: int) -> list[float]:
    """Return places of two markers that move."""
    return [0.1 + 1e-3 * k, 0.2, 0.3, 0.15 + 1e-3 * k, 0.2, 0.3]
