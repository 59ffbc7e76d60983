"""A simulated supply that keeps everything in Modbus registers, and the frames around them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from decimal import Decimal

from pymodbus.exceptions import ModbusException
from pymodbus.framer import FramerBase, FramerRTU, FramerSocket
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadHoldingRegistersResponse,
    WriteMultipleRegistersRequest,
    WriteMultipleRegistersResponse,
    WriteSingleRegisterRequest,
    WriteSingleRegisterResponse,
)

from workbench.hw.simulated.device import DeviceOutput, Framing, SimulatedSupply, SpoiltWire, Wire
from workbench.hw.simulated.faults import RequestError, SimulatedFault

__all__ = ["SimulatedRegisters"]

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
MOST_REGISTERS = 125  # of the norm
LONGEST_FRAME = 300


class SimulatedRegisters(SimulatedSupply):
    """A supply that is read and written by register; see `SimulatedSupply`."""

    most_registers = MOST_REGISTERS

    @abstractmethod
    def shown(self) -> dict[int, int]:
        """Return what its registers show, those that exist."""

    @abstractmethod
    def take(self, register: int, word: int) -> None:
        """Act on a word that was written.

        Raises:
            RequestError: with code 2 when the register cannot be written.
        """

    @abstractmethod
    def can_be_written(self, register: int) -> bool:
        """Return whether a register exists and can be written."""

    def read(self, address: int, count: int) -> list[int]:
        """Return registers as the device would answer them.

        Raises:
            RequestError: with code 2 when one of them does not exist.
        """
        with self.lock:
            self._refuse_when_faulty()
            if count > self.most_registers:
                raise RequestError(ILLEGAL_VALUE)
            self.update()
            shown = self.shown()
            words = [shown.get(register) for register in range(address, address + count)]
            if None in words:
                raise RequestError(ILLEGAL_ADDRESS)
            return [word for word in words if word is not None]

    def write(self, address: int, words: Sequence[int]) -> None:
        """Take words into registers and act on them.

        Raises:
            RequestError: with code 2 when one of them does not exist or cannot be written.
        """
        with self.lock:
            self._refuse_when_faulty()
            registers = range(address, address + len(words))
            if not all(self.can_be_written(register) for register in registers):
                raise RequestError(ILLEGAL_ADDRESS)
            if self.faults.strikes(SimulatedFault.IGNORED_WRITE):
                return
            for register, word in zip(registers, words, strict=True):
                self.take(register, word)
            self.update()

    def wire(self, framing: Framing) -> Wire:
        """Begin a conversation in Modbus frames."""
        return _Frames(self, framing)

    def counts(self, value: float, step: Decimal) -> int:
        """Return a value as a register holds it."""
        return min(round(max(value, 0.0) / float(step)), 0xFFFF)

    def _refuse_when_faulty(self) -> None:
        if self.faults.strikes(SimulatedFault.EXCEPTION):
            raise RequestError(self.faults.code)


class _Frames(SpoiltWire):
    """Frames of pymodbus around a device's registers, spoilt as the fault that is on says."""

    junk = b"\x00\xff\x55"

    def __init__(self, device: SimulatedRegisters, framing: Framing) -> None:
        super().__init__(device.faults)
        self._device = device
        self._rtu = framing == "rtu"
        decoder = DecodePDU(True)
        self._framer: FramerBase = FramerRTU(decoder) if self._rtu else FramerSocket(decoder)
        self._waiting = b""

    def receive(self, data: bytes) -> list[DeviceOutput]:
        """Carry out every complete request; a damaged one is not answered."""
        self._waiting = (self._waiting + data)[-LONGEST_FRAME:]
        answers: list[DeviceOutput] = []
        while self._waiting:
            try:
                used, request = self._framer.handleFrame(self._waiting, 0, 0)
            except ModbusException:  # a request that the norm does not know
                self._waiting = b""
                break
            self._waiting = self._waiting[used:]
            if request is None:
                break
            if request.dev_id == self._device.unit:
                answers += self._spoilt(self._framed(self._answered(request), request))
        return answers

    def _answered(self, request: ModbusPDU) -> ModbusPDU:
        address = request.address
        try:
            match request:
                case ReadHoldingRegistersRequest():
                    words = self._device.read(address, request.count)
                    return ReadHoldingRegistersResponse(registers=words)
                case WriteSingleRegisterRequest():
                    self._device.write(address, request.registers)
                    return WriteSingleRegisterResponse(address=address, registers=request.registers)
                case WriteMultipleRegistersRequest():
                    self._device.write(address, request.registers)
                    count = len(request.registers)
                    return WriteMultipleRegistersResponse(address=address, count=count)
                case _:
                    raise RequestError(ILLEGAL_FUNCTION)
        except RequestError as error:
            return ExceptionResponse(request.function_code, error.code)

    def _framed(self, answer: ModbusPDU, request: ModbusPDU) -> bytes:
        other = self._device.faults.strikes(SimulatedFault.WRONG_UNIT)
        answer.dev_id = request.dev_id + int(other)
        answer.transaction_id = request.transaction_id
        return self._framer.buildFrame(answer)

    def _damaged(self, data: bytes) -> bytes:
        at = len(data) - 1 if self._rtu else 2  # CRC, or MBAP protocol id
        return data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :]

    def _shortened(self, data: bytes) -> bytes:
        return data[:-3]
