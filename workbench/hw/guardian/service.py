"""The guardian process: one thread works with the supply, one listens to the client.

Only the worker touches the supply, so an `off` can never be overtaken by an `on`. The listener
trips it: when the link closes, when the lease expires, when the parent is gone. After a trip no
call is carried out any more; the output goes off at once, without a ramp, and off is tried again
until it is read back.
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
from workbench.hw.clock import SystemClock
from workbench.hw.connect import open_supply
from workbench.hw.guardian.latch import Latch
from workbench.hw.guardian.lease import LEASE_S, Lease
from workbench.hw.guardian.messages import Task, fault_of
from workbench.hw.guardian.records import Recorder
from workbench.hw.supply import Limits, Supply
from workbench.loopback import HERE, Line, Message

__all__ = ["Guardian", "main"]

TICK_S = 0.02  # how late a trip may be noticed
AGAIN_S = 0.2  # between attempts at the port or at switching off
KEEP_TRYING_S = 60.0  # to switch off for a client that is dead
FAREWELL_S = 2.0  # for the client to read what it was told
CONNECT_S = 10.0
IGNORED = ("SIGINT", "SIGHUP", "SIGBREAK")  # of the client's terminal; the client answers them


class _Tripped(Exception):
    """A wait of the supply was cut short by a trip."""


class _Clock(SystemClock):
    """Waits that a trip cuts short, until `calm`."""

    def __init__(self) -> None:
        self._tripped = threading.Event()
        self._calm = False

    def interrupt(self) -> None:
        """Cut waits short from now on."""
        self._tripped.set()

    def calm(self) -> None:
        """Wait as long as asked again: off has to be tried with pauses."""
        self._calm = True

    def sleep(self, seconds: float) -> None:
        """Wait in real time."""
        if self._calm:
            time.sleep(max(seconds, 0.0))
        elif self._tripped.wait(max(seconds, 0.0)):
            raise _Tripped


class Guardian:
    """One guardian, from its client's first call to the output's end.

    Args:
        task: what it was started for.
        line: the link to its client.
    """

    def __init__(self, task: Task, line: Line) -> None:
        self._task, self._line = task, line
        self._clock = _Clock()
        self._recorder = Recorder(task.records, self._clock)
        self._lease = Lease(self._clock)
        self._asked: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._client: Literal["here", "goodbye", "gone"] = "here"
        self._parent = os.getppid()
        self._trip: str | None = None
        self._supply: Supply | None = None
        self._owned = False  # somebody asked for more than to look
        self._live = False  # the output may be on

    def serve(self) -> int:
        """Serve until the client leaves or a trip; return the process' exit code."""
        self._recorder.event(
            "guarding", pid=os.getpid(), client=self._parent, after=self._task.after
        )
        threading.Thread(target=self._listen, name="listener", daemon=True).start()
        while self._trip is None and self._client == "here":
            with suppress(queue.Empty):
                self._work(self._asked.get(timeout=TICK_S))
        return self._end()

    def trip(self, reason: str) -> None:
        """Switch off as soon as the exchange that is under way has ended; safe in any thread."""
        if self._trip is None:
            self._trip = reason
        self._clock.interrupt()
        self._asked.put({})

    def _listen(self) -> None:
        try:
            while self._client == "here":
                self._listen_once()
        except Exception as error:  # deaf, it could not see a lease expire
            self._recorder.event("error", text=traceback.format_exc())
            self.trip(f"an error of its own: {error!r}")

    def _listen_once(self) -> None:
        try:
            if message := self._line.receive(TICK_S):
                self._hear(message)
        except OSError:
            self._client = "gone"
            self.trip("its client is dead: the link to it closed")
        if os.getppid() != self._parent:  # a child of the client may hold the link open
            self._client = "gone"
            self.trip("its client is dead: another parent took its place")
        if self._lease.expired:
            self.trip(f"its client hangs: no progress for {LEASE_S:g} s with the output on")

    def _hear(self, message: Message) -> None:
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
        except _Tripped:
            return
        except WorkbenchError as error:
            answer = fault_of(error)
        except Exception as error:
            self._recorder.event("error", text=traceback.format_exc())
            self.trip(f"an error of its own: {error!r}")
            return
        with suppress(OSError):  # the listener hears of it too
            self._line.send({"id": message["id"]} | answer)

    def open(self) -> str:
        """Open the supply and return its name; its output stays as it is."""
        deadline = self._clock.now() + self._task.patience_s
        while True:
            try:
                self._supply = open_supply(
                    self._task.connection,
                    clock=self._clock,
                    wire_log=self._recorder.wire,
                    family=self._task.family,
                )
                return self._supply.name
            except HardwareError:
                if self._clock.now() >= deadline:
                    raise
                self._clock.sleep(AGAIN_S)

    @property
    def supply(self) -> Supply:
        """The open supply."""
        if self._supply is None:
            raise SafetyStop("the guardian was asked for something before it opened the supply")
        return self._supply

    @property
    def own(self) -> Supply:
        """The open supply, which is not left from here on without its output off."""
        self._owned = True
        return self.supply

    def arm(self, *limits: str) -> None:
        """Write the limits, and hold to them from here on."""
        self.own.arm(Limits(*map(Decimal, limits)))
        self._recorder.event("armed", limits=vars(self.supply.limits))

    def set_output(self, on: bool) -> bool:
        """Switch the output; the lease runs before it goes on."""
        if on:
            _ = self.own.limits
            self._recorder.event("output_on")
            if self._recorder.fault is not None:
                raise SafetyStop(
                    f"{self.supply.name}: not switched on, as its guardian cannot write "
                    f"{self._task.records.events} ({self._recorder.fault.strerror})"
                )
            self._live = True
            self._lease.begin()
        self.own.set_output(on)
        if not on:
            self._rest()
        return on

    def off(self) -> bool:
        """Switch off and tell whether it was read back."""
        confirmed = self.own.off()
        self._recorder.event("off", confirmed=confirmed)
        if confirmed:
            self._rest()
        return confirmed

    def _rest(self) -> None:
        self._live = False
        self._lease.rest()

    def _end(self) -> int:
        """Leave the output off, and say and write down whether it is."""
        if self._supply is None or not self._owned:
            return self._leave(0)
        live, self._live = self._live, True
        if self._trip is None and not live:
            return self._leave(0)
        reason = self._trip or "its client left with the output on"
        self._clock.calm()
        began = self._clock.now()
        confirmed = self._switch_off(reason, live)
        told = (
            "the output is off, confirmed"
            if confirmed
            else "OUTPUT MAY BE ON, switch it off by hand"
        )
        if live:
            self._recorder.shout(f"{self._supply.name}: {reason}; {told}")
            self._set_latch(f"{self._supply.name}: {reason}; {told}")
        if confirmed:
            confirmed = self._see_terminals(began)
        self._await_farewell()
        return self._leave(0 if confirmed else SafetyStop.exit_code)

    def _switch_off(self, reason: str, live: bool) -> bool:
        """Try until off is read back, the client leaves, or there is no more hope."""
        began = self._clock.now()
        told = False
        while True:
            confirmed = self.supply.off()
            seconds = self._clock.now() - began
            if confirmed or not told:
                self._recorder.event("trip", reason=reason, output_was_on=live)
                self._recorder.event("off", confirmed=confirmed, seconds=round(seconds, 4))
                self._tell(reason, confirmed)
            if confirmed or self._client == "goodbye" or seconds > KEEP_TRYING_S:
                return confirmed
            if not told:
                self._recorder.shout(
                    f"\a{self.supply.name}: OUTPUT MAY BE ON, trying on ({reason})"
                )
                told = True
            self._clock.sleep(AGAIN_S)

    def _tell(self, reason: str, confirmed: bool) -> None:
        if self._client == "here":
            with suppress(OSError):
                self._line.send({"tripped": reason, "confirmed": confirmed})

    def _see_terminals(self, began: float) -> bool:
        """A flag alone may lie: look at the measured voltage too."""
        dead = self.supply.terminals_dead()
        seconds = round(self._clock.now() - began, 4)
        self._recorder.event("terminals", dead=dead, seconds=seconds)
        if not dead:
            text = f"{self.supply.name}: OUTPUT MAY BE ON, it says off but its terminals are live"
            self._recorder.shout(f"\a{text}")
            self._set_latch(text)
        return dead

    def _set_latch(self, text: str) -> None:
        path = self._task.records.latch
        if path is not None:
            try:
                Latch(path).trip(text, "guardian")
            except OSError as error:
                self._recorder.shout(f"{path} cannot be written: {error}")

    def _await_farewell(self) -> None:
        """Let a client that lives read what it was told before the link closes."""
        deadline = self._clock.now() + FAREWELL_S
        while self._client == "here" and self._clock.now() < deadline:
            self._clock.sleep(TICK_S)

    def _leave(self, code: int) -> int:
        if self._supply is not None:
            self._supply.close()
        self._recorder.event("left", code=code)
        return code


