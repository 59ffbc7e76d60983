"""Supplies that speak SCPI; models and makers' dialects are in `models/scpi.py`."""

from __future__ import annotations

import re
from contextlib import suppress
from decimal import Decimal

from workbench.errors import HardwareError
from workbench.hw.clock import Clock
from workbench.hw.line import Line
from workbench.hw.models import SCPI, Protection, model_answering
from workbench.hw.setting import mode_from_readings
from workbench.hw.supply import NOT_REPORTED, Identity, Reading
from workbench.hw.text import TextSupply, introduced

__all__ = ["GAP_S", "MAY_SEND", "TERMINATOR", "ScpiSupply"]

TERMINATOR = b"\n"
GAP_S = 0.02
NUMBER = re.compile(rb"[+-]?\d+\.\d*([eE][+-]?\d+)?")  # with a point: no switch looks like it
SWITCH = re.compile(rb"0|1|ON|OFF|YES|NO")
BITS = re.compile(rb"0x[0-9a-fA-F]{1,8}")
TRUE = (b"1", b"ON", b"YES")
ANY = re.compile(rb"[\x20-\x7e]*")


def _may_send() -> re.Pattern[str]:
    rows = [model.on_channel(n) for model in SCPI for n in range(1, model.channels + 1)]
    commands = frozenset().union(*(row.dialect.commands for row in rows))
    number = r"\d+(\.\d+)?"
    return re.compile("|".join(re.escape(c).replace(r"\{\}", number) for c in sorted(commands)))


MAY_SEND = _may_send()


class ScpiSupply(TextSupply):
    """One channel of a supply that speaks SCPI in the dialect of its row.

    Args:
        line: an open line to it; its connection names the channel.
        clock: see `Supply`.

    Raises:
        HardwareError: when it does not answer, or as an unknown model.
        InputError: when it has no such channel.
    """

    def __init__(self, line: Line, clock: Clock) -> None:
        model, found = model_answering(SCPI, introduced(line))
        self._channel = line.connection.channel
        self._row = model.on_channel(self._channel)
        self._dialect = self._row.dialect
        serial, firmware = found["serial"] or NOT_REPORTED, found["firmware"] or NOT_REPORTED
        super().__init__(line, clock, self._row, Identity(model.name, serial, firmware))
        if model.channels > 1:
            self.name = f"channel {self._channel} of {self.name}"
        line.set_gap(model.gap_s)
        line.selection = self._dialect.select
        for command in self._dialect.start:
            line.send_command(command)

    def _reading(self) -> Reading:
        said, output = self._dialect, self._output(again=False)
        volts = self._number(said.measured_voltage, output)
        amps = self._number(said.measured_current, output)
        set_volts = self._number(said.voltage_ask, output)
        limit = self._number(said.current_ask, output)
        protection: Protection = "none" if output else self._tripped()  # a trip switches off
        self._line.ask_who()  # an answer too many ends up here
        step = self._model.current_steps_A[0]
        return Reading(
            time_s=self.clock.now(),
            set_voltage_V=float(set_volts),
            voltage_V=float(volts),
            current_A=float(amps),
            output=output,
            mode=mode_from_readings(output, (set_volts, volts), (limit, amps), step),
            protection=protection,
            input_voltage_V=None,
        )

    def _tripped(self) -> Protection:
        for protection, question in self._dialect.tripped:
            if self._line.ask(question, SWITCH, again=False) in TRUE:
                return protection
            self._line.ask(self._dialect.current_ask, NUMBER, again=False)  # see `_number`
        return "none"

    def _apply_voltage(self, volts: Decimal) -> Decimal:
        said = self._dialect
        return self._set(said.voltage, said.voltage_ask, NUMBER, volts, "V")

    def _apply_current_limit(self, amps: Decimal) -> Decimal:
        said = self._dialect
        return self._set(said.current, said.current_ask, NUMBER, amps, "A")

    def _apply_protection(
        self, over_voltage: Decimal, over_current: Decimal
    ) -> tuple[Decimal, Decimal]:
        dialect = self._dialect
        if dialect.output_bits:
            self._refuse_joined(self._status())
        volts = self.limits.voltage_max_V  # it does not trip
        if dialect.over_voltage:
            volts = self._set(
                dialect.over_voltage, dialect.over_voltage_ask, NUMBER, over_voltage, "V"
            )
        amps = self.limits.current_max_A  # it trips at the current limit
        if dialect.over_current:
            amps = self._set(
                dialect.over_current, dialect.over_current_ask, NUMBER, over_current, "A"
            )
        for command, question in dialect.enable:
            self._line.send_command(command)
            if self._line.ask(question, SWITCH) not in TRUE:
                raise HardwareError(
                    f"{self.name}: sent {command!r}, but {question} does not answer that it is on"
                    + self._complaint()
                )
        return volts, amps

    def _switch(self, on: bool) -> None:
        for command in self._dialect.on if on else self._dialect.off:
            self._line.send_command(command, urgent=not on)

    def _output(self, *, again: bool = True) -> bool:
        said = self._dialect
        if not said.output_bits:
            return self._line.ask(said.output_ask, SWITCH, again=again) in TRUE
        word = self._status(again=again)
        on = bool(word >> said.output_bits[self._channel - 1] & 1)
        if on:  # off stays off, however they are joined
            self._refuse_joined(word)
        return on

    def _status(self, *, again: bool = True) -> int:
        return int(self._line.ask(self._dialect.output_ask, BITS, again=again), 16)

    def _refuse_joined(self, word: int) -> None:
        mask, apart = self._dialect.apart
        if word & mask != apart:
            raise HardwareError(
                f"{self.name}: its channels are joined in series or in parallel "
                f"({self._dialect.output_ask} answers {word:#06x}), which multiplies what is set; "
                "make them independent at its front"
            )

    def _number(self, question: str, output: bool) -> Decimal:
        """Ask for a number, and then for the output's switch, which has to be as before.

        Numbers look alike; so that none is taken for another, no two are asked for in a row.
        """
        value = Decimal(self._line.ask(question, NUMBER, again=False).decode("ascii"))
        if self._output(again=False) != output:
            raise HardwareError(
                f"{self.name}: {self._dialect.output_ask} answered {output:d} and then "
                f"{not output:d} within one reading; somebody is at its front panel, or the line "
                "is disturbed"
            )
        return value

    def _complaint(self) -> str:
        with suppress(HardwareError):
            answer = self._line.ask(self._dialect.complaint, ANY).decode("ascii")
            return f"; its own error: {answer}"
        return ""
