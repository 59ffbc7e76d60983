"""Whether a folder can take runs: may this user write there, and is there room."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from workbench.errors import InputError, what_to_do

__all__ = ["existing", "free_gb", "require_room"]

_GB = 1e9
_LEAST_GB = 0.1  # some runs; the doctor asks for more


def existing(folder: Path) -> Path:
    """Return a folder, or the nearest above it that exists."""
    path = folder.absolute()
    while not path.exists():
        path = path.parent
    return path


def free_gb(folder: Path) -> float:
    """Return the room on the disk of a folder, which need not exist [GB]."""
    return shutil.disk_usage(existing(folder)).free / _GB


def require_room(runs: Path) -> None:
    """Refuse a folder of runs that cannot be written, or whose disk is full.

    Raises:
        InputError: with what to do.
    """
    path = existing(runs)
    try:
        with tempfile.TemporaryFile(dir=path) as file:
            file.write(b"?")
    except OSError as error:
        raise InputError(
            f"{path}{'' if path.is_dir() else '/'}: no run can be written here: "
            f"{what_to_do(error)} (--runs, WORKBENCH_RUNS)"
        ) from None
    if free_gb(path) < _LEAST_GB:
        raise InputError(
            f"{path}: {1000 * free_gb(path):.0f} MB free, at least {1000 * _LEAST_GB:.0f} MB are "
            "needed; make room, or name a folder on another disk with --runs"
        )
