"""A simulated device on a loopback port: pymodbus' server in a thread of its own."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Literal

from pymodbus import FramerType
from pymodbus.constants import ExcCodes
from pymodbus.framer import FramerRTU
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from workbench.hw.simulated.faults import Fault, RequestError
from workbench.hw.simulated.riden import SimulatedRiden

__all__ = ["Framing", "serve"]

Framing = Literal["rtu", "tcp"]

READ, WRITE, WRITE_MANY = 3, 6, 16  # the function codes that Riden firmware knows
ADDRESSES = 65535
START_S, SETTLE_S = 10.0, 0.01


@contextmanager
def serve(
    device: SimulatedRiden, host: str = "127.0.0.1", port: int = 0, framing: Framing = "rtu"
) -> Iterator[str]:
    """Serve a device until the block ends; yield its address as `host:port`.

    Args:
        device: what answers.
        host: interface to listen on.
        port: 0 takes a free one.
        framing: RTU frames, as a serial bridge passes them on, or Modbus TCP.

    Raises:
        RuntimeError: when the port is taken.
    """
    started: Future[tuple[asyncio.AbstractEventLoop, asyncio.Event, int]] = Future()
    thread = threading.Thread(
        target=lambda: asyncio.run(_serve(device, host, port, framing, started)),
        name=f"simulated supply {host}:{port}",
    )
    thread.start()
    try:
        loop, stop, bound = started.result(START_S)
        try:
            yield f"{host}:{bound}"
        finally:
            loop.call_soon_threadsafe(stop.set)
    finally:
        thread.join()


async def _serve(
    device: SimulatedRiden, host: str, port: int, framing: Framing, started: Future
) -> None:
    wire = _Wire(device, framing)
    # one block under unit 0, which stands for all units: the device itself decides what exists
    registers = SimData(0, count=ADDRESSES, datatype=DataType.REGISTERS)
    try:
        server = ModbusTcpServer(
            SimDevice(0, [registers], action=_Bridge(device).action),
            framer=FramerType.RTU if framing == "rtu" else FramerType.SOCKET,
            address=(host, port),
            trace_packet=wire.trace,
        )
        await server.serve_forever(background=True)
    except BaseException as error:
        started.set_exception(error)
        return
    stop = asyncio.Event()
    bound = server.transport.sockets[0].getsockname()[1]  # pyright: ignore[reportAttributeAccessIssue]
    started.set_result((asyncio.get_running_loop(), stop, bound))
    await stop.wait()
    await asyncio.sleep(SETTLE_S)  # asyncio leaks a connection half accepted while it stops
    await server.shutdown()
    await asyncio.sleep(SETTLE_S)  # closed connections finish closing


class _Bridge:
    """Hands pymodbus' requests to the device."""

    def __init__(self, device: SimulatedRiden) -> None:
        self._device = device

    async def action(
        self,
        function: int,
        _start: int,
        address: int,
        count: int,
        registers: list[int],
        asked: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        """Carry out one request; pymodbus answers from `registers`."""
        try:
            if function == READ:
                registers[address : address + count] = self._device.read(address, count)
            elif function not in (WRITE, WRITE_MANY):
                return ExcCodes.ILLEGAL_FUNCTION
            elif asked is not None:  # pymodbus asks again without values to build the echo
                self._device.write(address, [int(word) for word in asked])
        except RequestError as error:
            return ExcCodes(error.code)
        return None


class _Wire:
    """Spoils the bytes that leave, as the fault that is on says."""

    def __init__(self, device: SimulatedRiden, framing: Framing) -> None:
        self._device = device
        self._framing = framing
        self._unit_at = 0 if framing == "rtu" else 6
        self._asked_unit = device.unit

    def trace(self, sending: bool, data: bytes) -> bytes:
        """Return the bytes that really go out; pymodbus calls this for each packet."""
        if not sending:
            self._asked_unit = data[self._unit_at] if len(data) > self._unit_at else -1
            return data
        faults = self._device.faults
        if self._asked_unit != self._device.unit or faults.strikes(Fault.SILENT):
            return b""
        if faults.strikes(Fault.LATE_REPLY):
            # blocks the loop on purpose: a serial device answers one request after the other
            time.sleep(faults.delay_s)
        if faults.strikes(Fault.BAD_CRC):
            return self._damaged(data)
        if faults.strikes(Fault.SHORT_REPLY):
            return data[:-3]
        if faults.strikes(Fault.WRONG_UNIT):
            return self._from_another_unit(data)
        return data

    def _damaged(self, data: bytes) -> bytes:
        at = len(data) - 1 if self._framing == "rtu" else 2  # CRC, or MBAP protocol id
        return data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :]

    def _from_another_unit(self, data: bytes) -> bytes:
        at = self._unit_at
        other = data[:at] + bytes([self._device.unit + 1]) + data[at + 1 :]
        if self._framing == "tcp":
            return other
        return other[:-2] + FramerRTU.compute_CRC(other[:-2]).to_bytes(2, "big")
