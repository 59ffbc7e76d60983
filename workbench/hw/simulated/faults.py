"""The faults of a simulated supply: which one is on, and for how many messages."""

from __future__ import annotations

import math
import threading
from enum import StrEnum

__all__ = ["Fault", "FaultSwitch", "RequestError"]


class Fault(StrEnum):
    """What can go wrong, one at a time.

    `silent`, `bad_crc`, `short_reply`, `wrong_unit` and `late_reply` spoil the bytes that leave;
    `exception` refuses a request; `stuck_output` acknowledges writes without carrying them out.
    """

    SILENT = "silent"
    BAD_CRC = "bad_crc"
    SHORT_REPLY = "short_reply"
    WRONG_UNIT = "wrong_unit"
    LATE_REPLY = "late_reply"
    EXCEPTION = "exception"
    STUCK_OUTPUT = "stuck_output"


class RequestError(Exception):
    """A request that the device answers with a Modbus exception code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"Modbus exception {code}")
        self.code = code


class FaultSwitch:
    """Holds the fault that is on; safe to use from the test's thread and the server's."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._fault: Fault | None = None
        self._left = 0.0
        self.code = 4
        self.delay_s = 0.0

    def on(self, fault: Fault, times: float, code: int, delay_s: float) -> None:
        """Switch a fault on, see `SimulatedRiden.fail`."""
        with self._lock:
            self._fault, self._left = fault, times
            self.code, self.delay_s = code, delay_s

    def off(self) -> None:
        """Switch the fault off."""
        with self._lock:
            self._fault, self._left = None, 0.0

    def strikes(self, fault: Fault) -> bool:
        """Tell whether that fault hits now, and count it."""
        with self._lock:
            if self._fault is not fault or self._left <= 0:
                return False
            self._left -= 0 if math.isinf(self._left) else 1
            return True
