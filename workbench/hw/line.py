"""One text link: questions and answers without numbers, guarded as the Modbus link is.

An answer does not say which question it belongs to. Hence: every question names the form of its
answer and nothing else is taken; bytes that nobody asked for are dropped before asking; and after
an exchange that did not end well the line is suspect until the supply has answered `*IDN?` as it
did at first. It answers in order, so whatever came before that answer was late, however late.
"""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from workbench.errors import HardwareError, SafetyStop
from workbench.hw.channel import ECHOED, ENDLESS_SENDER, ByteChannel, drop_waiting, open_channel
from workbench.hw.clock import Clock
from workbench.hw.connection import Connection
from workbench.hw.health import Health, NoAnswer
from workbench.hw.wirelog import Way, WireLog, Wiretap

__all__ = ["WHO", "Line"]

WHO = "*IDN?"
QUIET_S = 0.1  # an answer of unknown length is over when nothing came for so long
WHO_QUIET_S = 0.2  # one of known length, which may come in pieces
MOST_BYTES = 256  # longer answers there are none
ROUNDS = 2
PADDING = b"\x00\x01\xbc\r\n "  # what may follow an identity


class Line:
    """A link to one supply that speaks text; every byte goes to the wire log.

    Args:
        connection: where it is.
        terminator: ends every command and every answer; empty where there is none.
        may_send: fits whole commands that may be sent; calibration and recalls do not.
        gap_s: least time between the end of one exchange and the next command.
        clock: waits for the gap and stamps the wire log.
        wire_log: takes one JSON line per message. When it raises, nothing but urgent commands
            is sent any more; asking goes on.
        health: receives how each exchange goes.
        opened: opens the channel.

    Raises:
        HardwareError: when nothing can be opened there.
    """

    def __init__(
        self,
        connection: Connection,
        *,
        terminator: bytes,
        may_send: re.Pattern[str],
        gap_s: float,
        clock: Clock,
        wire_log: WireLog,
        health: Health | None = None,
        opened: Callable[[Connection], ByteChannel] = open_channel,
    ) -> None:
        self.connection = connection
        self._terminator, self._may_send = terminator, may_send
        self._gap_s = gap_s if connection.gap_s is None else connection.gap_s
        self._clock = clock
        self._health = health or Health()
        self._tap = Wiretap(wire_log, clock)
        self._lock = threading.RLock()
        self._opened = opened
        self._channel: ByteChannel | None = None
        self._free_at = clock.now()
        self._identity = b""
        self._suspect = False  # an answer may still be under way
        self._strict = False  # bytes that nobody asked for make the answers before doubtful
        self._answered = False  # there were some
        self._stray_due = False  # one byte may follow the last answer all the same
        self.open()

    @property
    def connected(self) -> bool:
        """Whether the link is open, as far as is known."""
        return self._channel is not None

    def open(self, connection: Connection | None = None) -> None:
        """Open the link, again after a loss; the caller then checks who is there.

        Args:
            connection: where it is now; where it was when left out.

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

    def identify(self) -> str:
        """Ask who is there and keep the answer as the mark that a suspect line is cleared by.

        Raises:
            HardwareError: when nothing answers.
        """
        with self._lock:
            what = f"question {WHO}"
            self._send(WHO, what)
            self._suspect = True
            received = self._receive(what, self._ended, quiet_s=QUIET_S)
            if len(received) >= MOST_BYTES:
                raise self._fault(what, ENDLESS_SENDER)
            if not received.strip(PADDING):
                raise self._fault(what, self._no_answer_text(), NoAnswer)
            if WHO.encode() in received:
                raise self._fault(what, ECHOED)
            self._identity, self._suspect = received, False
            self._health.good()
            return received.strip(PADDING).decode("ascii", "replace")

    def set_gap(self, seconds: float) -> None:
        """Keep this gap [s] from now on: the model that is there needs it, or the bench more."""
        configured = self.connection.gap_s
        self._gap_s = seconds if configured is None else configured

    def ask(self, command: str, form: re.Pattern[bytes], *, again: bool = True) -> bytes:
        """Ask a question.

        Args:
            command: the question.
            form: of its answer, without terminator; of fixed length where there is none. With a
                group `stray`, that may be missing or come later, the rest is the answer.
            again: ask once more when the answer is missing or damaged.

        Raises:
            SafetyStop: when it may not be sent.
            HardwareError: when there is no good answer.
        """
        with self._lock:
            try:
                return self._ask_once(command, form)
            except HardwareError as first:
                if not (again and self._suspect) or self._health.hurry:
                    raise  # the link is gone, or time is short
                try:
                    return self._ask_once(command, form)
                except HardwareError as second:
                    if not self.connected:
                        raise
                    raise first from second

    @contextmanager
    def in_order(self) -> Iterator[None]:
        """Refuse the questions of a block together when bytes come in between that none asked for.

        Raises:
            HardwareError: when they do; it is not known then which answer belonged to what.
        """
        with self._lock:
            self._strict, self._answered = True, False
            try:
                yield
            finally:
                self._strict = False

    def ask_who(self) -> None:
        """See that the supply still answers as it did at first, and nothing else is under way.

        Raises:
            HardwareError: when it does not.
        """
        known = self._identity.removesuffix(self._terminator).rstrip(b"\r")
        form = re.compile(re.escape(known), re.DOTALL)
        with self._lock:
            self._ask_once(WHO, form, quiet_s=WHO_QUIET_S)  # another one's name is soon over

    def send_command(self, command: str, *, urgent: bool = False) -> None:
        """Send a command that has no answer.

        Args:
            command: it.
            urgent: send even when the wire log cannot be written, for switching off.

        Raises:
            SafetyStop: when it may not be sent.
            HardwareError: when the link is gone, or the wire log cannot be written.
        """
        what = f"command {command}"
        if self._tap.fault and not urgent:
            raise self._fault(what, f"not sent, as the wire log failed ({self._tap.fault})")
        with self._lock:
            self._send(command, what)

    def _ask_once(
        self, command: str, form: re.Pattern[bytes], quiet_s: float | None = None
    ) -> bytes:
        what = f"question {command}"
        if self._suspect:
            self._clear(what)
        self._send(command, what)
        self._suspect = True
        received = self._receive(
            what, lambda data: self._answer(data, form) is not None, quiet_s=quiet_s
        )
        if not received:
            raise self._fault(what, self._no_answer_text(), NoAnswer)
        answer = self._answer(received, form)
        if answer is None:
            raise self._fault(what, self._no_answer(command, received))
        self._suspect, self._answered = False, True
        self._health.good()
        self._stray_due = "stray" in form.groupindex and answer == received
        return answer

    def _answer(self, received: bytes, form: re.Pattern[bytes]) -> bytes | None:
        """Return the answer in what was received, or nothing when there is none, or two."""
        if self._terminator:
            line, end, rest = received.partition(self._terminator)
            line = line.rstrip(b"\r")
            return line if end and not rest and form.fullmatch(line) else None
        if not (found := form.fullmatch(received)):
            return None
        stray = found.groupdict().get("stray") or b""
        return received.removesuffix(stray)

    def _ended(self, received: bytes) -> bool:
        return bool(self._terminator) and received.endswith(self._terminator)

    def _clear(self, what: str) -> None:
        """Read and drop everything up to the answer to `*IDN?`."""
        ever = b""
        for _ in range(ROUNDS):
            self._send(WHO, what)
            received = self._receive(
                what, lambda data: data.endswith(self._identity), way="discarded"
            )
            ever += received
            if self._identity and received.endswith(self._identity):
                self._suspect = False
                return
            if not received:
                break  # who does not answer one question does not answer the next
        if not ever:
            raise self._fault(what, self._no_answer_text(), NoAnswer)
        if len(ever) >= MOST_BYTES:
            raise self._fault(what, ENDLESS_SENDER)
        raise self._fault(what, f"it does not answer {WHO} as it did at first; is it another one?")

    selection = ""
    """Goes out before every command but `*IDN?`, in one message with it: no hand comes between."""

    def _send(self, command: str, what: str) -> None:
        said = [self.selection, command] if self.selection and command != WHO else [command]
        if not all(self._may_send.fullmatch(one) for one in said):
            raise SafetyStop(
                f"{self.connection.address}: command {command!r} is none of those that may be "
                "sent; calibration, recalls and resets lie among the others; nothing was sent"
            )
        self._clock.sleep(self._gap_s - (self._clock.now() - self._free_at))
        data = b"".join(one.encode("ascii") + self._terminator for one in said)
        self._health.begin()
        with _Losing(self, what) as channel:
            self._drop_waiting(channel, what)
            self._tap.note("sent", data)
            channel.send(data)
        self._free_at = self._clock.now()

    def _drop_waiting(self, channel: ByteChannel, what: str) -> None:
        """Drop what came since the last exchange, as far as it ends; then it is sent all the same.

        A command must get through beside an endless sender: "off" is one.
        """
        waiting = drop_waiting(channel)
        if len(waiting) > MOST_BYTES:
            self._suspect = True
            self._health.fault(f"{self.connection.address}, {what}: {ENDLESS_SENDER}")
        if waiting:
            self._tap.note("discarded", waiting)
        doubtful = waiting[self._stray_due :].strip(PADDING)
        self._stray_due = False
        if doubtful and self._strict and self._answered:
            self._suspect = True
            raise self._fault(what, f"not sent, as {waiting!r} came that nobody asked for")

    def _receive(
        self,
        what: str,
        complete: Callable[[bytes], bool],
        *,
        quiet_s: float | None = None,
        way: Way = "received",
    ) -> bytes:
        """Return what comes until it is complete, or nothing comes any more."""
        received, timeout = b"", self.connection.timeout_s
        end = time.monotonic() + timeout
        with _Losing(self, what) as channel:
            while not complete(received) and len(received) < MOST_BYTES:
                rest_s = end - time.monotonic()
                piece = channel.receive(min(rest_s, quiet_s) if quiet_s and received else rest_s)
                if not piece:
                    break
                received += piece
        self._tap.note(way, received)
        self._free_at = self._clock.now()
        return received

    def _no_answer_text(self) -> str:
        connection = self.connection
        speed = f" and are {connection.baud} baud right" if connection.kind == "serial" else ""
        return f"no answer within {connection.timeout_s} s; is it on, its interface enabled{speed}?"

    def _no_answer(self, command: str, received: bytes) -> str:
        if len(received) >= MOST_BYTES:
            return ENDLESS_SENDER
        if received.startswith(command.encode("ascii")):
            return ECHOED
        return f"answered {received!r}, which is no answer to it"

    def _fault(
        self, what: str, text: str, kind: type[HardwareError] = HardwareError
    ) -> HardwareError:
        message = f"{self.connection.address}, {what}: {text}"
        if self._suspect or not self.connected:
            self._health.fault(message)
        return kind(message)


class _Losing:
    """Gives the channel of a line, and closes the line when the channel is lost meanwhile."""

    def __init__(self, line: Line, what: str) -> None:
        self._line, self._what = line, what

    def __enter__(self) -> ByteChannel:
        channel = self._line._channel
        if channel is None:
            raise self._line._fault(
                self._what, "the connection is lost; reopen it and check who is there"
            )
        return channel

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, OSError):
            self._line.close()
            self._line._suspect = False  # no answer can come any more
            raise self._line._fault(self._what, f"the connection was lost ({error})") from error
