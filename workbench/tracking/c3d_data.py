"""The header and the points of a C3D file, in any byte order.

`ezc3d` reads parameters and points, but 65,535 frames at most, the limit of the header's numbers.
Longer files state their length elsewhere, or have it in their size alone.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["BLOCK", "LAST", "PROCESSORS", "Header", "read_header", "read_points", "whole_frames"]

BLOCK = 512  # [bytes]
PROCESSORS = {84: "Intel", 85: "DEC", 86: "MIPS"}
LAST = 65535
"""The header cannot count further; longer files say this last frame."""


class Header(NamedTuple):
    """Content of the first block.

    Args:
        points: in a frame.
        analog: values in a frame besides.
        first: number of the first frame.
        last: number of the last frame, `LAST` where it is that or a later one.
        scale: of whole numbers, below zero where the file holds floats.
        start: of the data [bytes].
        processor: name of the byte order.
    """

    points: int
    analog: int
    first: int
    last: int
    scale: float
    start: int
    processor: str

    @property
    def frame_bytes(self) -> int:
        """Bytes of a frame; each point has a fourth number, its residual."""
        return (4 * self.points + self.analog) * (4 if self.scale < 0 else 2)


def read_header(data: bytes | memoryview) -> Header:
    """Return the header, in the byte order that the parameters name."""
    processor = PROCESSORS[data[BLOCK * (data[0] - 1) + 3]]
    order = ">" if processor == "MIPS" else "<"
    points, analog, first, last = struct.unpack_from(f"{order}4H", data, 2)
    (start,) = struct.unpack_from(f"{order}H", data, 16)
    scale = float(_floats(processor)(data[12:16])[0])
    return Header(points, analog, first, last, scale, BLOCK * (start - 1), processor)


def whole_frames(data: bytes | memoryview, header: Header) -> int:
    """Return how many frames the file has room for, without the zeros that fill its last block."""
    size = header.frame_bytes
    if size == 0 or header.start >= len(data):
        return 0
    count = (len(data) - header.start) // size
    filled = len(bytes(data).rstrip(b"\0"))
    least = -(-(filled - header.start) // size)
    return count if count - least > BLOCK // size else max(least, 0)


def read_points(data: bytes | memoryview, header: Header, count: int) -> NDArray[np.float64]:
    """Return points (count, k, 3) [unit of the file], NaN where the residual says not seen."""
    width = 4 * header.points + header.analog
    text = data[header.start : header.start + count * header.frame_bytes]
    if header.scale < 0:
        numbers = _floats(header.processor)(text)
    else:
        numbers = np.frombuffer(text, ">i2" if header.processor == "MIPS" else "<i2")
    frames = numbers.reshape(count, width)[:, : 4 * header.points].reshape(count, -1, 4)
    points = frames[:, :, :3].astype(float) * (1.0 if header.scale < 0 else header.scale)
    points[frames[:, :, 3] < 0] = np.nan
    return points


def _floats(processor: str) -> Callable[[bytes | memoryview], NDArray[np.float32]]:
    """Return the conversion from bytes to floats for a byte order."""
    if processor == "DEC":
        return _dec_floats
    order = ">f4" if processor == "MIPS" else "<f4"
    return lambda text: np.frombuffer(text, order)


def _dec_floats(text: bytes | memoryview) -> NDArray[np.float32]:
    """Return DEC's floats: the two words of an IEEE one in the other order, four times as large."""
    words = np.frombuffer(text, "<u2").reshape(-1, 2)[:, ::-1]
    return np.multiply(np.ascontiguousarray(words).view("<f4").ravel(), 0.25, dtype=np.float32)
