"""Riden RD60xx: ids, scales and registers.

Ids, scales and addresses: Baldanos/rd6006, ShayBox/Riden, riden-dongle and libsigrok rdtech-dps
agree on those used here (instruments survey 1.2). PyPI rd60xx 0.1.0 lists 1 mV for the plain
models: it is wrong. The survey gives RD6024 as "60241 and up"; the last digit is the variant, so
up to 60249.
"""

from __future__ import annotations

from decimal import Decimal

from workbench.hw.models.model import Block, ModbusModel, Registers

__all__ = ["RIDEN", "RIDEN_REGISTERS"]

CENTI, MILLI, TENTH_MILLI = Decimal("0.01"), Decimal("0.001"), Decimal("0.0001")

RIDEN_REGISTERS = Registers(
    identity=Block(0, 4),  # model id, serial high, serial low, firmware x100
    status=(Block(8, 13, spare=7),),  # up to register 20, the current range; 20 a read at most
    voltage_set=8,
    current_set=9,
    voltage=10,
    current=11,
    output=18,
    protection=16,
    mode=17,
    input_voltage=14,
    current_range=20,
    trips=Block(82, 2),  # of M0, the live preset
    over_voltage=82,
    over_current=83,
    power_on=Block(68, 1),
    power_on_output=68,
)

SOURCE = "Baldanos/rd6006, ShayBox/Riden, riden-dongle, libsigrok rdtech-dps"
LONG_READ = "a read of more than 20 registers fails silently"
RANGE = "register 20 changes the current's scale: it is read with every reading"


def _row(name: str, ids: range, amps: int, volt_step: Decimal, *amp_steps: Decimal) -> ModbusModel:
    return ModbusModel(
        name=name,
        family="riden",
        ids=ids,
        voltage_max_V=Decimal(60),
        current_max_A=Decimal(amps),
        voltage_step_V=volt_step,
        current_steps_A=amp_steps,
        registers=RIDEN_REGISTERS,
        baud=115200,
        quirks=(LONG_READ, RANGE) if len(amp_steps) > 1 else (LONG_READ,),
        source=SOURCE,
    )


RIDEN = (
    _row("RD6006", range(60060, 60065), 6, CENTI, MILLI),
    _row("RD6006P", range(60065, 60066), 6, MILLI, TENTH_MILLI),
    _row("RD6012", range(60120, 60125), 12, CENTI, CENTI),
    _row("RD6012P", range(60125, 60130), 12, MILLI, TENTH_MILLI, MILLI),  # ranges 6 A, 12 A
    _row("RD6018", range(60180, 60190), 18, CENTI, CENTI),
    _row("RD6024", range(60241, 60250), 24, CENTI, CENTI),
    _row("RD6030", range(60301, 60302), 30, CENTI, CENTI),
)
