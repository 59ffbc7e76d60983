"""The viewer of recordings: it starts, and is the one that belongs to the SDK."""

from __future__ import annotations

from importlib.metadata import version

from workbench import report as views
from workbench.doctor.finding import Finding
from workbench.errors import WorkbenchError

__all__ = ["viewer"]

_TO_DO = "install it anew: python -m pip install --force-reinstall -c constraints.txt rerun-sdk"


def viewer() -> Finding:
    """Start the viewer for its version, and compare that with the SDK's."""
    sdk = version("rerun-sdk")
    try:
        found = views.viewer_version()
    except WorkbenchError as error:
        return Finding("viewer", "failed", str(error), _TO_DO)
    if found != sdk:
        return Finding("viewer", "failed", f"rerun {found}, but its SDK is {sdk}", _TO_DO)
    return Finding("viewer", "ok", f"rerun {found} starts, as its SDK")
