"""Korad KA3005P and its clones: answers to `*IDN?`, limits, status bits (survey 1.5).

Answers and limits: libsigrok korad-kaxxxxp, koradctl. The answer may end in NUL, 0x01 or 0xBC, and
newer firmware adds " SN:12345678".
"""

from __future__ import annotations

from decimal import Decimal

from workbench.hw.models.model import KoradModel

__all__ = ["KORAD"]

NO_LEVEL = "over-voltage and over-current protection have no level: they act at the setpoints"
STRAY = "some firmware adds a byte, also a digit, to the answer to ISET1?"
DROPPED = "a command that comes too early is dropped silently"
ONE_BIT = "one bit means over-voltage or over-current protection"
SLOW = "needs 0.45 s more after a setting or STATUS?"

GAP_S, SLOW_GAP_S = 0.05, 0.5


def _row(
    name: str,
    answer: str,
    amps: int = 5,
    volts: int = 30,
    *,
    bits: tuple[int | None, int | None] = (None, None),
    gap_s: float = GAP_S,
    quirk: str = "",
) -> KoradModel:
    quirks = (NO_LEVEL, STRAY, DROPPED, quirk)
    return KoradModel(
        name=name,
        family="korad",
        pattern=rf"{answer} ?V(?P<firmware>[\d.]+)(?: SN:(?P<serial>\d+))?",
        voltage_max_V=Decimal(volts),
        current_max_A=Decimal(amps),
        voltage_step_V=Decimal("0.01"),
        current_steps_A=(Decimal("0.001"),),
        gap_s=gap_s,
        over_current_bit=bits[0],
        over_voltage_bit=bits[1],
        quirks=tuple(text for text in quirks if text),
        source="libsigrok korad-kaxxxxp, koradctl",
    )


KORAD = (
    _row("KA3005P", "KORAD ?KA3005P", bits=(5, 7)),
    _row("KD3005P", "KORAD ?KD3005P"),
    _row("KD6005P", "KORAD ?KD6005P", volts=60),
    _row("72-2535", "TENMA ?72-2535", amps=3),
    _row("72-2540", "TENMA ?72-2540", bits=(7, 7), quirk=ONE_BIT),
    _row("72-2550", "TENMA ?72-2550", amps=3, volts=60),
    _row("72-2705", "TENMA ?72-2705", amps=3),
    _row("72-2710", "TENMA ?72-2710"),
    _row("RND 320-KA3005P", "RND ?320-KA3005P"),
    _row("RND 320-KD3005P", "RND ?320-KD3005P"),
    _row("PS3005D", "VELLEMAN ?PS3005D", gap_s=SLOW_GAP_S, quirk=SLOW),
    _row("LABPS3005D", "VELLEMAN ?LABPS3005D"),
    _row("S-LS-31", "S-LS-31"),
)
