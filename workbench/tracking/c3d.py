"""Read C3D files: labelled points and nothing else, so bodies come from the labels.

Blocks and words are those of the C3D user guide (www.c3d.org); `ezc3d` reads the data.
"""

from __future__ import annotations

import struct
from math import prod
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, TakeError
from workbench.tracking.axes import Axes
from workbench.tracking.c3d_data import (
    BLOCK,
    LAST,
    PROCESSORS,
    Header,
    read_header,
    read_points,
    whole_frames,
)
from workbench.tracking.clock import is_rate
from workbench.tracking.labels import bodies_by_label, warn_of_no_bodies
from workbench.tracking.missing import without_zeros
from workbench.tracking.source import LARGEST, Source, shown
from workbench.tracking.take import Cloud, Take, known

__all__ = ["is_c3d", "parse_c3d"]

_KEY = 0x50
_METRES = {
    "m": 1.0, "meter": 1.0, "meters": 1.0, "cm": 0.01, "centimeters": 0.01,
    "mm": 0.001, "millimeter": 0.001, "millimeters": 0.001, "in": 0.0254, "inches": 0.0254,
}  # fmt: skip
_LIBRARY_ERRORS = (RuntimeError, ValueError, KeyError, IndexError, TypeError, OSError, MemoryError)


class _Points(NamedTuple):
    """Points of the file: k labels, (n, k, 3) in its unit, its rate [Hz], its first frame.

    `screen` has its axes that point up and to the right on a screen, empty where it names none.
    """

    labels: list[str]
    position: NDArray[np.float64]
    unit: str
    rate: float
    first: int
    screen: tuple[str, ...]


def is_c3d(data: bytes | memoryview) -> bool:
    """Recognize a C3D file by its second byte and by the key of the parameters' block."""
    at = BLOCK * (data[0] - 1) if data else 0
    is_keyed = len(data) >= BLOCK and data[1] == _KEY and at > 0
    return is_keyed and at + 4 <= len(data) and data[at + 3] in PROCESSORS


def parse_c3d(source: Source) -> Take:
    """Turn a C3D file into a take without poses.

    Raises:
        TakeError: `ezc3d` is missing, or the file is damaged.
    """
    points = _read(source)
    if points.unit.casefold() not in _METRES:
        raise _fault(source, f"POINT:UNITS is {shown(points.unit)}; known are {', '.join(_METRES)}")
    if not is_rate(points.rate):
        raise _fault(source, f"POINT:RATE is {points.rate:g}; no rate of cameras [Hz]")
    indices = points.first + np.arange(len(points.position))
    metres = _METRES[points.unit.casefold()]
    position = points.position * metres
    position = without_zeros(position, "points", indices, source.warn)
    bodies, loose = bodies_by_label(points.labels, position, source)
    if not bodies:
        warn_of_no_bodies(points.labels, position, 1, source)
    axes = _axes(points.screen, source)
    names = np.array([points.labels[k] for k in loose], dtype=object)
    return Take(
        path=source.path,
        sha256=source.sha256(),
        format="c3d",
        version="",
        rate_hz=points.rate,
        jitter_s=0.0,
        indices=indices,
        times=indices / points.rate,
        bodies=bodies,
        cloud=Cloud(position[:, loose], np.broadcast_to(names, (len(position), len(loose)))),
        header={"POINT:UNITS": points.unit, "POINT:RATE": f"{points.rate:g}"},
        warnings=tuple(source.warnings),
        axes=axes,
        unit_m=metres,
    )


def _axes(screen: tuple[str, ...], source: Source) -> Axes | None:
    """Return the axes that the file names, None where it names none."""
    up, right = (name.strip().casefold().removeprefix("+") for name in screen)
    try:
        return Axes(up=up, forward=right)
    except InputError:
        source.warn(
            "a C3D file is usually z-up, a CSV export y-up; the file does not say: set the axes"
        )
        return None


def _read(source: Source) -> _Points:
    library = _ezc3d(source)
    header = _check_size(source)
    _check_parameters(source)
    try:
        file = library.c3d(source.path)
        parameters, data = file["parameters"], file["data"]
        group = parameters["POINT"]
        # the library turns points with a residual of -1, which were not seen, into NaN
        position = np.array(data["points"][:3], dtype=float).transpose(2, 1, 0)
        labels = _labels(group)
        unit = str(_value(group, "UNITS", "mm"))
        rate = float(_value(group, "RATE", file["header"]["points"]["frame_rate"]))
        screen = tuple(str(_value(group, f"{axis}_SCREEN", "")) for axis in "YX")
        count = _frames(header, parameters, source)
    except _LIBRARY_ERRORS as error:
        raise _fault(source, f"damaged: {error}") from error
    if count > len(position):  # the library counts no further than the header
        position = read_points(source.data, header, count)
    elif header.last == LAST:  # or to the end of the last block, beyond the last frame
        position = position[:count]
    if position.size == 0:
        raise _fault(source, f"{position.shape[0]} frames of {position.shape[1]} points; no data")
    if len(position) != count:
        raise _fault(
            source, f"{len(position)} frames can be read of the {count} that the file states"
        )
    if len(labels) < position.shape[1]:
        raise _fault(source, f"{len(labels)} labels name {position.shape[1]} points")
    return _Points(labels, _checked(position, source), unit, rate, header.first, screen)


