"""A simulated RuiDeng DPS or DPH: registers as the device has them, without any wire."""

from __future__ import annotations

from workbench.hw.clock import Clock
from workbench.hw.models import ModbusModel, Protection
from workbench.hw.simulated.device import Load, Output, no_load
from workbench.hw.simulated.registers import SimulatedRegisters

__all__ = ["SimulatedDps"]

V_SET, I_SET, V_OUT, I_OUT, POWER, V_IN, LOCK = range(0x00, 0x07)
PROTECT, MODE, OUTPUT, BACKLIGHT, MODEL, VERSION = range(0x07, 0x0D)
PRESET, OVP, OCP, OPP, BOOT_OUTPUT = 0x50, 0x52, 0x53, 0x54, 0x57
PRESETS = range(0x50, 0xA0)
KEPT = frozenset({LOCK, BACKLIGHT, *PRESETS})  # only keep what is written
CODES: dict[Protection, int] = {"none": 0, "OVP": 1, "OCP": 2, "OPP": 3}
INPUT_WORD = 5500  # 55 V
MOST = 32


class SimulatedDps(SimulatedRegisters):
    """A DPS or DPH; it knows 32 registers a request. See `SimulatedSupply`.

    Args:
        clock: stamps the history.
        model: a name from the model table.
        load: what hangs on the output.
    """

    most_registers = MOST

    def __init__(self, *, clock: Clock, model: str = "DPS5005", load: Load = no_load) -> None:
        self._words = dict.fromkeys(KEPT, 0)
        super().__init__(clock=clock, model=model, load=load)
        if not isinstance(self.model, ModbusModel):
            raise TypeError(f"{model} is no Modbus model")
        self._id = self.model.ids[0]

    def at_power_up(self) -> Output:
        """Return 0 V, 1 A, trip levels a little above the model's limits."""
        volts, amps = float(self.model.voltage_max_V), float(self.model.current_max_A)
        on = self._words[BOOT_OUTPUT] != 0
        return Output(over_voltage=volts + 1, over_current=amps + 0.1, on=on)

    def shown(self) -> dict[int, int]:
        """Return what its registers show."""
        now, volt, amp = self.reported, self.model.voltage_step_V, self.model.current_steps_A[0]
        words = {
            V_SET: self.counts(now.set_voltage, volt),
            I_SET: self.counts(now.current_limit, amp),
            V_OUT: self.counts(now.voltage, volt),
            I_OUT: self.counts(now.current, amp),
            POWER: round(now.voltage * now.current * 100) & 0xFFFF,
            V_IN: INPUT_WORD,
            PROTECT: CODES.get(now.protection, 0),
            MODE: int(now.mode == "CC"),
            OUTPUT: int(now.on),
            MODEL: self._id,
            VERSION: 14,
            OVP: self.counts(now.over_voltage, volt),
            OCP: self.counts(now.over_current, amp),
        }
        words |= {PRESET: words[V_SET], PRESET + 1: words[I_SET]}  # preset 0 is live
        return self._words | words

    def can_be_written(self, register: int) -> bool:
        """Return whether a register exists and can be written."""
        return register in KEPT or register in (V_SET, I_SET, OUTPUT)

    def take(self, register: int, word: int) -> None:
        """Act on a word that was written."""
        volt, amp = self.model.voltage_step_V, self.model.current_steps_A[0]
        match register:
            case 0x00 | 0x50:
                self.change(set_voltage=float(word * volt))
            case 0x01 | 0x51:
                self.change(current_limit=float(word * amp))
            case 0x09:
                self.switch(word != 0)
            case 0x52:
                self.change(over_voltage=float(word * volt))
            case 0x53:
                self.change(over_current=float(word * amp))
            case _:
                self._words[register] = word
