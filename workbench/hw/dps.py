"""RuiDeng DPS and DPH modules over Modbus; their registers are in `models/dps.py`."""

from __future__ import annotations

from workbench.hw.modbus import DeviceId, ModbusSupply, Words
from workbench.hw.models import DPS_REGISTERS, Protection
from workbench.hw.supply import NOT_REPORTED

__all__ = ["DpsSupply"]

PROTECTIONS: dict[int, Protection] = {0: "none", 1: "OVP", 2: "OCP", 3: "OPP"}
MODEL, VERSION = 0x0B, 0x0C


class DpsSupply(ModbusSupply):
    """One DPS or DPH; it reports no serial number. See `ModbusSupply`."""

    family = "dps"
    registers = DPS_REGISTERS

    def _decode_identity(self, words: Words) -> DeviceId:
        return DeviceId(words[MODEL], NOT_REPORTED, str(words[VERSION]))

    def _protection(self, word: int) -> Protection | None:
        return PROTECTIONS.get(word)
