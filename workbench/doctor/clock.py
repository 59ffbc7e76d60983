"""The clocks: the one that times a drive, and the one that names runs and finds their exports."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from datetime import datetime
from pathlib import Path

import workbench
from workbench.doctor.finding import Finding
from workbench.run import existing

__all__ = ["monotonic_clock", "system_clock"]

_COARSEST_S = 0.02  # of the clock: the shortest wait between two commands is ten times that
_APART_S = 5.0  # between clock and disk; an export is recognised by times of minutes
_ASK_S = 10.0
_SYNCHRONISE = "have both computers synchronised, here: timedatectl set-ntp true"


def monotonic_clock() -> Finding:
    """Measure how fine the clock is that drives are timed by."""
    step = min(_next_step() for _ in range(5))
    found = f"steps of {1e6 * step:.2g} microseconds"
    if step > _COARSEST_S:
        to_do = "drive no supply from this computer: its steps come too late"
        return Finding("monotonic clock", "failed", found, to_do)
    return Finding("monotonic clock", "ok", found)


def _next_step() -> float:
    begin = now = time.monotonic()
    while now == begin:
        now = time.monotonic()
    return now - begin


def system_clock(runs: Path) -> Finding:
    """Compare the clock with the times of files, and ask whether it is kept right."""
    name, now = "system clock", time.time()
    apart = _file_time(existing(runs)) - now
    newest = max(path.stat().st_mtime for path in Path(workbench.__file__).parent.glob("*.py"))
    if abs(apart) > _APART_S:
        found = f"files in {runs} are stamped {apart:+.0f} s from this computer's clock"
        return Finding(name, "failed", found, "set both clocks; exports are found by their times")
    if newest > now + _APART_S:
        found = f"it shows {datetime.now():%Y-%m-%d %H:%M}, before the workbench was installed"
        return Finding(name, "failed", found, "set the clock; runs are named by it")
    kept = _synchronised()
    if kept is False:
        return Finding(
            name, "note", "agrees with file times, but is not synchronised", _SYNCHRONISE
        )
    how = {True: "synchronised", None: "whether it is synchronised is not known here"}[kept]
    return Finding(name, "ok", f"agrees with file times; {how}")


def _file_time(folder: Path) -> float:
    try:
        with tempfile.NamedTemporaryFile(dir=folder) as file:
            file.write(b"?")
            file.flush()
            return Path(file.name).stat().st_mtime
    except OSError:  # reported by the check of the folder
        return time.time()


def _synchronised() -> bool | None:
    """Return what the system says of its time; None where it cannot be asked."""
    program = shutil.which("timedatectl")
    if program is None:
        return None
    try:
        asked = [program, "show", "--property=NTPSynchronized", "--value"]
        done = subprocess.run(asked, capture_output=True, text=True, timeout=_ASK_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return {"yes": True, "no": False}.get(done.stdout.strip())
