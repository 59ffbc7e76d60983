"""The order of operations around an output: how it may come on, and what ends a run.

The steps are those of the instruments survey, section 5; each public function is one recipe.
"""

from __future__ import annotations

from decimal import Decimal
from typing import NamedTuple

from workbench.errors import HardwareError, SafetyStop
from workbench.hw.models import model_named
from workbench.hw.supply import DEAD_V, DECAY_S, FALSE_OFF, Identity, Limits, Reading, Supply
from workbench.output import BY_HAND, MAY_BE_ON

__all__ = ["Prepared", "check_scale", "prepare", "stop", "switch_on", "watch"]

HARMLESS_V = Decimal("0.5")  # the motor turns from 0.66 V on: 4.4 U - 2.9 rad/s
RISE_S, POLL_S = 1.0, 0.05
SETTLED_S = 0.2  # a tenth of the setpoint for so long is no rising voltage
TOLERANCE_V, TOLERANCE_SHARE = 0.05, 0.02
FACTOR_TEN = (8.0, 12.5)  # V measured / V set of a scaling fault
SAME_V = 0.0005  # half of the finest step that a setpoint is read with
SAME_A = 0.005  # half of the coarsest step that a current limit is held with
PROTECTIONS = {
    "OPP": "over-power protection",
    "OTP": "over-temperature protection",
    "SCP": "short-circuit protection",
}


