"""C3D files of any byte order, written after the user guide: what no library writes."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["PROCESSORS", "Processor", "c3d_bytes"]

Processor = Literal["intel", "dec", "mips"]
Value = Sequence[str] | Sequence[float] | int
PROCESSORS: dict[Processor, int] = {"intel": 84, "dec": 85, "mips": 86}
BLOCK = 512


def c3d_bytes(
    points: NDArray[np.float64],
    labels: Sequence[str],
    *,
    processor: Processor = "intel",
    integers: bool = False,
    scale: float = 0.1,
    rate: float = 120.0,
    first: int = 1,
    screen: tuple[str, str] | None = None,
    trial: tuple[int, int] | None = None,
) -> bytes:
    """Return a file of points (n, k, 3) [mm]; a point that is NaN has the residual -1."""
    n, k = points.shape[:2]
    order = ">" if processor == "mips" else "<"
    point: dict[str, Value] = {
        "USED": k,
        "FRAMES": min(n, 65535) if min(n, 65535) < 32768 else min(n, 65535) - 65536,
        "SCALE": [scale if integers else -scale],
        "RATE": [rate],
        "LABELS": list(labels),
        "UNITS": ["mm"],
    }
    if screen is not None:
        point |= {"X_SCREEN": [screen[0]], "Y_SCREEN": [screen[1]]}
    groups: dict[str, Mapping[str, Value]] = {"POINT": point}
    if trial is not None:
        words = {f"ACTUAL_{e}_FIELD": f for e, f in zip(("START", "END"), trial, strict=True)}
        groups["TRIAL"] = {name: [float(f)] for name, f in words.items()}
    parameters = _parameters(groups, order, processor)
    start = 2 + len(parameters) // BLOCK
    last = min(first + n - 1, 65535)
    signed = scale if integers else -scale
    head = bytes([2, 0x50]) + struct.pack(f"{order}5H", k, 0, first, last, 10)
    head += _floats(np.array([signed]), order, processor) + struct.pack(f"{order}2H", start, 0)
    head += _floats(np.array([rate]), order, processor)
    data = _data(points, order, processor, scale if integers else None)
    return head.ljust(BLOCK, b"\0") + parameters + data + bytes(-len(data) % BLOCK)


def _data(
    points: NDArray[np.float64], order: str, processor: Processor, scale: float | None
) -> bytes:
    seen = np.asarray(np.isfinite(points).all(axis=2))
    places = np.where(seen[:, :, None], points, 0.0)
    words = np.concatenate([places, np.where(seen, 0.0, -1.0)[:, :, None]], axis=2)
    if scale is None:
        return _floats(words.ravel(), order, processor)
    words[:, :, :3] = np.round(words[:, :, :3] / scale)
    return words.astype(f"{order}i2").tobytes()


def _floats(values: NDArray[np.float64], order: str, processor: Processor) -> bytes:
    if processor != "dec":
        return values.astype(f"{order}f4").tobytes()
    # a DEC float is four times smaller, and its two words stand the other way round
    return (values * 4).astype("<f4").view("<u2").reshape(-1, 2)[:, ::-1].tobytes()


def _parameters(
    groups: Mapping[str, Mapping[str, Value]], order: str, processor: Processor
) -> bytes:
    records: list[bytes] = []
    for number, (name, values) in enumerate(groups.items(), start=1):
        records.append(_record(name, -number, b"\0", order))
        records += [
            _record(key, number, _value(value, order, processor) + b"\0", order)
            for key, value in values.items()
        ]
    body = b"".join(records) + b"\0\0"
    blocks = -(-(4 + len(body)) // BLOCK)
    return (bytes([1, 0x50, blocks, PROCESSORS[processor]]) + body).ljust(BLOCK * blocks, b"\0")


def _record(name: str, group: int, told: bytes, order: str) -> bytes:
    head = struct.pack("2b", len(name), group) + name.encode()
    return head + struct.pack(f"{order}H", 2 + len(told)) + told


def _value(value: Value, order: str, processor: Processor) -> bytes:
    if isinstance(value, int):
        return struct.pack("bB", 2, 0) + struct.pack(f"{order}h", value)
    if isinstance(value[0], str):
        texts = [str(text).encode() for text in value]
        width = max(map(len, texts))
        data = b"".join(text.ljust(width) for text in texts)
        return struct.pack("bBBB", -1, 2, width, len(texts)) + data
    numbers = np.array(value, dtype=float)
    return struct.pack("bBB", 4, 1, len(numbers)) + _floats(numbers, order, processor)
