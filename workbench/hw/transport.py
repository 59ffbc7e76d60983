"""One Modbus link: pymodbus frames the bytes, this file guards what it leaves open.

RTU replies carry no number, so a late one looks like the answer to the next request. Hence: an
exchange that did not end well leaves the line suspect, and a suspect line is drained until it was
quiet, and then used only once a block of a length of its own was answered: a supply answers in
order, so whatever came before that was late, however late; counts, function codes and echoes are
checked; successive reads of a block ask for different lengths, so that an answer that comes twice
does not fit; and a lost connection is never reopened in passing, because another device may be
there now.

The bytes go over our own channel: pymodbus' clients wait by the clock on the wall, which may be set
while they do.
"""

from __future__ import annotations

import itertools
import logging
import threading
import time
from collections.abc import Callable, Sequence

from pymodbus.exceptions import ModbusException
from pymodbus.framer import FramerRTU, FramerSocket
from pymodbus.pdu import DecodePDU, ModbusPDU
from pymodbus.pdu.register_message import ReadHoldingRegistersRequest, WriteSingleRegisterRequest

from workbench.errors import HardwareError, SafetyStop
from workbench.hw.channel import ECHOED, ENDLESS_SENDER, ByteChannel, drop_waiting, open_channel
from workbench.hw.clock import Clock
from workbench.hw.connection import Connection
from workbench.hw.health import Health, NoAnswer
from workbench.hw.wirelog import WireLog, Wiretap

__all__ = ["Transport"]

# pymodbus reports every fault to logging as well; without a handler Python would print it
logging.getLogger("pymodbus").addHandler(logging.NullHandler())

