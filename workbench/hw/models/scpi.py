"""Supplies that speak SCPI: identities, limits, and what each maker says in its own way.

Commands and limits: libsigrok scpi-pps and the instruments survey 1.6. Over-voltage protection
alone has four shapes, so each row names its maker's dialect. The first channel is used.
"""

from __future__ import annotations

from decimal import Decimal

from workbench.hw.models.model import STAYS_ON, Dialect, ScpiModel

__all__ = ["SCPI"]

MILLI, CENTI = Decimal("0.001"), Decimal("0.01")

KEYSIGHT = Dialect(
    start=("SYST:REM", "INST:NSEL 1"),
    on=("OUTP ON",),
    off=("OUTP OFF",),
    over_voltage="VOLT:PROT {}",
    over_voltage_ask="VOLT:PROT?",
    enable=(("CURR:PROT:STAT ON", "CURR:PROT:STAT?"),),
    tripped=(("OVP", "VOLT:PROT:TRIP?"), ("OCP", "CURR:PROT:TRIP?")),
)

# One output, and a watchdog that any SCPI traffic feeds: armed only while the output is on, as it
# would trip while nobody asks.
KEYSIGHT_WATCHDOG = Dialect(
    start=("SYST:REM",),
    on=("OUTP:PROT:WDOG:DEL 1", "OUTP:PROT:WDOG ON", "OUTP ON"),
    off=("OUTP OFF", "OUTP:PROT:WDOG OFF"),
    over_voltage="VOLT:PROT {}",
    over_voltage_ask="VOLT:PROT?",
    enable=(("CURR:PROT:STAT ON", "CURR:PROT:STAT?"),),
)

RIGOL = Dialect(
    start=("SYST:REMOTE", "INST:NSEL 1"),
    on=("OUTP CH1,ON",),
    off=("OUTP CH1,OFF",),
    over_voltage="OUTP:OVP:VAL CH1,{}",
    over_voltage_ask="OUTP:OVP:VAL? CH1",
    over_current="OUTP:OCP:VAL CH1,{}",
    over_current_ask="OUTP:OCP:VAL? CH1",
    enable=(("OUTP:OVP CH1,ON", "OUTP:OVP? CH1"), ("OUTP:OCP CH1,ON", "OUTP:OCP? CH1")),
    tripped=(("OVP", "OUTP:OVP:QUES? CH1"), ("OCP", "OUTP:OCP:QUES? CH1")),
)

RIGOL_ONE_CHANNEL = Dialect(
    start=("SYST:REMOTE",),
    on=("OUTP ON",),
    off=("OUTP OFF",),
    over_voltage="OUTP:OVP:VAL {}",
    over_voltage_ask="OUTP:OVP:VAL?",
    over_current="OUTP:OCP:VAL {}",
    over_current_ask="OUTP:OCP:VAL?",
    enable=(("OUTP:OVP ON", "OUTP:OVP?"), ("OUTP:OCP ON", "OUTP:OCP?")),
    tripped=(("OVP", "OUTP:OVP:QUES?"), ("OCP", "OUTP:OCP:QUES?")),
)

ROHDE_HMC = Dialect(
    start=("SYST:REM", "INST:NSEL 1"),
    on=("OUTP ON",),
    off=("OUTP OFF",),
    over_voltage="VOLT:PROT:LEV {}",
    over_voltage_ask="VOLT:PROT:LEV?",
    enable=(("VOLT:PROT:STAT ON", "VOLT:PROT:STAT?"), ("FUSE:STAT ON", "FUSE:STAT?")),
    tripped=(("OVP", "VOLT:PROT:TRIP?"), ("OCP", "FUSE:TRIP?")),
)

ROHDE_HMP = Dialect(  # its over-voltage protection is always armed
    start=("SYST:REM", "INST:NSEL 1"),
    on=("OUTP ON",),
    off=("OUTP OFF",),
    over_voltage="VOLT:PROT:LEV {}",
    over_voltage_ask="VOLT:PROT:LEV?",
    enable=(("FUSE:STAT ON", "FUSE:STAT?"),),
    tripped=(("OVP", "VOLT:PROT:TRIP?"), ("OCP", "FUSE:TRIP?")),
)

OWON = Dialect(
    start=("SYST:REM",),
    on=("OUTP 1",),
    off=("OUTP 0",),
    over_voltage="VOLT:LIM {}",
    over_voltage_ask="VOLT:LIM?",
    over_current="CURR:LIM {}",
    over_current_ask="CURR:LIM?",
)

