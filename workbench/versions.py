"""The versions that a result depends on."""

from __future__ import annotations

import platform
from importlib.metadata import version

import workbench

__all__ = ["versions"]


def versions() -> dict[str, str]:
    """Return name -> version of the workbench, Python, system and packages, as bundles keep it."""
    packages = ("mujoco", "numpy", "scipy", "numba", "pymodbus", "rerun-sdk")
    return {
        "workbench": workbench.__version__,
        "python": platform.python_version(),
        "system": platform.system(),
    } | {name: version(name) for name in packages}
