"""What all simulated supplies share: an output with a load on it, and what can happen to it."""

from __future__ import annotations

import math
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

from workbench.hw.clock import Clock
from workbench.hw.models import Model, Protection, model_named
from workbench.hw.simulated.faults import EVENTS, FaultSwitch, SimulatedFault
from workbench.hw.supply import Mode

__all__ = [
    "DeviceOutput",
    "Framing",
    "Load",
    "Output",
    "SimulatedSupply",
    "SpoiltWire",
    "Wire",
    "no_load",
]

Load = Callable[[float], float]  # output voltage [V] -> current [A], rising with the voltage
Framing = Literal["rtu", "tcp"]

HALVINGS = 40  # bisection to well below one step
PANEL_STEP_V = 1.0  # how far the knob of `panel-voltage` is turned


class DeviceOutput(NamedTuple):
    """Bytes that leave a device.

    Args:
        delay_s: how long it takes first, in real time [s].
        data: the bytes.
    """

    delay_s: float
    data: bytes


class Wire(ABC):
    """One conversation with a device: bytes in, answers out. It has no clock and no port."""

    @abstractmethod
    def receive(self, data: bytes) -> list[DeviceOutput]:
        """Take what came in and return what the device answers, in order."""


class SpoiltWire(Wire):
    """A conversation whose answers are spoilt as the fault that is on says.

    Args:
        faults: of the device.
    """

    junk: bytes
    """What `junk` sends before an answer."""

    def __init__(self, faults: FaultSwitch) -> None:
        self._faults = faults
        self._last = b""

    @abstractmethod
    def _damaged(self, data: bytes) -> bytes:
        """Return an answer with a byte that `bad-crc` changed."""

    @abstractmethod
    def _shortened(self, data: bytes) -> bytes:
        """Return what `short-reply` leaves of an answer."""

    def _spoilt(self, data: bytes) -> list[DeviceOutput]:
        """Return what really goes out where `data` should."""
        faults, last = self._faults, self._last
        self._last = data
        if faults.strikes(SimulatedFault.SILENT):
            return []
        if faults.strikes(SimulatedFault.LATE_REPLY):
            return [DeviceOutput(faults.delay_s, data)]
        if faults.strikes(SimulatedFault.BAD_CRC):
            return [DeviceOutput(0, self._damaged(data))]
        if faults.strikes(SimulatedFault.SHORT_REPLY):
            return [DeviceOutput(0, self._shortened(data))]
        if faults.strikes(SimulatedFault.JUNK):
            return [DeviceOutput(0, self.junk + data)]
        if last and faults.strikes(SimulatedFault.REPEATED_REPLY):
            return [DeviceOutput(0, last), DeviceOutput(0, data)]
        return [DeviceOutput(0, data)]


def no_load(volts: float) -> float:
    """Draw nothing."""
    return 0.0


@dataclass(frozen=True)
class Output:
    """The state of an output.

    Args:
        set_voltage: setpoint [V].
        current_limit: [A].
        over_voltage: trip level [V].
        over_current: trip level [A].
        on: whether it says that it is on.
        protection: what switched it off.
        mode: whether the current limit acts.
        voltage: at the terminals [V].
        current: drawn [A].
    """

    set_voltage: float = 0.0
    current_limit: float = 1.0
    over_voltage: float = math.inf
    over_current: float = math.inf
    on: bool = False
    protection: Protection = "none"
    mode: Mode = "CV"
    voltage: float = 0.0
    current: float = 0.0


