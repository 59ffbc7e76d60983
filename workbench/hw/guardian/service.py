"""The guardian process: one thread works with the supply, one listens to the client.

Only the worker touches the supply, so an `off` can never be overtaken by an `on`. The listener
trips it: when the link closes, when the lease expires, when the parent is gone, when somebody asks
for off. An error of the supply while its output may be on trips as well. After a trip no call is
carried out any more; it is said first, and then off is sent, without a ramp, until it is read back
and the terminals are dead, for a minute and a half, whether or not the client lives.
"""

from __future__ import annotations

import os
import queue
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from decimal import Decimal
from types import FrameType
from typing import Any, Literal

from workbench.errors import HardwareError, SafetyStop, WorkbenchError
from workbench.hw.guardian.held import Held
from workbench.hw.guardian.lease import LEASE_S, Lease
from workbench.hw.guardian.messages import SupplyBusyError, Task, fault_of
from workbench.hw.guardian.records import EventRecorder
from workbench.hw.guardian.waiting import TripClock, TrippedError
from workbench.hw.supply import Limits
from workbench.loopback import HERE, Message, MessageLine
from workbench.output import BY_HAND, MAY_BE_ON

__all__ = ["Guardian", "main"]

TICK_S = 0.02  # how late a trip may be noticed
AGAIN_S = 0.2  # between attempts at switching off
OFF_TRIES, SOON_S = 2, 0.05  # asked by the client; then the guardian takes over
OVERDUE_S = 0.55  # without a good answer while the output may be on: it is said
UNSURE_S = 0.3  # after a trip without off read back: it is said
AFTER_TIMEOUT_S = 0.05  # of a supply that its bench calls slower
LISTENED_S = 5.0  # after its client, whoever reads what both say through a pipe goes on
FAREWELL_S = 2.0  # for the client to read what it was sent
CONNECT_S = 10.0
IGNORED = ("SIGINT", "SIGHUP", "SIGBREAK")  # of the client's terminal; the client answers them


