"""One Modbus link: pymodbus frames the bytes, this file guards what it leaves open.

RTU replies carry no number, so a late one looks like the answer to the next request. Hence: an
exchange that did not end well leaves the line suspect, and a suspect line is drained until it was
quiet, and then used only once a block of a length of its own was answered: a supply answers in
order, so whatever came before that was late, however late; counts, function codes and echoes are
checked; successive reads of a block ask for different lengths, so that an answer that comes twice
does not fit; and a lost connection is never reopened in passing, because another device may be
there now.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from contextlib import suppress

from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusException, ModbusIOException
from pymodbus.pdu import ModbusPDU

from workbench.errors import HardwareError, SafetyStop
from workbench.hw.clock import Clock
from workbench.hw.connection import Connection, new_client, not_reachable
from workbench.hw.wirelog import WireLog, Wiretap

__all__ = ["Transport"]

NewClient = Callable[
    [Connection, Callable[[bool, bytes], bytes]], ModbusSerialClient | ModbusTcpClient
]

MOST_REGISTERS = 20  # longer reads fail silently (instruments survey 1.2)
DRAIN_ROUNDS = 20
MARK_ROUNDS = 2
READ, WRITE = 3, 6  # function codes

EXCEPTIONS = {
    1: "illegal function: it does not know this kind of request",
    2: "illegal address: it has no such register, or one that cannot be written",
    3: "illegal value: it refuses this number",
    4: "device failure: it could not carry the request out",
    5: "acknowledge: it needs longer and has not finished",
    6: "busy: it is occupied, ask again later",
    10: "gateway: no path to the device",
    11: "gateway: the device behind it does not answer",
}


class Transport:
    """A link to one unit, open from the start; every byte goes to the wire log.

    Args:
        connection: where the unit is.
        writable: the only registers that a caller may write; calibration and boot loader are
            never among them.
        clock: stamps the wire log.
        wire_log: takes one JSON line per message: sent, received or discarded bytes in hex. When
            it raises, nothing but urgent writes goes out any more; reading goes on.
        mark: start and length of a block that no other read has the length of; without it a
            suspect line is drained until it was quiet for two timeouts.
        new_client: makes the pymodbus client, from the connection and what traces its packets.

    Raises:
        HardwareError: when nothing can be opened there.
    """

    def __init__(
        self,
        connection: Connection,
        *,
        writable: frozenset[int],
        clock: Clock,
        wire_log: WireLog,
        mark: tuple[int, int] | None = None,
        new_client: NewClient = new_client,
    ) -> None:
        self.connection = connection
        self._writable = writable
        self._tap = Wiretap(wire_log, clock)
        self._lock = threading.RLock()
        self._heard = b""
        self._mark = mark
        self._suspect = False  # an answer may still be under way
        self._turn = 0  # how many reads with spare registers there were
        self._client = new_client(connection, self._trace)
        self.open()

    @property
    def connected(self) -> bool:
        """Whether the link is open, as far as is known."""
        return self._client.connected

    def open(self) -> None:
        """Open the link, again after a loss; the caller then checks who is there.

        Raises:
            HardwareError: when nothing can be opened there.
        """
        self._suspect = False
        if not self._client.connect():
            raise HardwareError(not_reachable(self.connection))

    def close(self) -> None:
        """Close the link; closing twice does no harm."""
        self._client.close()

    def read(self, address: int, count: int, *, spare: int = 0, again: bool = True) -> list[int]:
        """Read holding registers.

        Args:
            address: the first.
            count: how many, 20 at most with the spare ones.
            spare: how many more there are behind them that may be read along, for a length that
                differs from read to read.
            again: ask once more when the answer is missing or damaged.

        Raises:
            HardwareError: when there is no good answer; it names the device's reason.
        """
        if not 1 <= count <= count + spare <= MOST_REGISTERS:
            raise ValueError(f"{count + spare} registers asked for; 1 to {MOST_REGISTERS} can be")
        try:
            return self._read_once(address, count, spare)
        except HardwareError:
            if not (again and self._suspect):  # the device gave its reason, or the link is gone
                raise
            return self._read_once(address, count, spare)

    def write(self, address: int, word: int, *, urgent: bool = False) -> None:
        """Write one register and check the echo; never retried here.

        Args:
            address: register.
            word: 0 to 65535.
            urgent: send even on a suspect line, for switching off; the echo may then be foreign.

        Raises:
            SafetyStop: when the register must never be written; nothing was sent.
            HardwareError: when it was not acknowledged; it may have been carried out. Also when
                the wire log cannot be written; then nothing was sent.
        """
        if address not in self._writable:
            allowed = ", ".join(map(str, sorted(self._writable)))
            raise SafetyStop(
                f"{self.connection.address}: register {address} is none of those that may be "
                f"written ({allowed}), calibration and boot loader lie among the others; "
                "nothing was sent"
            )
        what = f"write of {word} to register {address}"
        if self._tap.fault and not urgent:
            raise self._fault(what, f"not sent, as the wire log failed ({self._tap.fault})")
        unit = self.connection.unit

        def ask() -> ModbusPDU:
            return self._client.write_register(address, word, device_id=unit)

        with self._lock:
            echo = self._exchange(ask, WRITE, what, rtu_length=8, urgent=urgent)
            if (echo.address, echo.registers) != (address, [word]):
                raise self._fault(what, f"echoed {echo.registers} to register {echo.address}")
            self._suspect = False

    def _read_once(self, address: int, least: int, spare: int) -> list[int]:
        with self._lock:
            count = least + self._turn % (spare + 1)
            self._turn += spare > 0
        what = f"read of {count} registers from {address}"
        unit = self.connection.unit

        def ask() -> ModbusPDU:
            return self._client.read_holding_registers(address, count=count, device_id=unit)

        with self._lock:
            answer = self._exchange(ask, READ, what, rtu_length=5 + 2 * count)
            if len(answer.registers) != count:
                raise self._fault(what, f"answered with {len(answer.registers)} registers")
            self._suspect = False
            return list(answer.registers[:least])

    def _exchange(
        self,
        ask: Callable[[], ModbusPDU],
        function: int,
        what: str,
        *,
        rtu_length: int,
        urgent: bool = False,
    ) -> ModbusPDU:
        """Send and receive once; the line stays suspect until the caller has checked the rest."""
        if not self.connected:
            raise self._fault(what, "the connection is lost; reopen it and check who is there")
        try:
            if self._suspect and not urgent:
                self._clear(what)
            self._discard_waiting()
            self._suspect, self._heard = True, b""
            answer = self._logged(ask)
        except ModbusIOException:
            raise self._fault(what, self._diagnose(rtu_length)) from None
        except (ModbusException, OSError) as error:
            self._client.close()
            self._suspect = False  # no answer can come any more
            raise self._fault(what, f"the connection was lost ({error})") from error
        if answer.function_code & 0x7F != function:  # the top bit marks an exception
            raise self._fault(what, f"answered function {answer.function_code}, not {function}")
        if answer.isError():
            self._suspect = False
            code = answer.exception_code
            raise self._fault(what, f"exception {code}, {EXCEPTIONS.get(code, 'not in the norm')}")
        return answer

    def _logged(self, ask: Callable[[], ModbusPDU]) -> ModbusPDU:
        try:
            return ask()
        finally:
            self._tap.note("received", self._heard)

    def _clear(self, what: str) -> None:
        """Wait until no answer to an earlier request can come any more."""
        self._drain(2 if self._mark is None else 1)
        if self._mark is None:
            return
        start, count = self._mark
        for _ in range(MARK_ROUNDS):
            self._discard_waiting()
            self._heard = b""
            with suppress(ModbusIOException):
                answer = self._logged(
                    lambda: self._client.read_holding_registers(
                        start, count=count, device_id=self.connection.unit
                    )
                )
                if answer.function_code == READ and len(answer.registers) == count:
                    return
        raise self._fault(what, f"not sent, as before it {self._diagnose(5 + 2 * count)}")

    def _drain(self, timeouts: int) -> None:
        """Wait until nothing came for so many timeouts; `recv` itself waits for one."""
        quiet = 0
        for _ in range(DRAIN_ROUNDS):
            late = self._client.recv(None)
            quiet = 0 if late else quiet + 1
            if late:
                self._tap.note("discarded", late)
            if quiet == timeouts:
                return
        raise HardwareError(f"{self.connection.address}: the line never falls silent; who sends?")

    def _discard_waiting(self) -> None:
        """Empty a socket before sending; pymodbus does so for serial ports only."""
        link = self._client.socket
        if not isinstance(link, socket.socket):
            return
        link.setblocking(False)
        with suppress(BlockingIOError):
            while stale := link.recv(4096):
                self._tap.note("discarded", stale)

    def _diagnose(self, rtu_length: int) -> str:
        """Say what was wrong with the bytes heard; pymodbus has one message for all."""
        mbap = self.connection.kind == "tcp"
        unit, asked = self._heard[6 if mbap else 0 :][:1], self.connection.unit
        length = rtu_length + 4 if mbap else rtu_length  # MBAP: 6 more in front, no CRC
        if not self._heard:
            return (
                f"no answer within {self.connection.timeout_s} s; is it on, its interface enabled, "
                f"unit id {asked} and {self.connection.baud} baud right?"
            )
        if unit and unit[0] != asked:
            return f"unit {unit[0]} answered, unit {asked} was asked"
        if len(self._heard) < length:
            return f"answer cut short, {len(self._heard)} of {length} bytes: {self._heard.hex(' ')}"
        return f"answer damaged, its checksum or header does not fit: {self._heard.hex(' ')}"

    def _fault(self, what: str, text: str) -> HardwareError:
        return HardwareError(f"{self.connection.address}, {what}: {text}")

    def _trace(self, sending: bool, data: bytes) -> bytes:
        if sending:
            self._tap.note("sent", data)
        else:  # pymodbus shows its whole buffer again at each new piece
            self._heard = data if data.startswith(self._heard) else self._heard + data
        return data
