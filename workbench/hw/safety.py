"""The order of operations around an output: how it may come on, and what ends a run.

The steps are those of the instruments survey, section 5; each public function is one recipe.
"""

from __future__ import annotations

from decimal import Decimal
from typing import NamedTuple

from workbench.errors import HardwareError, SafetyStop
from workbench.hw.supply import DEAD_V, DECAY_S, Identity, Limits, Reading, Supply

__all__ = ["Prepared", "prepare", "switch_on", "watch"]

RISE_S, POLL_S = 1.0, 0.05
TOLERANCE_V, TOLERANCE_SHARE = 0.05, 0.02
FACTOR_TEN = (8.0, 12.5)  # V measured / V set of a scaling fault


class Prepared(NamedTuple):
    """A supply that is ready.

    Args:
        identity: who it is.
        found: its state before anything was changed; tell the operator when its output was on.
    """

    identity: Identity
    found: Reading


def prepare(
    supply: Supply,
    limits: Limits,
    *,
    model: str,
    serial: str | None = None,
    firmware: str | None = None,
) -> Prepared:
    """Make a supply safe and ready: known, off, limited, at 0 V.

    Args:
        supply: an open one.
        limits: of the run.
        model: as the bench file names it.
        serial: as the bench file names it, if it does.
        firmware: as the bench file names it, if it does.

    Raises:
        HardwareError: when it is another supply than named, or does not hold what was written.
        SafetyStop: when it cannot be brought into a safe state.
    """
    identity = _require_identity(supply, model, serial, firmware)  # 1
    found = supply.measure()  # 2
    if found.output:
        supply.ramp_down()
    _require_dead(supply)  # 3
    _require_off_at_power_on(supply)  # 4
    supply.arm(limits)  # 5, 6
    return Prepared(identity, found)


def switch_on(supply: Supply, volts: Decimal) -> Reading:
    """Set the first voltage, switch on, and see it arrive within a second.

    Raises:
        SafetyStop: when it does not, or a limit acts; the output was switched off at once.
    """
    applied = float(supply.set_voltage(volts))
    supply.set_output(True)
    deadline = supply.clock.now() + RISE_S
    while True:
        reading = watch(supply)
        if abs(reading.voltage_V - applied) <= TOLERANCE_V + TOLERANCE_SHARE * applied:
            return reading
        ratio = reading.voltage_V / applied if applied else float("inf")
        if ratio >= FACTOR_TEN[0] or supply.clock.now() >= deadline:
            raise _stop(supply, _wrong_voltage(applied, reading, ratio))
        supply.clock.sleep(POLL_S)


def watch(supply: Supply) -> Reading:
    """Measure a running supply and end the run when a limit or a protection acts.

    Raises:
        SafetyStop: on a trip, on current limiting, or when the output went off by itself; the
            output was switched off.
    """
    limits, reading = supply.limits, supply.measure()
    if reading.protection == "OVP":
        raise _stop(supply, f"over-voltage protection (OVP) tripped at {limits.over_voltage_V} V")
    if reading.protection == "OCP":
        raise _stop(supply, f"over-current protection (OCP) tripped at {limits.over_current_A} A")
    if not reading.output:
        raise _stop(supply, "its output went off, not by this program")
    if reading.mode == "CC":
        raise _stop(
            supply,
            f"current limiting (CC) at {reading.current_A:g} A, allowed {limits.current_max_A} A; "
            f"the voltage fell to {reading.voltage_V:g} V of {reading.set_voltage_V:g} V",
        )
    return reading


def _require_identity(
    supply: Supply, model: str, serial: str | None, firmware: str | None
) -> Identity:
    identity = supply.identify()
    asked = Identity(model, serial or identity.serial, firmware or identity.firmware)
    for what, wanted, found in zip(Identity._fields, asked, identity, strict=True):
        if wanted != found:
            raise HardwareError(
                f"{supply.name}: {what} is {found}, the bench names {wanted}; nothing was set. "
                "Connect the other supply or correct the bench file"
            )
    return identity


def _require_dead(supply: Supply) -> None:
    """Switch off, and wait until the terminals are dead too."""
    if not supply.off():
        raise SafetyStop(f"{supply.name}: OUTPUT MAY BE ON, it did not confirm off")
    if not supply.terminals_dead():
        volts = supply.measure().voltage_V
        raise SafetyStop(
            f"{supply.name}: OUTPUT MAY BE ON, it says off but measures {volts:g} V after "
            f"{DECAY_S:g} s; {DEAD_V} V and less is dead"
        )


def _require_off_at_power_on(supply: Supply) -> None:
    if supply.measure_power_on_output():
        raise SafetyStop(
            f"{supply.name}: it is set to switch its output on by itself when it gets power; "
            "switch that option off in its menu (Riden: register 68, boot power) and start again"
        )


def _wrong_voltage(applied: float, reading: Reading, ratio: float) -> str:
    text = f"measures {reading.voltage_V:g} V where {applied:g} V was set"
    if FACTOR_TEN[0] <= ratio <= FACTOR_TEN[1] or 1 / FACTOR_TEN[1] <= ratio <= 1 / FACTOR_TEN[0]:
        return f"{text}, a factor of ten: scaling fault, its model or its scale is another"
    return f"{text}, allowed {TOLERANCE_V} V + {TOLERANCE_SHARE:.0%} within {RISE_S:g} s"


def _stop(supply: Supply, text: str) -> SafetyStop:
    """Switch off first, then say what happened and whether it is off."""
    confirmed = supply.off()
    state = "the output is off, confirmed" if confirmed else "OUTPUT MAY BE ON, switch off by hand"
    return SafetyStop(f"{supply.name}: {text}; {state}")
