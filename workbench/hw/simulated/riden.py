"""A simulated Riden RD60xx: registers and output as the device has them, without any wire."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from decimal import Decimal

from workbench.hw.clock import Clock
from workbench.hw.models import model_named, to_word
from workbench.hw.simulated.faults import Fault, FaultSwitch, RequestError

__all__ = ["Load", "SimulatedRiden"]

Load = Callable[[float], float]  # output voltage [V] -> current [A], rising with the voltage

REGISTERS = 120  # 0 to 83 and the presets M1-M9; real ones answer all of them in one read
MODEL, SERIAL, FIRMWARE = 0, 1, 3
V_SET, I_SET, V_OUT, I_OUT, POWER, V_IN = 8, 9, 10, 11, 12, 14
PROTECTION, MODE, OUTPUT, PRESET, RANGE = 16, 17, 18, 19, 20
POWER_ON_OUTPUT, M0, OVP, OCP = 68, 80, 82, 83
READ_ONLY = frozenset({*range(8), *range(10, 15), 16, 17, *range(21, 32), *range(33, 42)})
SAME = {V_SET: M0, I_SET: M0 + 1, M0: V_SET, M0 + 1: I_SET}  # preset M0 is live
FACTORY_OVP, FACTORY_OCP = Decimal(62), Decimal("1.02")  # OCP as a share of the model's maximum


def no_load(volts: float) -> float:
    """Draw nothing."""
    return 0.0


class SimulatedRiden:
    """A Riden supply: V out = V set while on, less when the current limit acts, else 0.

    Trips as the device does: OVP when the output voltage exceeds register 82, OCP when the
    current exceeds register 83; the output then goes off and register 16 says why until it is
    switched on again. The state is brought up to date at every request.

    Args:
        model: a name from the model table.
        serial: serial number.
        firmware: version x100.
        input_voltage: at its input [V].
        clock: stamps the history.
        load: what hangs on the output.

    Attributes:
        history: (time [s], output voltage [V]) from each change on: the truth at the terminals.
        unit: its Modbus unit id; it stays silent to others.
    """

    def __init__(
        self,
        *,
        clock: Clock,
        model: str = "RD6006",
        serial: int = 12345678,
        firmware: int = 141,
        input_voltage: float = 65.0,
        unit: int = 1,
        load: Load = no_load,
    ) -> None:
        self.unit = unit
        self.faults = FaultSwitch()
        self._clock, self._load = clock, load
        self._model = model_named(model)
        self._lock = threading.RLock()
        self._words = [0] * REGISTERS
        self._words[:4] = [self._model.ids[0], serial >> 16, serial & 0xFFFF, firmware]
        self._words[V_IN] = round(input_voltage * 100)
        self._words[OVP] = to_word(FACTORY_OVP, self._model.voltage_step_V)
        factory_ocp = to_word(self._model.current_max_A * FACTORY_OCP, self._amp_step())
        self._words[OCP] = min(factory_ocp, 0xFFFF)
        self._words[I_SET] = self._words[M0 + 1] = to_word(Decimal(1), self._amp_step())
        self.history: list[tuple[float, float]] = [(clock.now(), 0.0)]

    def fail(
        self, fault: Fault, *, times: float = math.inf, code: int = 4, delay_s: float = 1.0
    ) -> None:
        """Switch a fault on.

        Args:
            fault: which; it replaces the one that was on.
            times: how many messages (or, for `stuck_output`, writes) it hits.
            code: exception code of `exception`.
            delay_s: lateness of `late_reply` in real time [s].
        """
        self.faults.on(Fault(fault), times, code, delay_s)

    def mend(self) -> None:
        """Switch the fault off."""
        self.faults.off()

    def read(self, address: int, count: int) -> list[int]:
        """Return registers as the device would answer them.

        Raises:
            RequestError: with code 2 when one of them does not exist.
        """
        with self._lock:
            self._refuse_when_faulty()
            if address + count > REGISTERS:
                raise RequestError(2)
            self._update()
            return self._words[address : address + count]

    def write(self, address: int, words: Sequence[int]) -> None:
        """Take words into registers and act on them; also the front panel's way in.

        Raises:
            RequestError: with code 2 when one of them does not exist or cannot be written.
        """
        with self._lock:
            self._refuse_when_faulty()
            places = range(address, address + len(words))
            if any(place >= REGISTERS or place in READ_ONLY for place in places):
                raise RequestError(2)
            if self.faults.strikes(Fault.STUCK_OUTPUT):
                return
            for place, word in zip(places, words, strict=True):
                self._take(place, word)
            self._update()

    def _take(self, place: int, word: int) -> None:
        if place == PRESET:  # loads a preset, reads back 0
            preset = self._words[M0 + 4 * word : M0 + 4 * word + 4]
            for offset, value in enumerate(preset):
                self._take(M0 + offset, value)
            return
        if place == OUTPUT and word:
            self._words[PROTECTION] = 0
        self._words[place] = int(bool(word)) if place == OUTPUT else word
        if place in SAME:
            self._words[SAME[place]] = word

    def _update(self) -> None:
        """Bring measured values, mode and protection up to date with setpoints and load."""
        volts = amps = 0.0
        self._words[MODE] = 0
        if self._words[OUTPUT]:
            volts, amps = self._drive()
            if trip := self._trip(volts, amps):
                self._words[PROTECTION], self._words[OUTPUT] = trip, 0
                volts = amps = 0.0
        self._show(volts, amps)
        if volts != self.history[-1][1]:
            self.history.append((self._clock.now(), volts))

    def _drive(self) -> tuple[float, float]:
        """Return output voltage and current; the limit holds by lowering the voltage."""
        volts = self._value(V_SET, self._model.voltage_step_V)
        limit = self._value(I_SET, self._amp_step())
        amps = self._load(volts)
        if amps <= limit:
            return volts, amps
        self._words[MODE] = 1
        low, high = 0.0, volts
        for _ in range(40):  # bisection to well below one step
            middle = (low + high) / 2
            low, high = (middle, high) if self._load(middle) <= limit else (low, middle)
        return low, self._load(low)

    def _trip(self, volts: float, amps: float) -> int:
        if volts > self._value(OVP, self._model.voltage_step_V):
            return 1
        return 2 if amps > self._value(OCP, self._amp_step()) else 0

    def _show(self, volts: float, amps: float) -> None:
        self._words[V_OUT] = round(volts / float(self._model.voltage_step_V))
        self._words[I_OUT] = round(max(amps, 0.0) / float(self._amp_step()))
        power = round(volts * max(amps, 0.0) * 100)
        self._words[POWER], self._words[POWER + 1] = power >> 16, power & 0xFFFF

    def _value(self, place: int, step: Decimal) -> float:
        return float(self._words[place] * step)

    def _amp_step(self) -> Decimal:
        steps = self._model.current_steps_A
        return steps[min(self._words[RANGE], len(steps) - 1)]

    def _refuse_when_faulty(self) -> None:
        if self.faults.strikes(Fault.EXCEPTION):
            raise RequestError(self.faults.code)
