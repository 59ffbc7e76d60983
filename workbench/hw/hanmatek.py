"""Hanmatek HM30x supplies over Modbus; their registers are in `models/hanmatek.py`."""

from __future__ import annotations

from workbench.errors import HardwareError
from workbench.hw.modbus import DeviceId, ModbusSupply, Words
from workbench.hw.models import HANMATEK_REGISTERS, Protection
from workbench.hw.models.hanmatek import CLASS, DECIMALS
from workbench.hw.supply import NOT_REPORTED

__all__ = ["HanmatekSupply"]

SPEC, CLASS_AT, DECIMALS_AT = 0x0003, 0x0004, 0x0005
BITS: tuple[Protection, ...] = ("OVP", "OCP", "OPP", "OTP", "SCP")  # from bit 0 on


class HanmatekSupply(ModbusSupply):
    """One Hanmatek HM30x or twin; it reports neither serial number nor firmware.

    One whose decimals differ from the table is refused: its scales would be a guess. See
    `ModbusSupply`.
    """

    family = "hanmatek"
    registers = HANMATEK_REGISTERS

    def _decode_identity(self, words: Words) -> DeviceId:
        found = words[CLASS_AT], words[DECIMALS_AT]
        if found != (CLASS, DECIMALS):
            raise HardwareError(
                f"{self._link.connection.address}: class {found[0]} and decimals {found[1]:#06x} "
                f"are not those of a known Hanmatek, {CLASS} and {DECIMALS:#06x}; nothing was set"
            )
        return DeviceId(words[SPEC], NOT_REPORTED, NOT_REPORTED)

    def _protection(self, word: int) -> Protection | None:
        if word >> len(BITS):
            return None
        for bit, name in enumerate(BITS):
            if word >> bit & 1:
                return name
        return "none"
