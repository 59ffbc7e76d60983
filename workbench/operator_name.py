"""Who stands at the bench: written into each run, and beside each remark."""

from __future__ import annotations

import getpass
import os

__all__ = ["VARIABLE", "operator_name"]

VARIABLE = "WORKBENCH_OPERATOR"


def operator_name() -> str:
    """Return the name in `WORKBENCH_OPERATOR`, else that of the account."""
    named = os.environ.get(VARIABLE, "").strip()
    if named:
        return named
    try:
        return getpass.getuser()
    except (KeyError, ImportError, OSError):  # an account without a name, as in a container
        return "unknown"
