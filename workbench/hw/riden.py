"""Riden RD60xx bench supplies over Modbus: register table on top, driver below.

Source of the registers: instruments survey 1.2 (Baldanos/rd6006, ShayBox/Riden, riden-dongle and
libsigrok rdtech-dps agree on those used here). Every block is read with its own length, so that
an answer that belongs to another request cannot pass for the one asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from decimal import Decimal

from workbench.errors import HardwareError, InputError
from workbench.hw.clock import Clock
from workbench.hw.models import from_word, model_of, to_word
from workbench.hw.supply import Identity, Mode, Protection, Reading, Supply
from workbench.hw.transport import Transport

__all__ = ["RidenSupply"]

IDENTITY = (0, 4)  # model id, serial high, serial low, firmware x100
STATUS = (8, 13)  # 8 V set, 9 I set, 10 V, 11 I, 12-13 P, 14 V in, 16-18 as below, 20 range
V_SET, I_SET, V_OUT, I_OUT, V_IN = 8, 9, 10, 11, 14
PROTECTION, MODE, OUTPUT, RANGE = 16, 17, 18, 20
POWER_ON_OUTPUT = (68, 1)
TRIP_LEVELS = (82, 2)  # OVP, OCP of M0, the live preset
OVP, OCP = 82, 83

PROTECTIONS: dict[int, Protection] = {0: "none", 1: "OVP", 2: "OCP"}
MODES: dict[int, Mode] = {0: "CV", 1: "CC"}
INPUT_STEP = Decimal("0.01")  # the same for every model

READ_BACKS = 3  # a setpoint may show a moment after its acknowledgement
READ_BACK_PAUSE_S = 0.05


class RidenSupply(Supply):
    """One Riden RD60xx; its scales come from the model id that it reports.

    Args:
        link: an open link to it.
        clock: see `Supply`.

    Raises:
        HardwareError: when it does not answer, or with an unknown model id.
    """

    def __init__(self, link: Transport, clock: Clock) -> None:
        self._link = link
        self._words = link.read(*IDENTITY)
        self._model = model_of("riden", self._words[0])
        super().__init__(f"{self._model.name} at {link.connection.address}", clock)

    def identify(self) -> Identity:
        """Ask for model, serial and firmware again.

        Raises:
            HardwareError: when another device than at the start answers.
        """
        words = self._link.read(*IDENTITY)
        if words[:3] != self._words[:3]:
            raise HardwareError(
                f"{self.name}: another device answers now, model id {words[0]} serial "
                f"{_serial(words)}, before {self._words[0]} serial {_serial(self._words)}"
            )
        return Identity(self._model.name, _serial(words), f"{words[3] / 100:.2f}")

    def measure(self) -> Reading:
        """Read registers 8 to 20 in one exchange.

        Raises:
            HardwareError: when there is no good answer, or a state that no source describes.
        """
        status = self._status()
        time = self.clock.now()
        volt_step, amp_step = self._model.voltage_step_V, self._current_step(status)
        if status[PROTECTION] not in PROTECTIONS or status[MODE] not in MODES:
            raise HardwareError(
                f"{self.name}: protection {status[PROTECTION]} and mode {status[MODE]}; "
                f"known are {PROTECTIONS} and {MODES}"
            )
        return Reading(
            time_s=time,
            set_voltage_V=float(from_word(status[V_SET], volt_step)),
            voltage_V=float(from_word(status[V_OUT], volt_step)),
            current_A=float(from_word(status[I_OUT], amp_step)),
            output=status[OUTPUT] != 0,
            mode=MODES[status[MODE]],
            protection=PROTECTIONS[status[PROTECTION]],
            input_voltage_V=float(from_word(status[V_IN], INPUT_STEP)),
        )

    def measure_power_on_output(self) -> bool:
        """Read register 68."""
        return self._link.read(*POWER_ON_OUTPUT)[0] != 0

    def close(self) -> None:
        """Close the link."""
        self._link.close()

    def _apply_voltage(self, volts: Decimal) -> Decimal:
        self._refuse_beyond_model(volts, self._model.voltage_max_V, "V")
        step = self._model.voltage_step_V
        return self._write(V_SET, volts, step, "V", lambda: self._status()[V_SET])

    def _apply_current_limit(self, amps: Decimal) -> Decimal:
        self._refuse_beyond_model(amps, self._model.current_max_A, "A")
        step = self._current_step(self._status())
        return self._write(I_SET, amps, step, "A", lambda: self._status()[I_SET])

    def _apply_protection(
        self, over_voltage: Decimal, over_current: Decimal
    ) -> tuple[Decimal, Decimal]:
        self._refuse_beyond_model(over_voltage, self._model.voltage_max_V, "V")
        self._refuse_beyond_model(over_current, self._model.current_max_A, "A")
        volt_step, amp_step = self._model.voltage_step_V, self._current_step(self._status())
        return (
            self._write(
                OVP, over_voltage, volt_step, "V", lambda: self._link.read(*TRIP_LEVELS)[0]
            ),
            self._write(OCP, over_current, amp_step, "A", lambda: self._link.read(*TRIP_LEVELS)[1]),
        )

    def _apply_output(self, on: bool) -> None:
        if on:
            self._link.write(OUTPUT, 1)
        else:
            self._reconnect_to_same_device()
            with suppress(HardwareError):  # what is read back decides, not the echo
                self._link.write(OUTPUT, 0, urgent=True)
        # no patience for off: better to send off again soon
        found = self._read_back(int(on), lambda: self._status(again=on)[OUTPUT])
        if found != int(on):
            raise HardwareError(
                f"{self.name}: output asked {'on' if on else 'off'}, wrote {int(on)} to register "
                f"{OUTPUT}, read back {found}"
            )

    def _status(self, *, again: bool = True) -> dict[int, int]:
        """Return the status block by register address."""
        start, count = STATUS
        return dict(enumerate(self._link.read(start, count, again=again), start))

    def _current_step(self, status: dict[int, int]) -> Decimal:
        steps = self._model.current_steps_A
        if len(steps) == 1:
            return steps[0]
        if status[RANGE] >= len(steps):
            raise HardwareError(
                f"{self.name}: current range {status[RANGE]} in register {RANGE}; "
                f"known are 0 to {len(steps) - 1}"
            )
        return steps[status[RANGE]]

    def _write(
        self, address: int, value: Decimal, step: Decimal, unit: str, read: Callable[[], int]
    ) -> Decimal:
        """Write a value as its nearest word and return what the supply then holds."""
        word = to_word(value, step)
        if word > 0xFFFF:
            raise InputError(
                f"{self.name}: {value} {unit} is {word} steps of {step} {unit}, "
                f"more than a register holds; {from_word(0xFFFF, step)} {unit} is the most"
            )
        self._link.write(address, word)
        found = self._read_back(word, read)
        if found != word:
            raise HardwareError(
                f"{self.name}: asked {value} {unit}, wrote {word} to register {address}, "
                f"read back {found}, which is {from_word(found, step)} {unit}"
            )
        return from_word(word, step)

    def _read_back(self, word: int, read: Callable[[], int]) -> int:
        found = read()
        for _ in range(READ_BACKS - 1):
            if found == word:
                break
            self.clock.sleep(READ_BACK_PAUSE_S)
            found = read()
        return found

    def _reconnect_to_same_device(self) -> None:
        """Open a lost link again, for switching off, and make sure who is there."""
        if self._link.connected:
            return
        self._link.open()
        try:
            self.identify()
        except BaseException:
            self._link.close()  # so that the next try checks again
            raise

    def _refuse_beyond_model(self, value: Decimal, highest: Decimal, unit: str) -> None:
        if value > highest:
            raise InputError(
                f"{self.name}: {value} {unit} is more than this model's {highest} {unit}; "
                "nothing was sent"
            )


def _serial(words: list[int]) -> str:
    return f"{(words[1] << 16) | words[2]:08d}"
