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

from workbench.errors import TakeError
from workbench.tracking.labels import bodies_by_label, warn_of_no_bodies
from workbench.tracking.missing import without_zeros
from workbench.tracking.source import LARGEST, Source, shown
from workbench.tracking.take import Cloud, Take, known

__all__ = ["is_c3d", "parse_c3d"]

_BLOCK = 512  # [bytes]
_KEY = 0x50
_PROCESSORS = (84, 85, 86)  # Intel, DEC, MIPS
_METRES = {
    "m": 1.0, "meter": 1.0, "meters": 1.0, "cm": 0.01, "centimeters": 0.01,
    "mm": 0.001, "millimeter": 0.001, "millimeters": 0.001, "in": 0.0254, "inches": 0.0254,
}  # fmt: skip
_RATES_HZ = (0.1, 1e5)
_LAST = 65535
"""The header cannot tell a later frame; longer files say this one."""
_LIBRARY_ERRORS = (
    RuntimeError, ValueError, KeyError, IndexError, TypeError, OSError, MemoryError
)  # fmt: skip


class _Points(NamedTuple):
    """What the file holds: k labels, (n, k, 3) in its unit, its rate [Hz], its first frame."""

    labels: list[str]
    position: NDArray[np.float64]
    unit: str
    rate: float
    first: int


def is_c3d(data: bytes) -> bool:
    """Tell a C3D file by its second byte and by the key of the parameters that the first names."""
    at = _BLOCK * (data[0] - 1) if data else 0
    is_keyed = len(data) >= _BLOCK and data[1] == _KEY and at > 0
    return is_keyed and at + 4 <= len(data) and data[at + 3] in _PROCESSORS


def parse_c3d(source: Source) -> Take:
    """Turn a C3D file into a take without poses.

    Raises:
        TakeError: `ezc3d` is missing, or the file is damaged.
    """
    points = _read(source)
    if points.unit.casefold() not in _METRES:
        raise _fault(source, f"POINT:UNITS is {shown(points.unit)}; known are {', '.join(_METRES)}")
    if not _RATES_HZ[0] <= points.rate <= _RATES_HZ[1]:
        raise _fault(source, f"POINT:RATE is {points.rate:g}; no rate of cameras [Hz]")
    indices = points.first + np.arange(len(points.position))
    position = points.position * _METRES[points.unit.casefold()]
    position = without_zeros(position, "points", indices, source)
    bodies, loose = bodies_by_label(points.labels, position, source)
    if not bodies:
        warn_of_no_bodies(points.labels, position, 1, source)
    source.warn(
        "a C3D file is usually z-up, a CSV export y-up; the file does not say: set the axes"
    )
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
    )


def _read(source: Source) -> _Points:
    library = _ezc3d(source)
    first, last = _check_size(source)
    _check_parameters(source)
    try:
        file = library.c3d(source.path)
        group, data = file["parameters"]["POINT"], file["data"]
        # the library turns points with a residual of -1, which were not seen, into NaN
        position = np.array(data["points"][:3], dtype=float).transpose(2, 1, 0)
        labels = _labels(group)
        unit = str(_value(group, "UNITS", "mm"))
        rate = float(_value(group, "RATE", file["header"]["points"]["frame_rate"]))
    except _LIBRARY_ERRORS as error:
        raise _fault(source, f"damaged: {error}") from error
    if position.size == 0:
        raise _fault(source, f"{position.shape[0]} frames of {position.shape[1]} points; no data")
    if last < _LAST and len(position) != last - first + 1:
        raise _fault(source, f"{len(position)} frames, the header says {first} to {last}")
    if len(labels) < position.shape[1]:
        raise _fault(source, f"{len(labels)} labels name {position.shape[1]} points")
    return _Points(labels, _checked(position, source), unit, rate, first)


def _checked(position: NDArray[np.float64], source: Source) -> NDArray[np.float64]:
    """Return positions (n, k, 3), all of a point NaN where a part is; refuse absurd magnitudes."""
    position = np.where(known(position)[:, :, None], position, np.nan)
    if (np.abs(position) > LARGEST).any():
        raise _fault(source, f"a point lies {np.nanmax(np.abs(position)):g} away; damaged?")
    return position


def _check_size(source: Source) -> tuple[int, int]:
    """Return the numbers of first and last frame; refuse a header that promises too much.

    A damaged count would make the library reserve memory for hours of data.
    """
    points, analog = struct.unpack_from("<2H", source.data, 2)
    first, last = struct.unpack_from("<2H", source.data, 6)
    scale, start = struct.unpack_from("<fH", source.data, 12)
    width = 4 if scale < 0 else 2
    promised = _BLOCK * (start - 1) + (last - first + 1) * (4 * points + analog) * width
    if last < first or promised > len(source.data):
        raise _fault(
            source,
            f"the header promises frames {first} to {last} of {points} points, "
            f"{promised} bytes, and the file has {len(source.data)}; cut off?",
        )
    return first, last


def _check_parameters(source: Source) -> None:
    """Walk the records of the parameter section; on a broken one the library may never return."""
    data = source.data
    start = _BLOCK * (data[0] - 1)
    end, at = min(len(data), start + _BLOCK * max(1, data[start + 2])), start + 4
    while at + 2 <= end and data[at] != 0:
        length, group = struct.unpack_from("<2b", data, at)
        link = at + 2 + abs(length)
        if link + 2 > end:
            break
        (step,) = struct.unpack_from("<H", data, link)
        told = link + 2 if group < 0 else _parameter_end(data, link + 2)
        needed = told + 1 + data[told] if told < end else end + 1  # a description comes last
        if step and link + step < needed:
            raise _fault(source, f"the parameter at byte {at} is longer than its record; damaged")
        at = link + step if step else end
    if at > end or data[at : at + 1] not in (b"", b"\0"):
        raise _fault(source, f"the parameters run beyond their section at byte {end}; damaged")


def _parameter_end(data: bytes, at: int) -> int:
    """Return where the values of a parameter end, whose type stands at a byte."""
    kind, rank = struct.unpack_from("<bB", data.ljust(at + 2, b"\0"), at)
    return at + 2 + rank + abs(kind) * prod(data[at + 2 : at + 2 + rank])


def _labels(group: Any) -> list[str]:
    """Return all labels; from the 256th on they stand in LABELS2, LABELS3."""
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
