"""A simulated Hanmatek HM30x: registers as the device has them, without any wire."""

from __future__ import annotations

from decimal import Decimal

from workbench.hw.clock import Clock
from workbench.hw.models import ModbusModel, Protection
from workbench.hw.simulated.device import Load, Output, no_load
from workbench.hw.simulated.registers import SimulatedRegisters

__all__ = ["SimulatedHanmatek"]

OUTPUT, PROTECT, SPEC, CLASS, DECIMALS = range(0x0001, 0x0006)
V_OUT, I_OUT, POWER = 0x0010, 0x0011, 0x0012
OVP, OCP, OPP = 0x0020, 0x0021, 0x0022
V_SET, I_SET, TIMED = 0x0030, 0x0031, 0x0032
AT_POWER_UP, BEEP, UNIT = 0x8801, 0x8804, 0x9999
LIMITS = {0xC110: 0, 0xC11E: 3200, 0xC120: 0, 0xC12E: 10100}
STORED = frozenset(m + i for m in range(0x1000, 0x1060, 0x10) for i in range(4))
KEPT = frozenset({OPP, OPP + 1, TIMED, AT_POWER_UP, BEEP, *STORED})
BITS: dict[Protection, int] = {"none": 0, "OVP": 1, "OCP": 2, "OPP": 4, "OTP": 8, "SCP": 16}
VOLT, AMP, WATT = Decimal("0.01"), Decimal("0.001"), 0.001


class SimulatedHanmatek(SimulatedRegisters):
    """A Hanmatek HM305P or HM310P; see `SimulatedSupply`.

    Args:
        clock: stamps the history.
        model: a name from the model table.
        load: what hangs on the output.
    """

    def __init__(self, *, clock: Clock, model: str = "HM305P", load: Load = no_load) -> None:
        self._words = dict.fromkeys(KEPT, 0)
        super().__init__(clock=clock, model=model, load=load)
        if not isinstance(self.model, ModbusModel):
            raise TypeError(f"{model} is no Modbus model")
        self._fixed = {SPEC: self.model.ids[0], CLASS: 19280, DECIMALS: 0x0233, **LIMITS, UNIT: 1}

    def at_power_up(self) -> Output:
        """Return 0 V, 1 A, trip levels a little above the model's limits."""
        volts, amps = float(self.model.voltage_max_V), float(self.model.current_max_A)
        on = self._words[AT_POWER_UP] == 1
        return Output(over_voltage=volts + 1, over_current=amps + 0.1, on=on)

    def shown(self) -> dict[int, int]:
        """Return what its registers show."""
        now = self.reported
        power = round(now.voltage * now.current / WATT)
        words = {
            OUTPUT: int(now.on),
            PROTECT: BITS[now.protection],
            V_OUT: self.counts(now.voltage, VOLT),
            I_OUT: self.counts(now.current, AMP),
            POWER: power >> 16,
            POWER + 1: power & 0xFFFF,
            OVP: self.counts(now.over_voltage, VOLT),
            OCP: self.counts(now.over_current, AMP),
            V_SET: self.counts(now.set_voltage, VOLT),
            I_SET: self.counts(now.current_limit, AMP),
        }
        return self._words | self._fixed | words

    def can_be_written(self, register: int) -> bool:
        """Return whether a register exists and can be written."""
        return register in KEPT or register in (OUTPUT, OVP, OCP, V_SET, I_SET)

    def take(self, register: int, word: int) -> None:
        """Act on a word that was written."""
        match register:
            case 0x0001:
                self.switch(word != 0)
            case 0x0020:
                self.change(over_voltage=float(word * VOLT))
            case 0x0021:
                self.change(over_current=float(word * AMP))
            case 0x0030:
                self.change(set_voltage=float(word * VOLT))
            case 0x0031:
                self.change(current_limit=float(word * AMP))
            case _:
                self._words[register] = word
