"""Riden RD60xx: ids, scales and registers.

An id is here when a maintained client or a tool that was run on the supply names it, one by one:

- 60061, 60062: libsigrok rdtech-dps; 60062 also rfinnie/rdserialtool, wildekek/rdtech-esphome and
  tjko/riden-flashtool;
- 60065, 60121, 60181: libsigrok, rdtech-esphome, riden-flashtool;
- 60066: riden-flashtool (tested with an RK6006-BT) and tshaddack/rd60 (tested, 10 mV and 1 mA);
- 60125, 60241: libsigrok, riden-flashtool;
- 60301: riden-flashtool, morgendagen/riden-dongle (issue 43: right on an RD6030).

The ranges of ShayBox/Riden and riden-dongle (60120-60124, 60180-60189, 60241 and up) name no id: an
RK6012 that answers 60122 counts its current ten times finer than the RD6012 of that range, and no
source that could be read states the id of the RD6018P, which counts in other steps than an RD6018.

Scales and addresses: Baldanos/rd6006, ShayBox/Riden, riden-dongle and libsigrok rdtech-dps agree on
those used here (instruments survey 1.2). PyPI rd60xx 0.1.0 lists 1 mV for the plain models: it is
wrong.
"""

from __future__ import annotations

from decimal import Decimal

from workbench.hw.models.model import Block, ModbusModel, Registers

__all__ = ["RIDEN", "RIDEN_REGISTERS"]

CENTI, MILLI, TENTH_MILLI = Decimal("0.01"), Decimal("0.001"), Decimal("0.0001")

RIDEN_REGISTERS = Registers(
    identity=Block(0, 4),  # model id, serial high, serial low, firmware x100
    status=(Block(8, 13, spare=3),),  # up to register 20, the current range; a bridge passes 16
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
LONG_READ = "a read of more than 20 registers fails silently, behind some bridges one of 17"
RANGE = "register 20 changes the current's scale: it is read with every reading"


def _row(
    name: str,
    ids: tuple[int, ...],
    amps: int,
    volt_step: Decimal,
    *amp_steps: Decimal,
    source: str = SOURCE,
) -> ModbusModel:
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
        source=source,
    )


RIDEN = (
    _row("RD6006", (60061, 60062), 6, CENTI, MILLI),
    _row("RD6006P", (60065,), 6, MILLI, TENTH_MILLI),
    _row("RK6006", (60066,), 6, CENTI, MILLI, source="tshaddack/rd60, riden-flashtool"),
    _row("RD6012", (60121,), 12, CENTI, CENTI),
    _row("RD6012P", (60125,), 12, MILLI, TENTH_MILLI, MILLI),  # ranges 6 A, 12 A
    _row("RD6018", (60181,), 18, CENTI, CENTI),
    _row("RD6024", (60241,), 24, CENTI, CENTI),
    _row("RD6030", (60301,), 30, CENTI, CENTI, source="riden-dongle, riden-flashtool"),
)
