"""Commands to a simulated supply, while it runs, for what is to go wrong: one a line."""

from __future__ import annotations

import math

from workbench.errors import InputError, did_you_mean
from workbench.hw.simulated.device import SimulatedSupply
from workbench.hw.simulated.faults import EVENTS, SimulatedFault

__all__ = ["HELP", "delayed_fault", "obey"]

HELP = f"""\
a fault switches it on: {", ".join(fault for fault in SimulatedFault if fault not in EVENTS)}
FAULT COUNT lets it hit so many messages only
these happen once: {", ".join(fault for fault in SimulatedFault if fault in EVENTS)}
mend ends the fault, and plugs in again what was unplugged
state shows what is at the terminals, end ends"""


def obey(device: SimulatedSupply, line: str) -> str:
    """Carry out one command on a device.

    Args:
        device: a simulated supply.
        line: `FAULT [COUNT]`, `mend`, `state` or `help`.

    Returns:
        What to show the person who typed it.

    Raises:
        InputError: when it is no command.
    """
    word, *rest = line.split() or ["help"]
    if word == "help":
        return HELP
    if word == "mend":
        device.mend()
        return "mended"
    if word != "state":
        fault = named_fault(word)
        if rest and not (len(rest) == 1 and rest[0].isdecimal()):
            raise InputError(f"{line!r}: after a fault comes how often it hits, or nothing")
        device.fail(fault, times=int(rest[0]) if rest else math.inf)
    now = device.output
    state = "on" if now.on else "off"
    return (
        f"{'' if word == 'state' else word + ': '}output {state}, {now.voltage:g} V and "
        f"{now.current:.3g} A at the terminals, set {now.set_voltage:g} V"
    )


def named_fault(name: str) -> SimulatedFault:
    """Return the fault of a name.

    Raises:
        InputError: when there is none; it names the nearest, and all.
    """
    try:
        return SimulatedFault(name)
    except ValueError:
        names = [str(fault) for fault in SimulatedFault]
        hint = did_you_mean(name, names) or ";"
        raise InputError(f"no fault {name!r}{hint} there are {', '.join(names)}") from None


def delayed_fault(text: str) -> tuple[SimulatedFault, float]:
    """Read `NAME` or `NAME:SECONDS`: the fault and when it begins [s].

    Raises:
        InputError: when it is neither.
    """
    name, _, after = text.partition(":")
    try:
        seconds = float(after or 0)
    except ValueError:
        seconds = -1.0
    if not 0 <= seconds < math.inf:
        raise InputError(f"{text!r} is not NAME or NAME:SECONDS, as in silent:5")
    return named_fault(name), seconds
