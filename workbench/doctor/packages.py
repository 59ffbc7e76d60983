"""Python and packages, beside those that the workbench is tested with."""

from __future__ import annotations

import platform
import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import workbench
from workbench.doctor.finding import Finding
from workbench.versions import versions

__all__ = ["packages", "python", "tested_versions"]

_TO_DO = "install those that are tested: python -m pip install -c constraints.txt -e ."


def python() -> Finding:
    """Say which Python this is."""
    return Finding("python", "ok", f"{platform.python_version()} on {platform.platform()}")


def packages() -> Finding:
    """Compare what is installed with what is tested; what is not installed does not count."""
    tested = tested_versions()
    there = {name: found for name in tested if (found := _installed(name)) is not None}
    other = {name: found for name, found in there.items() if found != tested[name]}
    if not other:
        return Finding("packages", "ok", f"{len(there)} of them, all as tested; {_main()}")
    listed = ", ".join(f"{name} {found} (tested: {tested[name]})" for name, found in other.items())
    return Finding("packages", "note", f"{len(other)} of {len(there)} differ: {listed}", _TO_DO)


def tested_versions() -> dict[str, str]:
    """Return name -> version of constraints.txt, which a wheel has inside and a checkout beside."""
    package = Path(workbench.__file__).resolve().parent
    inside = package / "constraints.txt"
    text = (inside if inside.exists() else package.parent / "constraints.txt").read_text("utf-8")
    return dict(re.findall(r"^([\w.-]+)==(\S+)$", text, re.MULTILINE))


def _installed(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _main() -> str:
    return ", ".join(f"{k} {v}" for k, v in versions().items() if k not in ("python", "system"))