class Guardian:
    """One guardian, from its client's first call to the output's end.

    Args:
        task: what it was started for.
        line: the link to its client.
    """

    def __init__(self, task: Task, line: MessageLine) -> None:
        self._task, self._line = task, line
        self._clock = TripClock()
        self._recorder = EventRecorder(task.records, self._clock)
        self._lease = Lease(self._clock)
        self._asked: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._client: Literal["here", "goodbye", "gone"] = "here"
        self._parent = os.getppid()
        self._trip: str | None = None
        self._held = Held(task, self._recorder, self._clock)
        self._overdue_s = max(OVERDUE_S, task.connection.timeout_s + AFTER_TIMEOUT_S)
        self._tripped_at = 0.0
        self._saying = threading.Lock()
        self._lost_at: float | None = None  # since when it is said that it may be on

    def serve(self) -> int:
        """Serve until the client leaves or a trip; return the process' exit code."""
        self._recorder.event(
            "guarding", pid=os.getpid(), client=self._parent, after=self._task.after
        )
        if self._task.after:  # the first cause, whatever the listener receives
            self.trip(self._task.after)
        threading.Thread(target=self._listen, name="listener", daemon=True).start()
        if self._task.after:
            self._held.take_over()
        while self._trip is None and self._client == "here":
            with suppress(queue.Empty):
                self._work(self._asked.get(timeout=TICK_S))
        return self._end()

    def trip(self, reason: str) -> None:
        """Switch off as soon as the exchange that is under way has ended; safe in any thread."""
        if self._trip is None:
            self._trip, self._tripped_at = reason, time.monotonic()
            self._held.health.hurry = True
        self._clock.interrupt()
        self._asked.put({})

    def _fail(self, reason: str) -> None:
        """Trip by the supply's own fault: it may be on, which is said before anything is tried."""
        self._say_lost(reason)
        self.trip(reason)

    def _say_lost(self, cause: str) -> None:
        """Say once, and write down, that the output may be on; safe in any thread."""
        with self._saying:
            if self._lost_at is not None:
                return
            self._lost_at = time.monotonic()
        self._recorder.event("lost", cause=cause)
        self._recorder.shout(f"\a{self._held.name}: {MAY_BE_ON} ({cause}); {BY_HAND}")

    def _listen(self) -> None:
        try:
            while True:
                if self._client == "here":
                    self._listen_once()
                else:
                    time.sleep(TICK_S)
                self._watch_health()
        except Exception as error:  # deaf, it could not see a lease expire
            self._recorder.event("error", text=traceback.format_exc())
            self.trip(f"an error of its own: {error!r}")

    def _listen_once(self) -> None:
        try:
            if message := self._line.receive(TICK_S):
                self._handle(message)
        except OSError:
            self._client = "gone"
            self.trip("its client is dead: the link to it closed")
        if os.getppid() != self._parent:  # a child of the client may hold the link open
            self._client = "gone"
            self.trip("its client is dead: another parent took its place")
        if self._lease.expired:
            self.trip(f"its client hangs: no progress for {LEASE_S:g} s with the output on")
        ledger = self._recorder.ledger
        if self._held.owned and ledger is not None and ledger.asked_for_off():
            self.trip("somebody asked for it with `workbench supply off`")

    def _watch_health(self) -> None:
        """Say at once that the supply does not answer; the worker may wait for it a while yet."""
        lost_at = self._lost_at
        if self._trip is None and lost_at is not None and self._held.health.answered_since(lost_at):
            self._lost_at = None
            self._recorder.event("regained")
            self._recorder.shout(f"{self._held.name}: it answers again")
        output = self._recorder.output
        if not output.live or self._lost_at is not None:
            return
        if cause := self._held.health.overdue(self._overdue_s):
            self._say_lost(cause)
        unsure = self._trip is not None and time.monotonic() - self._tripped_at > UNSURE_S
        if unsure and not output.read_back:
            self._say_lost(f"{self._trip}; off is not yet confirmed")

    def _handle(self, message: Message) -> None:
        self._lease.renew()
        if "renew" in message:
            self._line.send({"alive": 1})
        elif "goodbye" in message:
            self._client = "goodbye"
            self._asked.put({})
        else:
            self._asked.put(message)

    def _work(self, message: Message) -> None:
        if self._trip is not None or "call" not in message:
            return
        try:
            answer: Message = {"value": CALLS[message["call"]](self, *message["arguments"])}
        except TrippedError:
            return
        except HardwareError as error:
            if self._recorder.output.live and not isinstance(error, SupplyBusyError):
                self._fail(str(error))
                return
            answer = fault_of(error)
        except WorkbenchError as error:
            answer = fault_of(error)
        except Exception as error:
            self._recorder.event("error", text=traceback.format_exc())
            self.trip(f"an error of its own: {error!r}")
            return
        with suppress(OSError):  # the listener notices it too
            self._line.send({"id": message["id"]} | answer)

    @property
    def held(self) -> Held:
        """The supply that it guards."""
        return self._held

    def arm(self, *limits: str) -> None:
        """Write the limits, and hold to them from here on.

        Raises:
            SafetyStop: when the supply is latched.
        """
        supply, ledger = self._held.owned_supply, self._recorder.ledger
        if ledger is not None and (latch := ledger.latch()):
            raise SafetyStop(f"{supply.name} is {latch.description}")
        supply.arm(Limits(*map(Decimal, limits)))
        self._recorder.event("armed", limits=vars(supply.limits))

    def set_output(self, on: bool) -> bool:
        """Switch the output; the lease runs before it goes on."""
        if on:
            _ = self._held.owned_supply.limits
            self._recorder.event("output_on")
            if self._recorder.fault is not None:
                fault = self._recorder.fault
                raise SafetyStop(
                    f"{self._held.name}: not switched on, as its guardian cannot write "
                    f"{fault.filename} ({fault.strerror})"
                )
            self._lease.begin()
        self._held.owned_supply.set_output(on)
        if not on:
            self._lease.rest()
        return on

    def off(self) -> bool:
        """Switch off and return whether it was read back; when not, go on by itself."""
        supply = self._held.owned_supply
        error: Exception | None = None
        for attempt in range(OFF_TRIES):
            try:
                self._clock.sleep(SOON_S * attempt)
                supply.try_off()
            except WorkbenchError as fault:
                error = error or fault
                if self._held.health.cause:  # no answer, or a wrong one: it is said at once
                    break
                continue
            self._recorder.event("off", confirmed=True)
            self._lease.rest()
            return True
        self._recorder.event("off", confirmed=False, error=str(error))
        self._fail(f"it did not confirm off: {error}")
        return False

    def terminals_dead(self) -> bool:
        """Wait for the terminals to decay after off; when they do not, go on by itself."""
        if not self._held.owned:
            return self._held.supply.terminals_dead()
        dead = self._see_dead()
        if not dead:
            self._fail(self._held.supply.not_dead)
        return dead

    def latch(self, reason: str) -> None:
        """Keep the supply from being driven again until a person has signed."""
        ledger = self._recorder.ledger
        if ledger is None or ledger.latch() is None:  # else it refused just now
            self._recorder.event("trip", reason=reason)

    def _end(self) -> int:
        """Leave the output off, and say and write down whether it is."""
        if not self._held.owned:
            return self._leave(0)
        self._clock.calm()
        self._held.health.hurry = False
        output = self._recorder.output
        if self._trip is None and (not output.live or (output.read_back and self._see_dead())):
            return self._leave(0)
        reason = self._trip or "its client left with the output on"
        live = output.live
        self._recorder.event("trip" if live else "ending", reason=reason)
        self._send({"tripped": reason})
        dead = self._keep_switching_off(reason, live)
        self._send({"off": dead, "dead": dead})
        if not dead:
            self._recorder.shout(
                f"\a{self._held.name}: {MAY_BE_ON} ({reason}); {BY_HAND}. After "
                f"{self._task.keep_trying_s:g} s it is not tried any more"
            )
        self._await_farewell()
        return self._leave(0 if dead else SafetyStop.exit_code)

    def _keep_switching_off(self, reason: str, live: bool) -> bool:
        """Try until off is read back and seen, or there is no more hope; say when it is not."""
        began = self._clock.now()
        reported: set[str] = set()
        while True:
            error = self._held.try_off()
            seconds = self._clock.now() - began
            if not error:
                self._recorder.event("off", confirmed=True, seconds=round(seconds, 4))
                self._send({"off": True})
                if self._see_dead():
                    if live or reported:
                        self._recorder.shout(
                            f"{self._held.name}: {reason}; the output is off, confirmed"
                        )
                    return True
                error = self._held.supply.not_dead
            if seconds > self._task.keep_trying_s:
                return False
            if error not in reported:  # the first fault, and each that is another one
                self._recorder.event("off", confirmed=False, error=error)
            if not reported:
                self._say_lost(f"{reason}; {error}")
                trying = f"trying on for {self._task.keep_trying_s:g} s"
                self._recorder.shout(f"{self._held.name}: not confirmed off ({error}); {trying}")
            reported.add(error)
            if self._client != "here" and seconds > LISTENED_S:
                self._recorder.let_go()
            self._clock.sleep(AGAIN_S)

    def _send(self, message: Message) -> None:
        if self._client == "here":
            with suppress(OSError):
                self._line.send(message)

    def _see_dead(self) -> bool:
        """A flag alone may lie: look at the measured voltage too."""
        dead = self._held.supply.terminals_dead()
        why = {} if dead else {"error": self._held.supply.not_dead}
        self._recorder.event("terminals", dead=dead, **why)
        return dead

    def _await_farewell(self) -> None:
        """Let a client that lives read what it was sent before the link closes."""
        deadline = self._clock.now() + FAREWELL_S
        while self._client == "here" and self._clock.now() < deadline:
            self._clock.sleep(TICK_S)

    def _leave(self, code: int) -> int:
        self._held.close()
        self._recorder.event("left", code=code)
        self._recorder.close_terminal()
        return code


