"""The faults of a simulated supply: which one is on, and for how many messages."""

from __future__ import annotations

import math
import threading
from enum import StrEnum

__all__ = ["EVENTS", "FaultSwitch", "RequestError", "SimulatedFault"]


class SimulatedFault(StrEnum):
    """What can go wrong, one at a time.

    On the wire: `silent`, `late-reply`, `bad-crc` (in text: a spoilt character), `short-reply`,
    `junk` before the answer, `repeated-reply` (the last answer once more before the next one),
    `wrong-unit` and `exception` (in text: an error as the answer).

    In the device: `ignored-write` acknowledges writes without carrying them out, `stuck-output`
    does so with the output's switch alone, `false-off` says off and goes on driving,
    `frozen-reading` shows for ever what it measured last, `times-ten` and `a-tenth` drive that
    multiple of the setpoint.

    Once: `panel-off`, `panel-on`, `panel-voltage` and `panel-channel` (which selects the next one,
    where there are several) are a person at its front panel, `ovp-trip` and `ocp-trip` its
    protections, `power-cycle` its mains switch. `unplugged` lasts until mended.
    """

    SILENT = "silent"
    LATE_REPLY = "late-reply"
    BAD_CRC = "bad-crc"
    SHORT_REPLY = "short-reply"
    JUNK = "junk"
    REPEATED_REPLY = "repeated-reply"
    WRONG_UNIT = "wrong-unit"
    EXCEPTION = "exception"
    IGNORED_WRITE = "ignored-write"
    STUCK_OUTPUT = "stuck-output"
    FALSE_OFF = "false-off"
    FROZEN_READING = "frozen-reading"
    TIMES_TEN = "times-ten"
    A_TENTH = "a-tenth"
    UNPLUGGED = "unplugged"
    PANEL_OFF = "panel-off"
    PANEL_ON = "panel-on"
    PANEL_VOLTAGE = "panel-voltage"
    PANEL_CHANNEL = "panel-channel"
    OVP_TRIP = "ovp-trip"
    OCP_TRIP = "ocp-trip"
    POWER_CYCLE = "power-cycle"


EVENTS = frozenset(
    {
        SimulatedFault.PANEL_OFF,
        SimulatedFault.PANEL_ON,
        SimulatedFault.PANEL_VOLTAGE,
        SimulatedFault.PANEL_CHANNEL,
        SimulatedFault.OVP_TRIP,
        SimulatedFault.OCP_TRIP,
        SimulatedFault.POWER_CYCLE,
    }
)
"""Those that happen once, at once."""


class RequestError(Exception):
    """A request that the device answers with a Modbus exception code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"Modbus exception {code}")
        self.code = code


class FaultSwitch:
    """Holds the fault that is on; safe to use from the test's thread and the server's."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._fault: SimulatedFault | None = None
        self._remaining = 0.0
        self.code = 4
        self.delay_s = 0.0

    def on(self, fault: SimulatedFault, times: float, code: int, delay_s: float) -> None:
        """Switch a fault on, see `SimulatedSupply.fail`."""
        with self._lock:
            self._fault, self._remaining = fault, times
            self.code, self.delay_s = code, delay_s

    def off(self) -> None:
        """Switch the fault off."""
        with self._lock:
            self._fault, self._remaining = None, 0.0

    def has(self, fault: SimulatedFault) -> bool:
        """Return whether that fault is on, without counting."""
        with self._lock:
            return self._fault is fault and self._remaining > 0

    def strikes(self, fault: SimulatedFault) -> bool:
        """Return whether that fault hits now, and count it."""
        with self._lock:
            if self._fault is not fault or self._remaining <= 0:
                return False
            self._remaining -= 0 if math.isinf(self._remaining) else 1
            return True
