"""What all Modbus supplies share: a register table, and a driver that reads and writes by it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from decimal import Decimal
from typing import ClassVar, NamedTuple

from workbench.errors import HardwareError, InputError
from workbench.hw.clock import Clock
from workbench.hw.connection import Connection
from workbench.hw.health import NoAnswer
from workbench.hw.models import (
    Block,
    Family,
    Protection,
    Registers,
    from_word,
    model_with_id,
    to_word,
)
from workbench.hw.setting import mode_from_readings, read_back, refuse_beyond, reopen
from workbench.hw.supply import Identity, Mode, Reading, Supply
from workbench.hw.transport import Transport

__all__ = ["DeviceId", "ModbusSupply"]

MODES: dict[int, Mode] = {0: "CV", 1: "CC"}
INPUT_STEP = Decimal("0.01")  # the same for every model

Words = dict[int, int]  # by address


class DeviceId(NamedTuple):
    """Who a supply says it is.

    Args:
        model_id: the number of its model.
        serial: serial number.
        firmware: version.
    """

    model_id: int
    serial: str
    firmware: str


class ModbusSupply(Supply):
    """A supply that keeps everything in holding registers; its scales come from its model id.

    Args:
        link: an open link to it.
        clock: see `Supply`.

    Raises:
        HardwareError: when it does not answer, or with an unknown model id.
    """

    family: ClassVar[Family]
    registers: ClassVar[Registers]

    def __init__(self, link: Transport, clock: Clock) -> None:
        self._link = link
        self._who = self._decode_identity(self._read(self.registers.identity))
        self._model = model_with_id(self.family, self._who.model_id)
        super().__init__(f"{self._model.name} at {link.connection.address}", clock)

    @abstractmethod
    def _decode_identity(self, words: Words) -> DeviceId:
        """Return who the identity block says it is."""

    @abstractmethod
    def _protection(self, word: int) -> Protection | None:
        """Return what the protection register says; nothing when no source describes it."""

    def identify(self) -> Identity:
        """Ask for model, serial and firmware again.

        Raises:
            HardwareError: when another device than at the start answers.
        """
        answered = self._decode_identity(self._read(self.registers.identity))
        if answered[:2] != self._who[:2]:
            raise HardwareError(
                f"{self.name}: another device answers now, model id {answered.model_id} serial "
                f"{answered.serial}, before {self._who.model_id} serial {self._who.serial}"
            )
        return Identity(self._model.name, answered.serial, answered.firmware)

    def measure(self) -> Reading:
        """Read all status blocks.

        Raises:
            HardwareError: when there is no good answer, or a state that no source describes.
        """
        at, words = self.registers, self._status()
        time = self.clock.now()
        volt_step, amp_step = self._model.voltage_step_V, self._current_step(words)
        protection = self._protection(words[at.protection])
        mode = self._mode(words, amp_step)
        if protection is None or mode is None:
            raise HardwareError(
                f"{self.name}: protection {words[at.protection]} and mode "
                f"{words.get(at.mode or -1)} are no state that its sources describe"
            )
        supplied = at.input_voltage
        return Reading(
            time_s=time,
            set_voltage_V=float(from_word(words[at.voltage_set], volt_step)),
            voltage_V=float(from_word(words[at.voltage], volt_step)),
            current_A=float(from_word(words[at.current], amp_step)),
            output=words[at.output] != 0,
            mode=mode,
            protection=protection,
            input_voltage_V=(
                None if supplied is None else float(from_word(words[supplied], INPUT_STEP))
            ),
            current_limit_A=float(from_word(words[at.current_set], amp_step)),
        )

    def measure_power_on_output(self) -> bool:
        """Read whether the output comes on with the power."""
        return self._read(self.registers.power_on)[self.registers.power_on_output] != 0

    @property
    def connected(self) -> bool:
        """Whether its link is open, as far as is known."""
        return self._link.connected

    def reach(self, connection: Connection) -> None:
        """Look for it at another place. Raises as `Supply.reach`."""
        reopen(self._link, self.identify, connection)

    def close(self) -> None:
        """Close the link."""
        self._link.close()

    def _apply_voltage(self, volts: Decimal) -> Decimal:
        refuse_beyond(self.name, volts, self._model.voltage_max_V, "V")
        register = self.registers.voltage_set
        return self._write(register, volts, self._model.voltage_step_V, "V", self._status)

    def _apply_current_limit(self, amps: Decimal) -> Decimal:
        refuse_beyond(self.name, amps, self._model.current_max_A, "A")
        step = self._current_step(self._status())
        return self._write(self.registers.current_set, amps, step, "A", self._status)

    def _apply_protection(
        self, over_voltage: Decimal, over_current: Decimal
    ) -> tuple[Decimal, Decimal]:
        refuse_beyond(self.name, over_voltage, self._model.voltage_max_V, "V")
        refuse_beyond(self.name, over_current, self._model.current_max_A, "A")
        at, volt_step = self.registers, self._model.voltage_step_V
        amp_step = self._current_step(self._status())

        def trips() -> Words:
            return self._read(at.trips)

        return (
            self._write(at.over_voltage, over_voltage, volt_step, "V", trips),
            self._write(at.over_current, over_current, amp_step, "A", trips),
        )

    def _apply_output(self, on: bool) -> None:
        register = self.registers.output
        if on:
            self._link.write(register, 1)
        else:
            reopen(self._link, self.identify)
            try:
                self._link.write(register, 0, urgent=True)
            except NoAnswer:
                raise  # better to send off again at once than to ask who does not answer
            except HardwareError:
                pass  # what is read back decides, not the echo
        # no patience for off: better to send off again soon
        found = read_back(lambda: self._status(again=on)[register], int(on), self.clock)
        if found != int(on):
            raise HardwareError(
                f"{self.name}: output asked {'on' if on else 'off'}, wrote {int(on)} to register "
                f"{register}, read back {found}"
            )
        if not on:
            self.identify()  # another supply's off confirms nothing

    def _read(self, block: Block, *, again: bool = True) -> Words:
        words = self._link.read(block.start, block.count, spare=block.spare, again=again)
        return dict(enumerate(words, block.start))

    def _status(self, *, again: bool = True) -> Words:
        words: Words = {}
        for block in self.registers.status:
            words |= self._read(block, again=again)
        return words

    def _mode(self, words: Words, amp_step: Decimal) -> Mode | None:
        at, volt_step = self.registers, self._model.voltage_step_V
        if at.mode is not None:
            return MODES.get(words[at.mode])
        volts = from_word(words[at.voltage_set], volt_step), from_word(words[at.voltage], volt_step)
        amps = from_word(words[at.current_set], amp_step), from_word(words[at.current], amp_step)
        return mode_from_readings(words[at.output] != 0, volts, amps, amp_step)

    def _current_step(self, words: Words) -> Decimal:
        steps, register = self._model.current_steps_A, self.registers.current_range
        if register is None or len(steps) == 1:
            return steps[0]
        if words[register] >= len(steps):
            raise HardwareError(
                f"{self.name}: current range {words[register]} in register {register}; "
                f"known are 0 to {len(steps) - 1}"
            )
        return steps[words[register]]

    def _write(
        self, address: int, value: Decimal, step: Decimal, unit: str, read: Callable[[], Words]
    ) -> Decimal:
        """Write a value as its nearest word and return what the supply then holds."""
        word = to_word(value, step)
        if word > 0xFFFF:
            raise InputError(
                f"{self.name}: {value} {unit} is {word} steps of {step} {unit}, "
                f"more than a register holds; {from_word(0xFFFF, step)} {unit} is the most"
            )
        self._link.write(address, word)
        found = read_back(lambda: read()[address], word, self.clock)
        if found != word:
            raise HardwareError(
                f"{self.name}: asked {value} {unit}, wrote {word} to register {address}, "
                f"read back {found}, which is {from_word(found, step)} {unit}"
            )
        return from_word(word, step)
