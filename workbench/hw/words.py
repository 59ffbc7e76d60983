"""What was written to a supply, from the bytes on its line, in words for people."""

from __future__ import annotations

from pymodbus.framer import FramerRTU

__all__ = ["written"]

_ONE, _SEVERAL = 0x06, 0x10  # Modbus functions that write registers
_HEADER = 7  # bytes of unit, function, address, count and length before the words of _SEVERAL


def written(data: bytes) -> str | None:
    """Return what a message to a supply writes, `register 8 = 452`, or None when it only asks.

    Args:
        data: one message, a Modbus RTU frame or a line of text.
    """
    if len(data) > 3 and FramerRTU.check_CRC(data[:-2], int.from_bytes(data[-2:], "big")):
        return _registers(data[:-2])
    lines = data.decode("ascii", errors="replace").split("\n")
    text = "; ".join(line.strip() for line in lines if line.strip())
    return None if "?" in text or not text else text


def _registers(frame: bytes) -> str | None:
    address = int.from_bytes(frame[2:4], "big")
    if frame[1] == _ONE:
        return f"register {address} = {int.from_bytes(frame[4:6], 'big')}"
    if frame[1] != _SEVERAL:
        return None
    words = [int.from_bytes(frame[i : i + 2], "big") for i in range(_HEADER, len(frame), 2)]
    return ", ".join(f"register {address + i} = {word}" for i, word in enumerate(words))
