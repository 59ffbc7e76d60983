"""RuiDeng DPS and DPH: ids, scales and registers (instruments survey 1.3)."""

from __future__ import annotations

from decimal import Decimal

from workbench.hw.models.model import Block, ModbusModel, Registers

__all__ = ["DPS", "DPS_REGISTERS"]

CENTI, MILLI = Decimal("0.01"), Decimal("0.001")

DPS_REGISTERS = Registers(
    identity=Block(0x0B, 2),  # model, version
    status=(Block(0x00, 10, spare=3),),  # up to 0x09, the output; registers end at 0x0C
    voltage_set=0x00,
    current_set=0x01,
    voltage=0x02,
    current=0x03,
    output=0x09,
    protection=0x07,
    mode=0x08,
    input_voltage=0x05,
    current_range=None,
    trips=Block(0x50, 4),  # V, I, OVP, OCP of preset 0, the live one
    over_voltage=0x52,
    over_current=0x53,
    power_on=Block(0x50, 8),
    power_on_output=0x57,
)

FLAG = "firmware OpenDPS once said off while it drove: off is confirmed by the measured voltage too"
SLOW = "answers sometimes take seconds; over Bluetooth they come in pieces"


def _row(name: str, model_id: int, volts: int, amps: int, amp_step: Decimal) -> ModbusModel:
    return ModbusModel(
        name=name,
        family="dps",
        ids=(model_id,),
        voltage_max_V=Decimal(volts),
        current_max_A=Decimal(amps),
        voltage_step_V=CENTI,
        current_steps_A=(amp_step,),
        registers=DPS_REGISTERS,
        quirks=(FLAG, SLOW),
        source="libsigrok rdtech-dps, TheHWcave/DPS5005-control, DPH5005 manual",
    )


DPS = (
    _row("DPS3005", 3005, 30, 5, MILLI),
    _row("DPS5005", 5005, 50, 5, MILLI),
    _row("DPH5005", 5205, 50, 5, MILLI),
    _row("DPS5015", 5015, 50, 15, CENTI),
    _row("DPS5020", 5020, 50, 20, CENTI),
    _row("DPS8005", 8005, 80, 5, MILLI),
)
