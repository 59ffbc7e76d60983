"""The versions that a result depends on."""

from __future__ import annotations

import platform
from importlib.metadata import version

__all__ = ["versions", "workbench_version"]


def workbench_version() -> str:
    """Return the version that was installed, which a checkout takes from git at `make install`."""
    return version("hopping-workbench")


def versions() -> dict[str, str]:
    """Return name -> version of the workbench, Python, system and packages, as bundles keep it."""
    packages = ("mujoco", "numpy", "scipy", "numba", "pymodbus", "rerun-sdk")
    return {
        "workbench": workbench_version(),
        "python": platform.python_version(),
        "system": platform.system(),
    } | {name: version(name) for name in packages}
