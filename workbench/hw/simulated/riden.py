"""A simulated Riden RD60xx: registers as the device has them, without any wire."""

from __future__ import annotations

from decimal import Decimal

from workbench.hw.clock import Clock
from workbench.hw.models import ModbusModel, Protection
from workbench.hw.simulated.device import Load, Output, no_load
from workbench.hw.simulated.registers import SimulatedRegisters

__all__ = ["SimulatedRiden"]

REGISTERS = 120  # 0 to 83 and the presets M1-M9; real ones answer all of them in one read
MODEL, SERIAL, FIRMWARE = 0, 1, 3
V_SET, I_SET, V_OUT, I_OUT, POWER, V_IN = 8, 9, 10, 11, 12, 14
PROTECTION, MODE, OUTPUT, PRESET, RANGE = 16, 17, 18, 19, 20
POWER_ON_OUTPUT, M0, OVP, OCP = 68, 80, 82, 83
READ_ONLY = frozenset({*range(8), *range(10, 15), 16, 17, *range(21, 32), *range(33, 42)})
FACTORY_OVP_V, FACTORY_OCP = 62.0, 1.02  # OCP as a share of the model's maximum
CODES: dict[Protection, int] = {"none": 0, "OVP": 1, "OCP": 2}


class SimulatedRiden(SimulatedRegisters):
    """A Riden supply; see `SimulatedSupply`.

    Args:
        clock: stamps the history.
        model: a name from the model table.
        serial: serial number.
        firmware: version x100.
        input_voltage: at its input [V].
        unit: its Modbus unit id.
        load: what hangs on the output.
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
        self._words = dict.fromkeys(range(REGISTERS), 0)  # those that only keep what is written
        super().__init__(clock=clock, model=model, load=load)
        if not isinstance(self.model, ModbusModel):
            raise TypeError(f"{model} is no Modbus model")
        self._words |= {MODEL: self.model.ids[0], SERIAL: serial >> 16, SERIAL + 1: serial & 0xFFFF}
        self._words |= {FIRMWARE: firmware, V_IN: round(input_voltage * 100)}

    def at_power_up(self) -> Output:
        """Return 0 V, 1 A and the factory's trip levels; register 68 decides about the output."""
        return Output(
            over_voltage=FACTORY_OVP_V,
            over_current=float(self.model.current_max_A) * FACTORY_OCP,
            on=self._words[POWER_ON_OUTPUT] != 0,
        )

    def shown(self) -> dict[int, int]:
        """Return what its registers show."""
        now, volt, amp = self.reported, self.model.voltage_step_V, self._amp_step()
        power = round(now.voltage * now.current * 100)
        words = {
            V_SET: self.counts(now.set_voltage, volt),
            I_SET: self.counts(now.current_limit, amp),
            V_OUT: self.counts(now.voltage, volt),
            I_OUT: self.counts(now.current, amp),
            POWER: power >> 16,
            POWER + 1: power & 0xFFFF,
            PROTECTION: CODES.get(now.protection, 0),
            MODE: int(now.mode == "CC"),
            OUTPUT: int(now.on),
            PRESET: 0,
            OVP: self.counts(now.over_voltage, volt),
            OCP: self.counts(now.over_current, amp),
        }
        words |= {M0: words[V_SET], M0 + 1: words[I_SET]}  # preset M0 is live
        return self._words | words

    def can_be_written(self, register: int) -> bool:
        """Return whether a register exists and can be written."""
        return register < REGISTERS and register not in READ_ONLY

    def take(self, register: int, word: int) -> None:
        """Act on a word that was written."""
        volt, amp = self.model.voltage_step_V, self._amp_step()
        match register:
            case 8 | 80:
                self.change(set_voltage=float(word * volt))
            case 9 | 81:
                self.change(current_limit=float(word * amp))
            case 18:
                self.switch(word != 0)
            case 19:  # loads a preset, reads back 0
                for offset in range(4):
                    self.take(M0 + offset, self._words[M0 + 4 * word + offset])
            case 82:
                self.change(over_voltage=float(word * volt))
            case 83:
                self.change(over_current=float(word * amp))
            case _:
                self._words[register] = word

    def _amp_step(self) -> Decimal:
        steps = self.model.current_steps_A
        return steps[min(self._words[RANGE], len(steps) - 1)]
