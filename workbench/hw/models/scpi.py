"""Supplies that speak SCPI: identities, limits, and what each maker says in its own way.

Commands and limits: libsigrok scpi-pps and the instruments survey 1.6. Over-voltage protection
alone has four shapes, so each row names its maker's dialect. Where a supply has several channels
every command reaches the one that the bench file names, whatever somebody selects meanwhile: by
the channel lists of the Keysight E36300 programming guide, by `SOURce<n>:` and `CH<n>` of the Rigol
DP800 programming guide, by `CH<n>:` of the Siglent SPD3303X quick start; R&S and Hameg know the
selected channel only, so it is selected with every command. Limits of channels 2 and up: libsigrok
scpi-pps. Channel 3 of an E36311A is negative and that of an SPD3303X fixed: they are left out.
Siglent: its quick start, PyMeasure `siglent_spdbase.py`, labgrid `power/siglent.py`.
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal

from workbench.hw.models.model import STAYS_ON, Dialect, Rating, ScpiModel

__all__ = ["SCPI"]

MILLI, CENTI = Decimal("0.001"), Decimal("0.01")

KEYSIGHT = Dialect(
    start=("SYST:REM",),
    on=("OUTP ON,(@{channel})",),
    off=("OUTP OFF,(@{channel})",),
    voltage="VOLT {},(@{channel})",
    voltage_ask="VOLT? (@{channel})",
    current="CURR {},(@{channel})",
    current_ask="CURR? (@{channel})",
    measured_voltage="MEAS:VOLT? (@{channel})",
    measured_current="MEAS:CURR? (@{channel})",
    output_ask="OUTP? (@{channel})",
    over_voltage="VOLT:PROT {},(@{channel})",
    over_voltage_ask="VOLT:PROT? (@{channel})",
    enable=(("CURR:PROT:STAT ON,(@{channel})", "CURR:PROT:STAT? (@{channel})"),),
    tripped=(("OVP", "VOLT:PROT:TRIP? (@{channel})"), ("OCP", "CURR:PROT:TRIP? (@{channel})")),
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
    start=("SYST:REMOTE",),
    on=("OUTP CH{channel},ON",),
    off=("OUTP CH{channel},OFF",),
    voltage="SOUR{channel}:VOLT {}",
    voltage_ask="SOUR{channel}:VOLT?",
    current="SOUR{channel}:CURR {}",
    current_ask="SOUR{channel}:CURR?",
    measured_voltage="MEAS:VOLT? CH{channel}",
    measured_current="MEAS:CURR? CH{channel}",
    output_ask="OUTP? CH{channel}",
    over_voltage="OUTP:OVP:VAL CH{channel},{}",
    over_voltage_ask="OUTP:OVP:VAL? CH{channel}",
    over_current="OUTP:OCP:VAL CH{channel},{}",
    over_current_ask="OUTP:OCP:VAL? CH{channel}",
    enable=(
        ("OUTP:OVP CH{channel},ON", "OUTP:OVP? CH{channel}"),
        ("OUTP:OCP CH{channel},ON", "OUTP:OCP? CH{channel}"),
    ),
    tripped=(("OVP", "OUTP:OVP:QUES? CH{channel}"), ("OCP", "OUTP:OCP:QUES? CH{channel}")),
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
    start=("SYST:REM",),
    on=("OUTP ON",),
    off=("OUTP OFF",),
    select="INST:NSEL {channel}",
    over_voltage="VOLT:PROT:LEV {}",
    over_voltage_ask="VOLT:PROT:LEV?",
    enable=(("VOLT:PROT:STAT ON", "VOLT:PROT:STAT?"), ("FUSE:STAT ON", "FUSE:STAT?")),
    tripped=(("OVP", "VOLT:PROT:TRIP?"), ("OCP", "FUSE:TRIP?")),
)

ROHDE_HMP = Dialect(  # its over-voltage protection is always armed
    start=("SYST:REM",),
    on=("OUTP ON",),
    off=("OUTP OFF",),
    select="INST:NSEL {channel}",
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

OWON_P4 = replace(OWON, start=())  # SYST:REM is no command of its firmware

SIGLENT = Dialect(
    start=(),
    on=("OUTP CH{channel},ON",),
    off=("OUTP CH{channel},OFF",),
    voltage="CH{channel}:VOLT {}",
    voltage_ask="CH{channel}:VOLT?",
    current="CH{channel}:CURR {}",
    current_ask="CH{channel}:CURR?",
    measured_voltage="MEAS:VOLT? CH{channel}",
    measured_current="MEAS:CURR? CH{channel}",
    output_ask="SYST:STAT?",  # there is no OUTP?
    output_bits=(4, 5),
)
SIGLENT_TRIPLE = replace(SIGLENT, apart=(0b1100, 0b0100))  # in series its voltage would double

AT_LIMIT = "over-current protection trips at the current limit, it has no level of its own"
CLEARS = "OUTP:PROT:CLE would restore the output's former state: it is never sent"
NO_REPORT = "it does not report which protection tripped: its output is found off"
NO_TRIPS = (
    "it has neither over-voltage nor over-current protection that can be set: only its current "
    "limit and this program watch"
)
SELECTED = "its commands name no channel: it is selected with every one, in one message"
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
    more: tuple[tuple[str, str], ...] = (),
    baud: int = 9600,
    gap_s: float = 0.02,
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
        more=tuple(Rating(Decimal(rating[0]), Decimal(rating[1])) for rating in more),
        gap_s=gap_s,
        baud=baud,
        quirks=quirks,
        on_lost_link=on_lost_link,
        source=source,
    )


def _keysight(name: str, amps: str, *more: tuple[str, str]) -> ScpiModel:
    maker = "(?i:keysight|agilent)[^,]*"
    source = "libsigrok scpi-pps, E36300 programming guide"
    quirks = (AT_LIMIT, CLEARS)
    return _row(name, maker, KEYSIGHT, "6", amps, more=more, quirks=quirks, source=source)


def _rigol(
    name: str, dialect: Dialect, volts: str, amps: str, step: Decimal, *more: tuple[str, str]
) -> ScpiModel:
    maker = "(?i:rigol)[^,]*"
    source = "libsigrok scpi-pps" + (", DP800 programming guide" if more else "")
    return _row(
        name, maker, dialect, volts, amps, step=step, amp_step=step, more=more, source=source
    )


def _rohde(name: str, dialect: Dialect, *amps: str) -> ScpiModel:
    maker, volts = "(?i:rohde ?& ?schwarz|hameg)", "32.05"
    more = tuple((volts, current) for current in amps[1:])
    quirks = (AT_LIMIT, SELECTED) if more else (AT_LIMIT,)
    return _row(name, maker, dialect, volts, amps[0], more=more, quirks=quirks)


def _owon(
    name: str, dialect: Dialect, volts: str, amps: str, step: Decimal, maker: str = "OWON"
) -> ScpiModel:
    given = f"(?i:{maker})"
    return _row(name, given, dialect, volts, amps, step=step, baud=115200, quirks=(NO_REPORT,))


def _siglent(
    name: str, volts: str, amps: str, step: Decimal = MILLI, channels: int = 1
) -> ScpiModel:
    return _row(
        name,
        "(?i:siglent)[^,]*",
        SIGLENT if channels == 1 else SIGLENT_TRIPLE,
        volts,
        amps,
        step=step,
        amp_step=step,
        more=((volts, amps),) * (channels - 1),
        gap_s=0.05,
        quirks=(NO_TRIPS,),
        source="SPD3303X quick start, PyMeasure, labgrid",
    )


SCPI = (
    _keysight("E36311A", "5", ("25", "1")),
    _keysight("E36312A", "5", ("25", "1"), ("25", "1")),
    _keysight("E36313A", "10", ("25", "2"), ("25", "2")),
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
    _rigol("DP832", RIGOL, "30", "3", MILLI, ("30", "3"), ("5", "3")),
    _rigol("DP832A", RIGOL, "30", "3", MILLI, ("30", "3"), ("5", "3")),
    _rohde("HMC8041", ROHDE_HMC, "10"),
    _rohde("HMC8042", ROHDE_HMC, "5", "5"),
    _rohde("HMC8043", ROHDE_HMC, "3", "3", "3"),
    _rohde("HMP2020", ROHDE_HMP, "10", "5"),
    _rohde("HMP2030", ROHDE_HMP, "5", "5", "5"),
    _rohde("HMP4040", ROHDE_HMP, "10", "10", "10", "10"),
    _owon("P4305", OWON_P4, "30", "5", MILLI),
    _owon("P4603", OWON_P4, "60", "3", MILLI),
    _owon("SPE3102", OWON, "30", "10", CENTI),
    _owon("SPE3103", OWON, "30", "10", CENTI),
    _owon("SPE6102", OWON, "60", "10", CENTI),
    _owon("SPE6103", OWON, "60", "10", CENTI),
    _owon("DC310S", OWON, "30", "10", CENTI, maker="KIPRIM"),
    _siglent("SPD1168X", "16", "8"),
    _siglent("SPD1305X", "30", "5"),
    _siglent("SPD3303X", "32", "3.2", channels=2),
    _siglent("SPD3303X-E", "32", "3.2", CENTI, channels=2),
)