class Prepared(NamedTuple):
    """A supply that is ready.

    Args:
        identity: who it is.
        found: its state before anything was changed; warn the operator when its output was on.
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
    try:
        supply.set_output(True)
    except HardwareError as error:  # it tripped at once, or nobody knows
        raise stop(supply, f"it did not come on and stay on ({error})") from error
    began = supply.clock.now()
    while True:
        reading = _running(supply)
        if _arrived(reading, applied):
            return reading
        waited = supply.clock.now() - began
        if waited >= RISE_S or (waited >= SETTLED_S and _scaled_down(reading, applied)):
            raise stop(supply, _wrong_voltage(applied, reading))
        supply.clock.sleep(POLL_S)


def check_scale(supply: Supply) -> Reading:
    """Drive a harmless voltage for a moment, see it at the terminals, and switch off again.

    A supply whose output is not what it was set to shows it here, at 5 V at most where it drives
    ten times as much. One that sets and measures in the same wrong steps goes undetected without a
    meter; hence only models whose ids are known by name are driven.

    Raises:
        SafetyStop: when it does not arrive, or is off by a factor of ten; the output was switched
            off.
    """
    reading = switch_on(supply, HARMLESS_V)
    _require_dead(supply)
    return reading


def watch(supply: Supply) -> Reading:
    """Measure a running supply and end the run when a limit or a protection acts.

    Raises:
        SafetyStop: on a trip, on current limiting, when the output went off by itself, when
            somebody changed the setpoint or raised the current limit, when a trip level is passed
            without a trip, or when the terminals do not follow the setpoint, at once when by a
            factor of ten; the output was switched off.
    """
    reading = _running(supply)
    setpoint = supply.setpoint
    if setpoint is None or _arrived(reading, float(setpoint.volts)):
        return reading
    waited = supply.clock.now() - setpoint.time_s
    if waited >= RISE_S or (waited >= SETTLED_S and _scaled_down(reading, float(setpoint.volts))):
        raise stop(supply, _wrong_voltage(float(setpoint.volts), reading))
    return reading


def _running(supply: Supply) -> Reading:
    """Measure, and stop on whatever needs no waiting."""
    limits, reading, setpoint = supply.limits, supply.measure(), supply.setpoint
    if reading.protection != "none":
        raise stop(supply, _tripped(reading, limits))
    if not reading.output:
        raise stop(supply, "its output went off, not by this program")
    if setpoint is not None and reading.voltage_V >= FACTOR_TEN[0] * float(setpoint.volts) + DEAD_V:
        raise stop(supply, _wrong_voltage(float(setpoint.volts), reading))
    held = reading.current_limit_A
    if held is not None and held > float(limits.current_max_A) + SAME_A:
        raise stop(
            supply,
            f"its current limit is {held:g} A, allowed {limits.current_max_A} A; somebody changed "
            "it at the panel, or its current range",
        )
    if reading.mode == "CC":
        raise stop(
            supply,
            f"current limiting (CC) at {reading.current_A:g} A, allowed {limits.current_max_A} A; "
            f"the voltage fell to {reading.voltage_V:g} V of {reading.set_voltage_V:g} V",
        )
    if setpoint is not None and abs(reading.set_voltage_V - float(setpoint.volts)) > SAME_V:
        raise stop(
            supply,
            f"its setpoint is {reading.set_voltage_V:g} V, this program set "
            f"{float(setpoint.volts):g} V; somebody changed it at the panel, or it lost its power",
        )
    if reading.voltage_V > float(limits.over_voltage_V) + TOLERANCE_V:
        raise stop(
            supply,
            f"measures {reading.voltage_V:g} V, above its trip level {limits.over_voltage_V} V, "
            "and did not trip",
        )
    if reading.current_A > float(limits.over_current_A) * (1 + TOLERANCE_SHARE):
        raise stop(
            supply,
            f"measures {reading.current_A:g} A, above its trip level {limits.over_current_A} A, "
            "and did not trip",
        )
    return reading


def _tripped(reading: Reading, limits: Limits) -> str:
    match reading.protection:
        case "OVP":
            return f"over-voltage protection (OVP) tripped at {limits.over_voltage_V} V"
        case "OCP":
            return f"over-current protection (OCP) tripped at {limits.over_current_A} A"
        case other:
            return f"{PROTECTIONS[other]} ({other}) tripped; let it cool and check its leads"


def _arrived(reading: Reading, applied: float) -> bool:
    return abs(reading.voltage_V - applied) <= TOLERANCE_V + TOLERANCE_SHARE * applied


def _scaled_down(reading: Reading, applied: float) -> bool:
    return applied / FACTOR_TEN[1] <= reading.voltage_V <= applied / FACTOR_TEN[0]


def _require_identity(
    supply: Supply, model: str, serial: str | None, firmware: str | None
) -> Identity:
    identity = supply.identify()
    asked = Identity(
        model_named(model).name, serial or identity.serial, firmware or identity.firmware
    )
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
        raise SafetyStop(f"{supply.name}: {supply.not_off}; {MAY_BE_ON}, {BY_HAND}")
    if not supply.terminals_dead():
        if supply.not_dead != FALSE_OFF:
            raise SafetyStop(f"{supply.name}: {supply.not_dead}; {MAY_BE_ON}, {BY_HAND}")
        volts = supply.measure().voltage_V
        raise SafetyStop(
            f"{supply.name}: it says off but measures {volts:g} V after {DECAY_S:g} s, {DEAD_V} V "
            f"and less is dead; {MAY_BE_ON}, {BY_HAND}"
        )
    if supply.interrupted:  # what follows would switch on again
        raise KeyboardInterrupt


def _require_off_at_power_on(supply: Supply) -> None:
    if supply.measure_power_on_output():
        raise SafetyStop(
            f"{supply.name}: it is set to switch its output on by itself when it gets power; "
            "switch that option off in its menu (boot power: register 68 of a Riden, 87 of a DPS, "
            "34817 of a Hanmatek) and start again"
        )


def _wrong_voltage(applied: float, reading: Reading) -> str:
    text = f"measures {reading.voltage_V:g} V where {applied:g} V was set"
    scaled_up = FACTOR_TEN[0] * applied <= reading.voltage_V <= FACTOR_TEN[1] * applied
    if scaled_up or _scaled_down(reading, applied):
        return f"{text}, a factor of ten: scaling fault, its model or its scale is another"
    return f"{text}, allowed {TOLERANCE_V} V + {TOLERANCE_SHARE:.0%} within {RISE_S:g} s"


def stop(supply: Supply, text: str) -> SafetyStop:
    """Switch off first, then return what happened and whether it is off, to be raised."""
    if not supply.off():
        return SafetyStop(f"{supply.name}: {text}; {MAY_BE_ON}, {BY_HAND}")
    if not supply.terminals_dead():
        return SafetyStop(f"{supply.name}: {text}; {supply.not_dead}; {MAY_BE_ON}, {BY_HAND}")
    return SafetyStop(f"{supply.name}: {text}; the output is off, confirmed")
