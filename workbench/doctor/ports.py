"""Serial ports and who may open them; the supply of a bench, of which only the model is read."""

from __future__ import annotations

import os

from serial.tools.list_ports import comports

from workbench.doctor.finding import Finding
from workbench.errors import HardwareError, WorkbenchError
from workbench.run import RealBench, load_bench, make_bench, require_takes

__all__ = ["exports", "serial_ports", "supply"]

_JOIN = "join the group that owns it: sudo usermod -aG dialout $USER, then log in anew"


def serial_ports() -> Finding:
    """Say which ports there are, and which of them this user may open."""
    ports = [port.device for port in comports()]
    if not ports:
        to_do = "plug the supply in and switch it on; the virtual bench needs no port"
        return Finding("serial ports", "note", "none", to_do)
    shut = [port for port in ports if os.name == "posix" and not os.access(port, os.R_OK | os.W_OK)]
    if shut:
        found = f"{', '.join(ports)}; this user may not open {', '.join(shut)}"
        return Finding("serial ports", "note", found, _JOIN)
    return Finding("serial ports", "ok", ", ".join(ports))


def exports(bench: str | None) -> Finding:
    """Say whether the folder where a bench's exports appear can be listed."""
    file = load_bench(bench or "virtual")
    takes = file.content.tracking.takes
    if takes is None or file.content.virtual is not None:
        return Finding("exports", "ok", "this bench awaits none in a folder")
    try:
        require_takes(file)
        make_bench(file.content).require_ready(drives=False)
    except WorkbenchError as error:
        return Finding("exports", "failed", str(error), "correct tracking.takes in the bench file")
    return Finding("exports", "ok", f"awaited in {takes}")


def supply(bench: str | None) -> Finding:
    """Ask the supply of a bench which model it is; nothing is set and nothing is switched."""
    try:
        device = make_bench(load_bench(bench or "virtual").content)
        if not isinstance(device, RealBench):
            return Finding("supply", "ok", "simulated: this bench has no real one")
        opened = device.open_supply()
        try:
            who = opened.identify()
        finally:
            opened.close()
    except WorkbenchError as error:
        to_do = "correct the bench file"
        if isinstance(error, HardwareError):
            to_do = "see what answers at all: workbench supply probe"
        return Finding("supply", "failed", str(error), to_do)
    asked = device.file.supply.model
    found = f"{who.model} answers, serial number {who.serial}, firmware {who.firmware}"
    if who.model != asked:
        return Finding("supply", "failed", f"{found}; the bench names {asked}", "correct either")
    return Finding("supply", "ok", found)