CALLS: dict[str, Callable[..., Any]] = {
    "open": Guardian.open,
    "identify": lambda guardian: list(guardian.supply.identify()),
    "measure": lambda guardian: asdict(guardian.supply.measure()),
    "measure_power_on_output": lambda guardian: guardian.supply.measure_power_on_output(),
    "arm": Guardian.arm,
    "set_voltage": lambda guardian, volts: str(guardian.own.set_voltage(Decimal(volts))),
    "set_current_limit": lambda guardian, amps: str(guardian.own.set_current_limit(Decimal(amps))),
    "set_protection": lambda guardian, volts, amps: [
        str(level) for level in guardian.own.set_protection(Decimal(volts), Decimal(amps))
    ],
    "set_output": Guardian.set_output,
    "ramp_down": lambda guardian: guardian.own.ramp_down(),
    "off": Guardian.off,
    "terminals_dead": lambda guardian: guardian.supply.terminals_dead(),
}


def main() -> int:
    """Serve the client that started this process; it tells where it listens on stdin."""
    words = sys.stdin.readline().split(" ", 2)
    if len(words) != 3:
        sys.stderr.write("a guardian is started by the workbench, not by hand\n")
        return 2
    port, token, task = words
    link = socket.create_connection((HERE, int(port)), CONNECT_S)
    link.settimeout(None)
    line = Line(link)
    line.send({"token": token})
    guardian = Guardian(Task.from_json(task), line)
    for name in IGNORED:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)

    def end(number: int, frame: FrameType | None) -> None:
        guardian.trip(f"it was told to end ({signal.Signals(number).name})")

    signal.signal(signal.SIGTERM, end)
    return guardian.serve()
