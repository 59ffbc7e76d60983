"""Who is at the bench, and where a run was started: written into each run."""

from __future__ import annotations

import getpass
import os
from typing import Any

__all__ = ["START", "VARIABLE", "operator_name", "start_id", "started"]

VARIABLE = "WORKBENCH_OPERATOR"
START = "WORKBENCH_PANEL_START"
"""By this the panel recognises a run that it has started."""


def operator_name() -> str:
    """Return the name in `WORKBENCH_OPERATOR`, else that of the account."""
    named = os.environ.get(VARIABLE, "").strip()
    if named:
        return named
    try:
        return getpass.getuser()
    except (KeyError, ImportError, OSError):  # an account without a name, as in a container
        return "unknown"


def start_id() -> str | None:
    """Return how the panel calls the start of this process; None where it did not start it."""
    return os.environ.get(START)


def started() -> dict[str, Any]:
    """Return who started this process, and where, for the journal of its runs."""
    return {"operator": operator_name(), "where": "terminal" if start_id() is None else "panel"}
