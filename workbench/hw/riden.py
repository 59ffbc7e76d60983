"""Riden RD60xx bench supplies over Modbus; their registers are in `models/riden.py`."""

from __future__ import annotations

from workbench.hw.modbus import DeviceId, ModbusSupply, Words
from workbench.hw.models import RIDEN_REGISTERS, Protection

__all__ = ["RidenSupply"]

PROTECTIONS: dict[int, Protection] = {0: "none", 1: "OVP", 2: "OCP"}


class RidenSupply(ModbusSupply):
    """One Riden RD60xx; see `ModbusSupply`."""

    family = "riden"
    registers = RIDEN_REGISTERS

    def _decode_identity(self, words: Words) -> DeviceId:
        return DeviceId(words[0], f"{(words[1] << 16) | words[2]:08d}", f"{words[3] / 100:.2f}")

    def _protection(self, word: int) -> Protection | None:
        return PROTECTIONS.get(word)