MOST_REGISTERS = 20  # longer reads fail silently (instruments survey 1.2)
MOST_BYTES = 512  # more in one exchange is no answer
DRAIN_BYTES, DRAIN_S = 4096, 1.0  # who sends more, or longer, never becomes idle
MBAP_MORE = 4  # bytes of Modbus TCP: 6 more in front, no CRC
NOISE_BYTES = 32  # more around an answer is no line that one can trust
MARK_ROUNDS = 2
EXCERPT = 12  # bytes of a damaged answer that a message has; the wire log has all
READ, WRITE = 3, 6  # function codes
RTU_GAP_S, RTU_GAP_CHARACTERS, CHARACTER_BITS = 0.00175, 3.5, 10  # between frames, by the norm
TRANSACTIONS = 0xFFFF

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
        marks: start and length of blocks that no other read has the length of; without them a
            suspect line is drained until it was quiet for two timeouts. With two, the late answer
            to one cannot pass for what is under way being over.
        health: receives how each exchange goes.
        opened: opens the channel.
        now: monotonic time [s] that ends each wait.

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
        marks: Sequence[tuple[int, int]] = (),
        health: Health | None = None,
        opened: Callable[[Connection], ByteChannel] = open_channel,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.connection = connection
        self._writable = writable
        self._tap = Wiretap(wire_log, clock)
        self._lock = threading.RLock()
        self._mbap = connection.kind == "tcp"
        self._framer = (FramerSocket if self._mbap else FramerRTU)(DecodePDU(False))
        self._numbers = itertools.cycle(range(1, TRANSACTIONS + 1))
        self._marks = marks
        self._health = health or Health()
        self._suspect = False  # an answer may still be under way
        self._turn = 0  # how many reads with spare registers went out
        self._opened, self._now = opened, now
        self._channel: ByteChannel | None = None
        self._gap_s = connection.gap_s if connection.gap_s is not None else _gap(connection)
        self._free_at = now()
        self._sent = b""
        self.open()

    @property
    def connected(self) -> bool:
        """Whether the link is open, as far as is known."""
        return self._channel is not None

    def open(self, connection: Connection | None = None) -> None:
        """Open the link, again after a loss; the caller then checks who is there.

        Args:
            connection: where the unit is now; where it was when left out.

        Raises:
            HardwareError: when nothing can be opened there.
        """
        self.close()
        self._channel = self._opened(connection or self.connection)
        self.connection, self._suspect = connection or self.connection, False

    def close(self) -> None:
        """Close the link; closing twice does no harm."""
        if self._channel is not None:
            self._channel.close()
            self._channel = None

    def read(self, address: int, count: int, *, spare: int = 0, again: bool = True) -> list[int]:
        """Read holding registers.

        Args:
            address: the first.
            count: how many, 20 at most with the spare ones.
            spare: how many more there are behind them that may be read along, for a length that
                differs from read to read.
            again: ask once more when the answer is missing or damaged.

        Raises:
            HardwareError: when there is no good answer; it names the device's reason, the first
                one where it was asked twice.
        """
        if not 1 <= count <= count + spare <= MOST_REGISTERS:
            raise ValueError(f"{count + spare} registers asked for; 1 to {MOST_REGISTERS} can be")
        try:
            return self._read_once(address, count, spare)
        except HardwareError as first:
            if not (again and self._suspect) or self._health.hurry:
                raise  # the device gave its reason, or the link is gone
            try:
                return self._read_once(address, count, spare)
            except HardwareError as second:
                if not self.connected or not self._suspect:
                    raise  # it hung up, or gave its reason
                raise first from second

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
        request = WriteSingleRegisterRequest(
            address=address, registers=[word], dev_id=self.connection.unit
        )
        with self._lock:
            doubtful = urgent and self._suspect
            echo = self._exchange(request, what, rtu_length=8, urgent=urgent)
            if (echo.address, echo.registers) != (address, [word]):
                raise self._fault(what, f"echoed {echo.registers} to register {echo.address}")
            if not doubtful:
                self._settled()

    def _read_once(self, address: int, least: int, spare: int) -> list[int]:
        with self._lock:
            count = least + self._turn % (spare + 1)
            what = f"read of {count} registers from {address}"
            self._clear_suspect(what)
            self._turn += spare > 0  # each length comes round as late as it can
            answer = self._exchange(self._reading(address, count), what, rtu_length=5 + 2 * count)
            if len(answer.registers) != count:
                raise self._fault(what, f"answered with {len(answer.registers)} registers")
            self._settled()
            return list(answer.registers[:least])

    def _reading(self, address: int, count: int) -> ModbusPDU:
        return ReadHoldingRegistersRequest(
            address=address, count=count, dev_id=self.connection.unit
        )

    def _settled(self) -> None:
        self._suspect = False
        self._health.good()

    def _exchange(
        self, request: ModbusPDU, what: str, *, rtu_length: int, urgent: bool = False
    ) -> ModbusPDU:
        """Send and receive once; the line stays suspect until the caller has checked the rest."""
        self._health.begin()
        if not urgent:
            self._clear_suspect(what)
        answer, received = self._send_and_receive(request, what, urgent=urgent)
        if answer is not None and len(received) > rtu_length + MBAP_MORE + NOISE_BYTES:
            raise self._fault(
                what, f"{len(received)} bytes came around its answer; {ENDLESS_SENDER}"
            )
        if answer is None:
            kind = HardwareError if received else NoAnswer
            raise self._fault(what, self._diagnose(received, rtu_length), kind)
        if answer.function_code & 0x7F != request.function_code:  # the top bit marks an exception
            message = f"answered function {answer.function_code}, not {request.function_code}"
            raise self._fault(what, message)
        if answer.isError():
            self._settled()
            code = answer.exception_code
            raise self._fault(what, f"exception {code}, {EXCEPTIONS.get(code, 'not in the norm')}")
        return answer

    def _send_and_receive(
        self, request: ModbusPDU, what: str, *, urgent: bool = False
    ) -> tuple[ModbusPDU | None, bytes]:
        """Send a request; return its answer, or nothing, and all that was received."""
        request.transaction_id = next(self._numbers)
        data = self._framer.buildFrame(request)
        channel = self._channel
        if channel is None:
            raise self._fault(what, "the connection is lost; reopen it and check who is there")
        try:
            self._discard_waiting(channel, what, urgent=urgent)
            time.sleep(max(self._gap_s - (self._now() - self._free_at), 0.0))
            self._suspect, self._sent = True, data
            self._tap.note("sent", data)
            channel.send(data)
            return self._receive(channel, request)
        except OSError as error:
            self.close()
            self._suspect = False  # no answer can come any more
            raise self._fault(what, f"the connection was lost ({error})") from error

    def _receive(self, channel: ByteChannel, request: ModbusPDU) -> tuple[ModbusPDU | None, bytes]:
        received, answer = b"", None
        end = self._now() + self.connection.timeout_s
        try:
            while answer is None and len(received) < MOST_BYTES:
                piece = channel.receive(max(end - self._now(), 0.0))
                received += piece
                answer = self._decoded(received, request)
                if not piece or self._now() >= end:
                    break
        finally:
            self._tap.note("received", received)
            self._free_at = self._now()
        return answer, received

    def _decoded(self, received: bytes, request: ModbusPDU) -> ModbusPDU | None:
        try:
            _, answer = self._framer.handleFrame(received, request.dev_id, request.transaction_id)
        except (ModbusException, IndexError, ValueError):  # a frame of something else
            return None
        return answer

    def _clear_suspect(self, what: str) -> None:
        """Wait until no answer to an earlier request can come any more."""
        if not self._suspect:
            return
        self._health.begin()
        self._drain(what, 1 if self._marks else 2)
        for start, count in self._marks:
            self._await_mark(start, count, what)
        self._suspect = False

    def _await_mark(self, start: int, count: int, what: str) -> None:
        """Ask for a block until its own answer came: a supply answers in order."""
        received = b""
        for _ in range(MARK_ROUNDS):
            answer, received = self._send_and_receive(self._reading(start, count), what)
            if answer is not None and answer.function_code == READ:
                if len(answer.registers) == count:
                    return
                received = b""
            if not received:
                break  # who does not answer one question does not answer the next
        message = f"not sent, as before it {self._diagnose(received, 5 + 2 * count)}"
        raise self._fault(what, message, HardwareError if received else NoAnswer)

    def _drain(self, what: str, timeouts: int) -> None:
        """Wait until nothing came for so many timeouts; an endless sender is an error."""
        if self._channel is None:
            return
        quiet, dropped = 0, 0
        end = self._now() + DRAIN_S + timeouts * self.connection.timeout_s
        while quiet < timeouts:
            try:
                late = self._channel.receive(self.connection.timeout_s)
            except OSError as error:
                self.close()
                raise self._fault(what, f"the connection was lost ({error})") from error
            quiet = 0 if late else quiet + 1
            dropped += len(late)
            if late:
                self._tap.note("discarded", late)
            if self._health.hurry:
                raise self._fault(what, "not sent, as the supply is to be switched off")
            if dropped > DRAIN_BYTES or self._now() > end:
                raise self._fault(what, ENDLESS_SENDER)

    def _discard_waiting(self, channel: ByteChannel, what: str, *, urgent: bool) -> None:
        """Drop what came since the last exchange; "off" goes out even where that never ends."""
        stale = drop_waiting(channel)
        if stale:
            self._tap.note("discarded", stale)
        if len(stale) > MOST_BYTES:
            self._suspect = True
            fault = self._fault(what, ENDLESS_SENDER)
            if not urgent:
                raise fault

    def _diagnose(self, received: bytes, rtu_length: int) -> str:
        """Say what was wrong with the bytes received."""
        unit, asked = received[6 if self._mbap else 0 :][:1], self.connection.unit
        length = rtu_length + MBAP_MORE if self._mbap else rtu_length
        if not received:
            return (
                f"no answer within {self.connection.timeout_s} s; is it on, its interface enabled, "
                f"unit id {asked} and {self.connection.baud} baud right?"
            )
        if received.startswith(self._sent):
            return ECHOED
        if len(received) >= MOST_BYTES:
            return ENDLESS_SENDER
        if unit and unit[0] != asked:
            return f"unit {unit[0]} answered, unit {asked} was asked"
        excerpt = f"{received[:EXCERPT].hex(' ')}{' ...' if len(received) > EXCERPT else ''}"
        if len(received) < length:
            return f"answer cut short, {len(received)} of {length} bytes: {excerpt}"
        return f"answer damaged, its checksum or header does not fit: {excerpt}"

    def _fault(
        self, what: str, text: str, kind: type[HardwareError] = HardwareError
    ) -> HardwareError:
        message = f"{self.connection.address}, {what}: {text}"
        if self._suspect or not self.connected:
            self._health.fault(message)
        return kind(message)


def _gap(connection: Connection) -> float:
    """Return the idle time between two frames [s], 3.5 characters and 1.75 ms at least."""
    if connection.kind != "serial":
        return 0.0
    return max(RTU_GAP_CHARACTERS * CHARACTER_BITS / connection.baud, RTU_GAP_S)