OWON_P4 = Dialect(  # SYST:REM is no command of its firmware
    start=(),
    on=OWON.on,
    off=OWON.off,
    over_voltage=OWON.over_voltage,
    over_voltage_ask=OWON.over_voltage_ask,
    over_current=OWON.over_current,
    over_current_ask=OWON.over_current_ask,
)

AT_LIMIT = "over-current protection trips at the current limit, it has no level of its own"
CLEARS = "OUTP:PROT:CLE would restore the output's former state: it is never sent"
SILENT = "it does not tell which protection tripped: its output is found off"
WATCHDOG = "watchdog: output off after 1 s without a command, armed while the output is on"


def _row(
    name: str,
    maker: str,
    dialect: Dialect,
    volts: str,
    amps: str,
    *,
    step: Decimal = MILLI,
    amp_step: Decimal = MILLI,
    baud: int = 9600,
    quirks: tuple[str, ...] = (),
    on_lost_link: str = STAYS_ON,
    source: str = "libsigrok scpi-pps",
) -> ScpiModel:
    return ScpiModel(
        name=name,
        family="scpi",
        pattern=rf"(?:{maker}) *, *{name} *, *(?P<serial>[^,]*?) *, *(?P<firmware>.*?) *",
        voltage_max_V=Decimal(volts),
        current_max_A=Decimal(amps),
        voltage_step_V=step,
        current_steps_A=(amp_step,),
        dialect=dialect,
        baud=baud,
        quirks=quirks,
        on_lost_link=on_lost_link,
        source=source,
    )


def _keysight(name: str, volts: str, amps: str) -> ScpiModel:
    maker = "(?i:keysight|agilent)[^,]*"
    return _row(name, maker, KEYSIGHT, volts, amps, quirks=(AT_LIMIT, CLEARS))


def _rigol(name: str, dialect: Dialect, volts: str, amps: str, step: Decimal) -> ScpiModel:
    maker = "(?i:rigol)[^,]*"
    return _row(name, maker, dialect, volts, amps, step=step, amp_step=step)


def _rohde(name: str, dialect: Dialect, amps: str) -> ScpiModel:
    maker = "(?i:rohde ?& ?schwarz|hameg)"
    return _row(name, maker, dialect, "32.05", amps, quirks=(AT_LIMIT,))


def _owon(
    name: str, dialect: Dialect, volts: str, amps: str, step: Decimal, maker: str = "OWON"
) -> ScpiModel:
    given = f"(?i:{maker})"
    return _row(name, given, dialect, volts, amps, step=step, baud=115200, quirks=(SILENT,))


SCPI = (
    _keysight("E36311A", "6", "5"),
    _keysight("E36312A", "6", "5"),
    _keysight("E36313A", "6", "10"),
    _row(
        "N6951A",
        "(?i:keysight|agilent)[^,]*",
        KEYSIGHT_WATCHDOG,
        "20",
        "50",
        quirks=(AT_LIMIT, CLEARS, "after its watchdog tripped OUTP? may still answer 1"),
        on_lost_link=WATCHDOG,
        source="Keysight AgN6K7K driver, N6900 programming guide",
    ),
    _rigol("DP711", RIGOL_ONE_CHANNEL, "30", "5", CENTI),
    _rigol("DP712", RIGOL_ONE_CHANNEL, "50", "3", CENTI),
    _rigol("DP832", RIGOL, "30", "3", MILLI),
    _rigol("DP832A", RIGOL, "30", "3", MILLI),
    _rohde("HMC8041", ROHDE_HMC, "10"),
    _rohde("HMC8042", ROHDE_HMC, "5"),
    _rohde("HMC8043", ROHDE_HMC, "3"),
    _rohde("HMP2020", ROHDE_HMP, "10"),
    _rohde("HMP2030", ROHDE_HMP, "5"),
    _rohde("HMP4040", ROHDE_HMP, "10"),
    _owon("P4305", OWON_P4, "30", "5", MILLI),
    _owon("P4603", OWON_P4, "60", "3", MILLI),
    _owon("SPE3102", OWON, "30", "10", CENTI),
    _owon("SPE3103", OWON, "30", "10", CENTI),
    _owon("SPE6102", OWON, "60", "10", CENTI),
    _owon("SPE6103", OWON, "60", "10", CENTI),
    _owon("DC310S", OWON, "30", "10", CENTI, maker="KIPRIM"),
)