class SimulatedSupply(ABC):
    """A supply: V out = V set while on, less when the current limit acts, else 0.

    Trips as the devices do: when voltage or current pass their trip level the output goes off and
    says why until it is switched on again. The state is brought up to date at every request.

    Args:
        clock: stamps the history.
        model: a name from the model table.
        load: what hangs on the output.

    Attributes:
        history: (time [s], output voltage [V]) from each change on: the truth at the terminals.
        unit: its Modbus unit id; it does not answer others.
        faults: which fault is on.
        lock: held while a request is carried out.
    """

    unit = 1

    def __init__(self, *, clock: Clock, model: str, load: Load = no_load) -> None:
        self.faults = FaultSwitch()
        self.lock = threading.RLock()
        self.model: Model = model_named(model)
        self._clock, self._load = clock, load
        self._frozen: Output | None = None
        self._driven: float | None = None  # what it drives though it says that it is off
        self.output = self.at_power_up()
        self.history: list[tuple[float, float]] = [(clock.now(), 0.0)]

    @abstractmethod
    def at_power_up(self) -> Output:
        """Return the output as it is after power came."""

    @abstractmethod
    def wire(self, framing: Framing) -> Wire:
        """Begin a conversation; the framing matters to Modbus only."""

    def fail(
        self, fault: SimulatedFault, *, times: float = math.inf, code: int = 4, delay_s: float = 1.0
    ) -> None:
        """Switch a fault on, or let one happen.

        Args:
            fault: which; it replaces the one that was on.
            times: how many messages (or, for `ignored-write`, writes) it hits.
            code: exception code of `exception`.
            delay_s: lateness of `late-reply` in real time [s].
        """
        fault = SimulatedFault(fault)
        with self.lock:
            if fault in EVENTS:
                self._happen(fault)
                return
            self._frozen = self.output
            self.faults.on(fault, times, code, delay_s)
            self.update()

    def select_next_channel(self) -> None:  # noqa: B027  most have one only
        """Select the next channel at the front, where there are several."""

    def mend(self) -> None:
        """Switch the fault off; what it did to the output stays until it is switched."""
        with self.lock:
            self.faults.off()
            self._driven = None
            self.update()

    @property
    def unplugged(self) -> bool:
        """Whether its link is cut."""
        return self.faults.has(SimulatedFault.UNPLUGGED)

    @property
    def reported(self) -> Output:
        """The output as the device reports it."""
        frozen = self._frozen
        return frozen if frozen and self.faults.has(SimulatedFault.FROZEN_READING) else self.output

    def switch(self, on: bool) -> None:
        """Switch the output as a command does; faults may keep it from doing so."""
        if self.faults.strikes(SimulatedFault.STUCK_OUTPUT):
            return
        if not on and self.output.on and self.faults.has(SimulatedFault.FALSE_OFF):
            self._driven = self.output.voltage
        self.change(on=on, protection="none" if on else self.output.protection)

    def change(self, **to: Any) -> None:  # the names and types are those of Output
        """Change the output's settings and let it settle."""
        self.output = replace(self.output, **to)
        self.update()

    def update(self) -> None:
        """Bring measured values, mode and protection up to date with settings and load."""
        now, volts, amps = self.output, 0.0, 0.0
        mode: Mode = "CV"
        trip: Protection = "none"
        if now.on:
            volts, amps, mode = self._drive()
            trip = self._trip(volts, amps)
        if trip != "none":
            volts, amps, mode = 0.0, 0.0, "CV"
            now = replace(now, on=False, protection=trip)
        elif not now.on and self._driven is not None:
            volts, amps = self._driven, self._load(self._driven)
        self.output = replace(now, voltage=volts, current=amps, mode=mode)
        if volts != self.history[-1][1]:
            self.history.append((self._clock.now(), volts))

    def _happen(self, event: SimulatedFault) -> None:
        now = self.output
        match event:
            case SimulatedFault.PANEL_OFF:
                self.change(on=False)
            case SimulatedFault.PANEL_ON:
                self.change(on=True, protection="none")
            case SimulatedFault.PANEL_VOLTAGE:
                self.change(set_voltage=now.set_voltage + PANEL_STEP_V)
            case SimulatedFault.PANEL_CHANNEL:
                self.select_next_channel()
            case SimulatedFault.POWER_CYCLE:
                self.output = self.at_power_up()
                self.update()
            case _:
                trip: Protection = "OVP" if event is SimulatedFault.OVP_TRIP else "OCP"
                self.change(on=False, protection=trip)

    def _drive(self) -> tuple[float, float, Mode]:
        """Return voltage, current and mode; the limit holds by lowering the voltage."""
        volts = self.output.set_voltage * self._factor()
        limit = self.output.current_limit
        amps = self._load(volts)
        if amps <= limit:
            return volts, amps, "CV"
        low, high = 0.0, volts
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if self._load(middle) <= limit else (low, middle)
        return low, self._load(low), "CC"

    def _factor(self) -> float:
        if self.faults.has(SimulatedFault.TIMES_TEN):
            return 10.0
        return 0.1 if self.faults.has(SimulatedFault.A_TENTH) else 1.0

    def _trip(self, volts: float, amps: float) -> Protection:
        if volts > self.output.over_voltage and self._factor() == 1.0:  # a scale that is wrong
            return "OVP"  # is wrong in the trip level too
        return "OCP" if amps > self.output.over_current else "none"
