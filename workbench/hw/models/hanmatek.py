"""Hanmatek HM30x and its twins under other names: ids, scales, registers (survey 1.4)."""

from __future__ import annotations

from decimal import Decimal

from workbench.hw.models.model import Block, ModbusModel, Registers

__all__ = ["CLASS", "DECIMALS", "HANMATEK", "HANMATEK_REGISTERS"]

CLASS, DECIMALS = 19280, 0x0233  # "KP"; V with 2 decimals, A and W with 3

# The blocks of a reading and the identity have lengths of their own, so that no late or repeated
# answer fits where another is awaited.
HANMATEK_REGISTERS = Registers(
    identity=Block(0x0003, 3),  # spec, class, decimals
    status=(
        Block(0x0001, 5),  # output, protection, and who it is
        Block(0x0010, 4),  # V, A, W high and low
        Block(0x0030, 2),  # V set, A set
    ),
    voltage_set=0x0030,
    current_set=0x0031,
    voltage=0x0010,
    current=0x0011,
    output=0x0001,
    protection=0x0002,
    mode=None,
    input_voltage=None,
    current_range=None,
    trips=Block(0x0020, 4),  # OVP, OCP, OPP high and low
    over_voltage=0x0020,
    over_current=0x0021,
    power_on=Block(0x8801, 1),
    power_on_output=0x8801,
)

QUIRKS = (
    "whether it limits the current cannot be read reliably: it is found from the measured values",
    "the bits of the protection register are not confirmed on hardware: any bit ends a run",
    "sources disagree on the scale of its power trip level: it is never written",
)


def _row(name: str, spec: int, amps: int, *also: str) -> ModbusModel:
    return ModbusModel(
        name=name,
        also=also,
        family="hanmatek",
        ids=(spec,),
        voltage_max_V=Decimal(30),
        current_max_A=Decimal(amps),
        voltage_step_V=Decimal("0.01"),
        current_steps_A=(Decimal("0.001"),),
        registers=HANMATEK_REGISTERS,
        quirks=QUIRKS,
        source="hm310t, hanmatek-psu, tomtastic/hm305_ctrl",
    )


HANMATEK = (
    _row("HM305P", 305, 5, "eTM-305P", "RS305P"),
    _row("HM310P", 3010, 10, "HM310T", "eTM-3010P"),
)
