"""What simulated supplies that speak text share: commands in, answers out, and how they spoil."""

from __future__ import annotations

from abc import abstractmethod

from workbench.hw.simulated.device import Answer, Framing, SimulatedSupply, Wire
from workbench.hw.simulated.faults import Fault

__all__ = ["SimulatedText"]

JUNK = b"\x7f?#"
ERROR = b"ERR"
SPOILT = 0x80


class SimulatedText(SimulatedSupply):
    """A supply that is told and asked in words; see `SimulatedSupply`."""

    terminator = b""

    @abstractmethod
    def commands(self, waiting: bytes) -> tuple[list[str], bytes]:
        """Return the commands in what has come, and what is left."""

    @abstractmethod
    def obey(self, command: str) -> bytes | None:
        """Carry out a command; return its answer without terminator, if it has one."""

    def wire(self, framing: Framing) -> Wire:
        """Begin a conversation; the framing does not matter."""
        return _Words(self)


class _Words(Wire):
    def __init__(self, device: SimulatedText) -> None:
        self._device = device
        self._waiting = b""
        self._last = b""

    def receive(self, data: bytes) -> list[Answer]:
        """Carry out all commands that are complete."""
        commands, self._waiting = self._device.commands(self._waiting + data)
        answers: list[Answer] = []
        for command in commands:
            with self._device.lock:
                self._device.update()
                answer = self._carried_out(command)
            if answer is not None:
                answers += self._spoilt(answer + self._device.terminator)
        return answers

    def _carried_out(self, command: str) -> bytes | None:
        faults, asks = self._device.faults, "?" in command
        if asks and faults.strikes(Fault.EXCEPTION):
            return ERROR
        if not asks and faults.strikes(Fault.IGNORED_WRITE):
            return None
        return self._device.obey(command)

    def _spoilt(self, data: bytes) -> list[Answer]:
        faults, last = self._device.faults, self._last
        self._last = data
        if faults.strikes(Fault.SILENT):
            return []
        if faults.strikes(Fault.LATE_REPLY):
            return [Answer(faults.delay_s, data)]
        if faults.strikes(Fault.BAD_CRC):
            at = (len(data) - len(self._device.terminator)) // 2
            return [Answer(0, data[:at] + bytes([data[at] ^ SPOILT]) + data[at + 1 :])]
        if faults.strikes(Fault.SHORT_REPLY):
            return [Answer(0, data[: len(data) // 2])]
        if faults.strikes(Fault.JUNK):
            return [Answer(0, JUNK + data)]
        if last and faults.strikes(Fault.REPEATED_REPLY):
            return [Answer(0, last), Answer(0, data)]
        return [Answer(0, data)]
