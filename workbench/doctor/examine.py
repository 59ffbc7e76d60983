"""All checks in order; one that breaks is itself a finding."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from workbench.doctor.clock import monotonic_clock, system_clock
from workbench.doctor.disk import disk_space, writable
from workbench.doctor.finding import Finding
from workbench.doctor.packages import packages, python
from workbench.doctor.ports import exports, serial_ports, supply
from workbench.doctor.viewer import viewer
from workbench.progress import Progress, counted

__all__ = ["examine"]


def examine(runs: Path, bench: str | None, progress: Progress) -> Iterator[Finding]:
    """Yield what each check found.

    Args:
        runs: folder of all bundles; it need not exist.
        bench: bench file whose supply is asked for its model; None asks none.
        progress: receives each check.
    """
    checks: dict[str, Callable[[], Finding]] = {
        "python": python,
        "packages": packages,
        "ground law": _ground_law,
        "viewer": viewer,
        "serial ports": serial_ports,
        "supply": partial(supply, bench),
        "exports": partial(exports, bench),
        "runs folder": partial(writable, runs),
        "disk": partial(disk_space, runs),
        "monotonic clock": monotonic_clock,
        "system clock": partial(system_clock, runs),
    }
    if bench is None:
        del checks["supply"], checks["exports"]
    for number, (name, check) in enumerate(checks.items(), start=1):
        progress(counted(f"examine {name}", number, len(checks)))
        yield _tried(name, check)


def _tried(name: str, check: Callable[[], Finding]) -> Finding:
    try:
        return check()
    except Exception as error:  # whatever is broken on this computer, the others are looked at
        found = f"{type(error).__name__}: {error}"
        return Finding(name, "failed", found, "install the workbench anew: make clean install")


def _ground_law() -> Finding:
    from workbench.sim import install_force_laws

    install_force_laws()
    return Finding("ground law", "ok", "compiled and installed")
