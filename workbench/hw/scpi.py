"""Supplies that speak SCPI; models and makers' dialects are in `models/scpi.py`."""

from __future__ import annotations

import re
from contextlib import suppress
from decimal import Decimal

from workbench.errors import HardwareError
from workbench.hw.clock import Clock
from workbench.hw.line import Line
from workbench.hw.models import SCPI, Protection, ScpiModel, model_answering
from workbench.hw.setting import NOT_REPORTED, told_mode
from workbench.hw.supply import Identity, Reading
from workbench.hw.text import TextSupply

__all__ = ["GAP_S", "MAY_SEND", "TERMINATOR", "ScpiSupply"]

TERMINATOR = b"\n"
GAP_S = 0.02
NUMBER = re.compile(rb"[+-]?\d+\.\d*([eE][+-]?\d+)?")  # with a point: no switch looks like it
SWITCH = re.compile(rb"0|1|ON|OFF|YES|NO")
TRUE = (b"1", b"ON", b"YES")
ANY = re.compile(rb"[\x20-\x7e]*")


def _may_send() -> re.Pattern[str]:
    commands = frozenset().union(*(model.dialect.commands for model in SCPI))
    number = r"\d+(\.\d+)?"
    return re.compile("|".join(re.escape(c).replace(r"\{\}", number) for c in sorted(commands)))


MAY_SEND = _may_send()


class ScpiSupply(TextSupply):
    """One supply that speaks SCPI in the dialect of its row.

    Args:
        line: an open line to it.
        clock: see `Supply`.

    Raises:
        HardwareError: when it does not answer, or as an unknown model.
    """

    def __init__(self, line: Line, clock: Clock) -> None:
        model, found = model_answering(SCPI, line.identify())
        self._row: ScpiModel = model
        serial, firmware = found["serial"] or NOT_REPORTED, found["firmware"] or NOT_REPORTED
        super().__init__(line, clock, model, Identity(model.name, serial, firmware))
        for command in model.dialect.start:
            line.tell(command)

    def _reading(self) -> Reading:
        output = self._output(again=False)
        volts, amps = self._number("MEAS:VOLT?", output), self._number("MEAS:CURR?", output)
        set_volts, limit = self._number("VOLT?", output), self._number("CURR?", output)
        protection: Protection = "none" if output else self._tripped()  # a trip switches off
        self._line.ask_who()  # an answer too many ends up here
        step = self._model.current_steps_A[0]
        return Reading(
            time_s=self.clock.now(),
            set_voltage_V=float(set_volts),
            voltage_V=float(volts),
            current_A=float(amps),
            output=output,
            mode=told_mode(output, (set_volts, volts), (limit, amps), step),
            protection=protection,
            input_voltage_V=None,
        )

    def _tripped(self) -> Protection:
        for protection, question in self._row.dialect.tripped:
            if self._line.ask(question, SWITCH, again=False) in TRUE:
                return protection
            self._line.ask("CURR?", NUMBER, again=False)  # see `_number`
        return "none"

    def _apply_voltage(self, volts: Decimal) -> Decimal:
        return self._set("VOLT {}", "VOLT?", NUMBER, volts, "V")

    def _apply_current_limit(self, amps: Decimal) -> Decimal:
        return self._set("CURR {}", "CURR?", NUMBER, amps, "A")

    def _apply_protection(
        self, over_voltage: Decimal, over_current: Decimal
    ) -> tuple[Decimal, Decimal]:
        own = self._row.dialect
        volts = self._set(own.over_voltage, own.over_voltage_ask, NUMBER, over_voltage, "V")
        amps = self.limits.current_max_A  # it trips at the current limit
        if own.over_current:
            amps = self._set(own.over_current, own.over_current_ask, NUMBER, over_current, "A")
        for command, question in own.enable:
            self._line.tell(command)
            if self._line.ask(question, SWITCH) not in TRUE:
                raise HardwareError(
                    f"{self.name}: sent {command!r}, but {question} does not answer that it is on"
                    + self._complaint()
                )
        return volts, amps

    def _switch(self, on: bool) -> None:
        for command in self._row.dialect.on if on else self._row.dialect.off:
            self._line.tell(command, urgent=not on)

    def _output(self, *, again: bool = True) -> bool:
        return self._line.ask("OUTP?", SWITCH, again=again) in TRUE

    def _number(self, question: str, output: bool) -> Decimal:
        """Ask for a number, and then for the output's switch, which has to be as before.

        Numbers look alike; so that none can stand for another, no two are asked for in a row.
        """
        told = Decimal(self._line.ask(question, NUMBER, again=False).decode("ascii"))
        if self._output(again=False) != output:
            raise HardwareError(
                f"{self.name}: OUTP? answered {output:d} and then {not output:d} within one "
                "reading; somebody is at its front panel, or the line is disturbed"
            )
        return told

    def _complaint(self) -> str:
        with suppress(HardwareError):
            told = self._line.ask(self._row.dialect.complaint, ANY).decode("ascii")
            return f"; its own error: {told}"
        return ""
