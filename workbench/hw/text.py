"""What all supplies that speak text share: settings that are asked back, and a reading's end.

A reading is a row of questions whose answers are taken together or not at all: an answer too many
anywhere in the row comes where another form is awaited, as the supply answers in order.
"""

from __future__ import annotations

import re
from abc import abstractmethod
from decimal import Decimal

from workbench.errors import HardwareError
from workbench.hw.clock import Clock
from workbench.hw.connection import Connection
from workbench.hw.line import WHO, Line
from workbench.hw.models import Model, rounded
from workbench.hw.setting import read_back, refuse_beyond, reopen
from workbench.hw.supply import Identity, Reading, Supply

__all__ = ["TextSupply", "introduced"]


def introduced(line: Line) -> str:
    """Ask who is there for the first time.

    Raises:
        HardwareError: when nothing answers; it says what that may mean.
    """
    try:
        return line.identify()
    except HardwareError as error:
        if not line.connected:
            raise
        end = "" if str(error).endswith("?") else "."
        raise HardwareError(
            f"{error}{end} It may also be a model that is not known here, as some never answer "
            f"{WHO}; or its family is another one: SCPI ends its lines, Korad does not"
        ) from error


class TextSupply(Supply):
    """A supply with queries and commands in words.

    Args:
        line: an open line to it, whose identity was asked for.
        clock: see `Supply`.
        model: its row of the table.
        identity: who it is.
    """

    def __init__(self, line: Line, clock: Clock, model: Model, identity: Identity) -> None:
        self._line, self._model, self._identity = line, model, identity
        super().__init__(f"{model.name} at {line.connection.address}", clock)

    @abstractmethod
    def _reading(self) -> Reading:
        """Ask for everything once, each question once."""

    @abstractmethod
    def _output(self, *, again: bool = True) -> bool:
        """Ask whether the output is on."""

    @abstractmethod
    def _switch(self, on: bool) -> None:
        """Send the command for output on or off."""

    def identify(self) -> Identity:
        """See that the same supply still answers.

        Raises:
            HardwareError: when it does not, or another one does.
        """
        self._line.ask_who()
        return self._identity

    def measure(self) -> Reading:
        """Ask for state, measured values and setpoints; once more when an answer was no good.

        Raises:
            HardwareError: when there are no good answers.
        """
        try:
            with self._line.in_order():
                return self._reading()
        except HardwareError:
            if not self._line.connected:
                raise
        with self._line.in_order():
            return self._reading()

    def measure_power_on_output(self) -> None:
        """Return nothing: there is no way to ask for it."""

    @property
    def connected(self) -> bool:
        """Whether its link is open, as far as is known."""
        return self._line.connected

    def reach(self, connection: Connection) -> None:
        """Look for it at another place. Raises as `Supply.reach`."""
        reopen(self._line, self.identify, connection)

    def close(self) -> None:
        """Close the line."""
        self._line.close()

    def _apply_output(self, on: bool) -> None:
        if not on:
            reopen(self._line, self.identify)
        self._switch(on)
        with self._line.in_order():  # the flag counts only as that of this very supply
            found = read_back(lambda: self._output(again=on), on, self.clock)
            self._require_same(again=on)
        if found != on:
            raise HardwareError(
                f"{self.name}: output asked {'on' if on else 'off'}, it says that it is "
                f"{'on' if found else 'off'}"
            )

    def _require_same(self, *, again: bool) -> None:
        """See that the same supply answers, and that nothing else is under way."""
        try:
            self._line.ask_who()
        except HardwareError:
            if not (again and self._line.connected):
                raise
            self._line.ask_who()

    def _set(
        self, command: str, question: str, form: re.Pattern[bytes], value: Decimal, unit: str
    ) -> Decimal:
        """Send a value as its nearest step and return what the supply then holds.

        Args:
            command: with `{}` for the number.
            question: asks for it.
            form: of the answer.
            value: V or A.
            unit: which of them.

        Raises:
            InputError: when it is beyond the model.
            HardwareError: when the supply does not hold it.
        """
        volts = unit == "V"
        highest = self._model.voltage_max_V if volts else self._model.current_max_A
        refuse_beyond(self.name, value, highest, unit)
        step = self._model.voltage_step_V if volts else self._model.current_steps_A[0]
        sent = rounded(value, step)
        self._line.send_command(command.format(self._written(sent, unit)))

        def ask() -> Decimal:
            return Decimal(self._line.ask(question, form).decode("ascii"))

        found = read_back(ask, sent, self.clock)
        if found != sent:
            raise HardwareError(
                f"{self.name}: asked {value} {unit}, sent {sent} {unit} with "
                f"{command.format('')!r}, it holds {found} {unit}{self._complaint()}"
            )
        return sent

    def _written(self, value: Decimal, unit: str) -> str:
        """Return a number as it is sent."""
        return str(value)

    def _complaint(self) -> str:
        """Return what the supply itself says is wrong, as the tail of a message."""
        return ""
