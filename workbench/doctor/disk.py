"""Where runs are kept: may this user write there, and is there room."""

from __future__ import annotations

import tempfile
from pathlib import Path

from workbench.doctor.finding import Finding
from workbench.errors import what_to_do
from workbench.run import existing, free_gb

__all__ = ["LEAST_FREE_GB", "disk_space", "writable"]

LEAST_FREE_GB = 1.0


def writable(runs: Path) -> Finding:
    """Write a file where runs go, and remove it."""
    folder = existing(runs)
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"?")
    except OSError as error:
        to_do = "name another folder with --runs or WORKBENCH_RUNS, or have its rights changed"
        return Finding("runs folder", "failed", f"{folder}: {what_to_do(error)}", to_do)
    new = "" if folder == runs.absolute() else f"; {runs} is made by the first run"
    return Finding("runs folder", "ok", f"{folder} can be written{new}")


def disk_space(runs: Path) -> Finding:
    """Say how much room there is for runs."""
    free = free_gb(runs)
    if free < LEAST_FREE_GB:
        found = f"{free:.1f} GB free, at least {LEAST_FREE_GB:g} GB are needed"
        return Finding("disk", "failed", found, "make room, or name a folder on another disk")
    return Finding("disk", "ok", f"{free:.0f} GB free")
