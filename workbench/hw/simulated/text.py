"""What simulated supplies that speak text share: commands in, answers out, and how they spoil."""

from __future__ import annotations

from abc import abstractmethod

from workbench.hw.simulated.device import DeviceOutput, Framing, SimulatedSupply, SpoiltWire, Wire
from workbench.hw.simulated.faults import SimulatedFault

__all__ = ["SimulatedText"]

ERROR = b"ERR"
SPOILT = 0x80


class SimulatedText(SimulatedSupply):
    """A supply with commands and queries in words; see `SimulatedSupply`."""

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


class _Words(SpoiltWire):
    junk = b"\x7f?#"

    def __init__(self, device: SimulatedText) -> None:
        super().__init__(device.faults)
        self._device = device
        self._waiting = b""

    def receive(self, data: bytes) -> list[DeviceOutput]:
        """Carry out all commands that are complete."""
        commands, self._waiting = self._device.commands(self._waiting + data)
        answers: list[DeviceOutput] = []
        for command in commands:
            with self._device.lock:
                self._device.update()
                answer = self._carried_out(command)
            if answer is not None:
                answers += self._spoilt(answer + self._device.terminator)
        return answers

    def _carried_out(self, command: str) -> bytes | None:
        faults, asks = self._device.faults, "?" in command
        if asks and faults.strikes(SimulatedFault.EXCEPTION):
            return ERROR
        if not asks and faults.strikes(SimulatedFault.IGNORED_WRITE):
            return None
        return self._device.obey(command)

    def _damaged(self, data: bytes) -> bytes:
        at = (len(data) - len(self._device.terminator)) // 2
        return data[:at] + bytes([data[at] ^ SPOILT]) + data[at + 1 :]

    def _shortened(self, data: bytes) -> bytes:
        return data[: len(data) // 2]