def _checked(position: NDArray[np.float64], source: Source) -> NDArray[np.float64]:
    """Return positions (n, k, 3), all of a point NaN where a part is; refuse absurd magnitudes."""
    position = np.where(known(position)[:, :, None], position, np.nan)
    if (np.abs(position) > LARGEST).any():
        raise _fault(source, f"a point lies {np.nanmax(np.abs(position)):g} away; damaged?")
    return position


def _check_size(source: Source) -> Header:
    """Return the header; refuse one of more data than the file has.

    A damaged count would make the library reserve memory for hours of data.
    """
    header = read_header(source.data)
    if header.processor == "MIPS":
        raise _fault(
            source, "its byte order is that of MIPS processors, which is not read; convert the file"
        )
    promised = header.start + (header.last - header.first + 1) * header.frame_bytes
    if header.last < header.first or promised > len(source.data):
        raise _fault(
            source,
            f"the header promises frames {header.first} to {header.last} of {header.points} "
            f"points, {promised} bytes, and the file has {len(source.data)}; cut off?",
        )
    return header


def _frames(header: Header, parameters: Any, source: Source) -> int:
    """Return the number of frames by the header, or the parameters where it cannot count them."""
    counted = header.last - header.first + 1
    fitting = whole_frames(source.data, header)
    stated = _stated_frames(parameters)
    if stated is not None and 0 <= stated - fitting <= BLOCK // max(header.frame_bytes, 1):
        stated = fitting  # the library's own count, which takes the filling of the last block in
    if stated is not None and stated > counted:
        if header.start + stated * header.frame_bytes > len(source.data):
            raise _fault(
                source,
                f"the parameters promise {stated} frames, there is room for {fitting}; cut off?",
            )
        return stated
    wraps = header.last == LAST or (fitting - counted) % (LAST + 1) == 0
    if fitting > counted and not wraps:
        source.warn(
            f"the header states {counted} frames, the file has room for {fitting}; those that it "
            "states are read"
        )
    return max(counted, fitting) if wraps else counted


def _stated_frames(parameters: Any) -> int | None:
    """Return the count that TRIAL states in words of 16 bits or floats, or POINT in a float."""
    ends: list[int] = []
    for name in ("ACTUAL_START_FIELD", "ACTUAL_END_FIELD"):
        words = list(parameters.get("TRIAL", {}).get(name, {}).get("value", []))
        if words:
            low, high = int(words[0]), int(words[1]) if len(words) > 1 else 0
            ends.append(low % 65536 + 65536 * (high % 65536) if len(words) > 1 else low)
    if len(ends) == 2:
        return ends[1] - ends[0] + 1
    frames = parameters["POINT"].get("FRAMES", {}).get("value", [])
    return int(frames[0]) if len(frames) and frames[0] > 0 else None


def _check_parameters(source: Source) -> None:
    """Walk the records of the parameter section; on a broken one the library may never return."""
    data = source.data
    start = BLOCK * (data[0] - 1)
    end, at = min(len(data), start + BLOCK * max(1, data[start + 2])), start + 4
    while at + 2 <= end and data[at] != 0:
        length, group = struct.unpack_from("<2b", data, at)
        link = at + 2 + abs(length)
        if link + 2 > end:
            break
        (step,) = struct.unpack_from("<H", data, link)
        stop = link + 2 if group < 0 else _parameter_end(data, link + 2)
        # a description comes last
        needed = stop + 1 + data[stop] if stop < end else end + 1
        if step and link + step < needed:
            raise _fault(source, f"the parameter at byte {at} is longer than its record; damaged")
        at = link + step if step else end
    if at > end or data[at : at + 1] not in (b"", b"\0"):
        raise _fault(source, f"the parameters run beyond their section at byte {end}; damaged")


def _parameter_end(data: bytes | memoryview, at: int) -> int:
    """Return the end of a parameter's values, whose type is at byte `at`."""
    kind, rank = struct.unpack("<bB", bytes(data[at : at + 2]).ljust(2, b"\0"))
    return at + 2 + rank + abs(kind) * prod(data[at + 2 : at + 2 + rank])


def _labels(group: Any) -> list[str]:
    """Return all labels; from the 256th on they are in LABELS2, LABELS3."""
    labels: list[str] = []
    for key in ("LABELS", *(f"LABELS{k}" for k in range(2, 10))):
        if key in group:
            labels.extend(str(label) for label in group[key]["value"])
    return labels


def _value(group: Any, key: str, otherwise: Any) -> Any:
    return next(iter(group[key]["value"]), otherwise) if key in group else otherwise


def _fault(source: Source, cause: str) -> TakeError:
    return TakeError(f"{source.path}: C3D: {cause}")


def _ezc3d(source: Source) -> ModuleType:
    try:
        import ezc3d
    except ModuleNotFoundError:
        raise _fault(
            source, "reading it needs the package ezc3d; pip install hopping-workbench[c3d]"
        ) from None
    return ezc3d