CALLS: dict[str, Callable[..., Any]] = {
    "open": lambda guardian: guardian.held.open(),
    "identify": lambda guardian: list(guardian.held.supply.identify()),
    "measure": lambda guardian: asdict(guardian.held.supply.measure()),
    "measure_power_on_output": lambda guardian: guardian.held.supply.measure_power_on_output(),
    "arm": Guardian.arm,
    "set_voltage": lambda guardian, volts: str(
        guardian.held.owned_supply.set_voltage(Decimal(volts))
    ),
    "set_current_limit": lambda guardian, amps: str(
        guardian.held.owned_supply.set_current_limit(Decimal(amps))
    ),
    "set_protection": lambda guardian, volts, amps: [
        str(level)
        for level in guardian.held.owned_supply.set_protection(Decimal(volts), Decimal(amps))
    ],
    "set_output": Guardian.set_output,
    "ramp_down": lambda guardian: guardian.held.owned_supply.ramp_down(),
    "off": Guardian.off,
    "terminals_dead": Guardian.terminals_dead,
    "latch": Guardian.latch,
}


def _to_nobody() -> MessageLine:
    """Return a link whose other end is closed: the client died, its output is still to go off."""
    with socket.create_server((HERE, 0)) as listener:
        link = socket.create_connection(listener.getsockname(), CONNECT_S)
        listener.accept()[0].close()
    return MessageLine(link)


def main() -> int:
    """Serve the client that started this process; it says where it listens on stdin."""
    words = sys.stdin.readline().split(" ", 2)
    if len(words) != 3:
        sys.stderr.write("a guardian is started by the workbench, not by hand\n")
        return 2
    port, token, task = words
    to_do = Task.from_json(task)
    try:
        line = MessageLine(socket.create_connection((HERE, int(port)), CONNECT_S))
        line.send({"token": token})
    except OSError:
        if not to_do.after:  # its client is dead, and there is nothing to do without it
            return 1
        line = _to_nobody()
    guardian = Guardian(to_do, line)
    for name in IGNORED:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)

    def end(number: int, frame: FrameType | None) -> None:
        guardian.trip(f"it was asked to end ({signal.Signals(number).name})")

    signal.signal(signal.SIGTERM, end)
    return guardian.serve()
