"""`workbench doctor`: is this computer ready."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import typer
from serial.tools.list_ports import comports

from workbench.cli.output import JsonFlag, RunsFolder, emit, show_table
from workbench.sim import install_force_laws
from workbench.versions import versions

__all__ = ["doctor"]

_LEAST_FREE_GB = 1.0


def doctor(folder: RunsFolder = Path("runs"), as_json: JsonFlag = False) -> None:
    """Check packages, the compiled ground law, serial ports and disk.

    Example: workbench doctor
    """
    checks: dict[str, Callable[[], str]] = {
        "python": lambda: sys.version.split()[0],
        "packages": lambda: ", ".join(f"{k} {v}" for k, v in versions().items()),
        "ground law": _ground_law,
        "serial ports": lambda: ", ".join(p.device for p in comports()) or "none found",
        "disk": lambda: _disk(folder),
    }
    found = {name: _tried(check) for name, check in checks.items()}
    if as_json:
        shown = {name: {"ok": ok, "found": text} for name, (ok, text) in found.items()}
        emit({"ok": all(ok for ok, _ in found.values()), "checks": shown})
    else:
        rows = [[name, "ok" if ok else "FAILED", text] for name, (ok, text) in found.items()]
        show_table("This computer", ["", "", ""], rows)
    if not all(ok for ok, _ in found.values()):
        raise typer.Exit(1)


def _tried(check: Callable[[], str]) -> tuple[bool, str]:
    try:
        return True, check()
    except Exception as error:
        return False, f"{type(error).__name__}: {error}"


def _ground_law() -> str:
    install_force_laws()
    return "compiled and installed"


def _disk(folder: Path) -> str:
    place = folder if folder.exists() else Path()
    free = shutil.disk_usage(place).free / 1e9
    if free < _LEAST_FREE_GB:
        raise OSError(f"{free:.1f} GB free, at least {_LEAST_FREE_GB:g} GB are needed")
    return f"{free:.0f} GB free"
