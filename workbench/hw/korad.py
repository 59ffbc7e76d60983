"""Korad KA3005P and its clones over their text; the models are in `models/korad.py`.

Commands and answers have no terminator; an answer is known by its length (survey 1.5).
"""

from __future__ import annotations

import re
from decimal import Decimal

from workbench.errors import HardwareError
from workbench.hw.clock import Clock
from workbench.hw.line import Line
from workbench.hw.models import KORAD, KoradModel, model_answering
from workbench.hw.setting import mode_from_readings
from workbench.hw.supply import NOT_REPORTED, Identity, Reading
from workbench.hw.text import TextSupply, introduced

__all__ = ["GAP_S", "MAY_SEND", "TERMINATOR", "KoradSupply"]

TERMINATOR = b""
GAP_S = 0.05
MAY_SEND = re.compile(
    r"\*IDN\?|STATUS\?|[VI](SET|OUT)1\?|VSET1:\d\d\.\d\d|ISET1:\d\.\d{3}|OUT[01]|OVP1|OCP1"
)
VOLTS = re.compile(rb"\d\d\.\d\d")
AMPS = re.compile(rb"\d\.\d{3}(?P<stray>.)?", re.DOTALL)  # some firmware adds a byte, any
STATUS = re.compile(rb".", re.DOTALL)
OUTPUT_BIT = 6


class KoradSupply(TextSupply):
    """One Korad, Tenma, RND, Velleman or Stamos.

    Its over-voltage and over-current protection have no level of their own: once armed, they trip
    at the setpoints. What lies between setpoint and trip level of a run is watched by software.

    Args:
        line: an open line to it.
        clock: see `Supply`.

    Raises:
        HardwareError: when it does not answer, or as an unknown model.
    """

    def __init__(self, line: Line, clock: Clock) -> None:
        model, found = model_answering(KORAD, introduced(line))
        line.set_gap(model.gap_s)
        self._bits: KoradModel = model
        serial = found["serial"] or NOT_REPORTED
        super().__init__(line, clock, model, Identity(model.name, serial, found["firmware"]))

    def _reading(self) -> Reading:
        status = self._status(again=False)
        # behind ISET1? a byte may come late that looks like a status: volts are asked for next
        limit, volts = self._ask("ISET1?", AMPS), self._ask("VOUT1?", VOLTS)
        amps, set_volts = self._ask("IOUT1?", AMPS), self._ask("VSET1?", VOLTS)
        again = self._status(again=False)  # any byte is a status: only agreement counts
        if again != status:
            raise HardwareError(
                f"{self.name}: STATUS? answered {status:#04x} and then {again:#04x} within one "
                "reading; somebody is at its front panel, or the line is disturbed"
            )
        output = _is_on(status)
        step = self._model.current_steps_A[0]
        return Reading(
            time_s=self.clock.now(),
            set_voltage_V=float(set_volts),
            voltage_V=float(volts),
            current_A=float(amps),
            output=output,
            mode=mode_from_readings(output, (set_volts, volts), (limit, amps), step),
            protection="none",  # a trip shows as an output that went off
            input_voltage_V=None,
        )

    def _apply_voltage(self, volts: Decimal) -> Decimal:
        return self._set("VSET1:{}", "VSET1?", VOLTS, volts, "V")

    def _apply_current_limit(self, amps: Decimal) -> Decimal:
        return self._set("ISET1:{}", "ISET1?", AMPS, amps, "A")

    def _apply_protection(
        self, over_voltage: Decimal, over_current: Decimal
    ) -> tuple[Decimal, Decimal]:
        for command, bit in (
            ("OVP1", self._bits.over_voltage_bit),
            ("OCP1", self._bits.over_current_bit),
        ):
            self._line.send_command(command)
            if bit is not None:
                self._require_bit(command, bit)
        return self.limits.voltage_max_V, self.limits.current_max_A  # where they act at most

    def _switch(self, on: bool) -> None:
        self._line.send_command("OUT1" if on else "OUT0", urgent=not on)

    def _output(self, *, again: bool = True) -> bool:
        return _is_on(self._status(again=again))

    def _status(self, *, again: bool = True) -> int:
        return self._line.ask("STATUS?", STATUS, again=again)[0]

    def _ask(self, question: str, form: re.Pattern[bytes]) -> Decimal:
        return Decimal(self._line.ask(question, form, again=False).decode("ascii"))

    def _require_bit(self, command: str, bit: int) -> None:
        if not self._status() >> bit & 1:
            raise HardwareError(
                f"{self.name}: sent {command}, but bit {bit} of STATUS? does not show it"
            )

    def _written(self, value: Decimal, unit: str) -> str:
        return f"{value:05.2f}" if unit == "V" else f"{value:.3f}"


def _is_on(status: int) -> bool:
    return bool(status >> OUTPUT_BIT & 1)  # the one bit that all models agree on
