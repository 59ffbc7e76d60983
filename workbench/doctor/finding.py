"""What a check came to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["Finding", "State"]

State = Literal["ok", "note", "failed"]
"""A note may do harm one day; what failed does it now."""


@dataclass(frozen=True)
class Finding:
    """What was looked at, and what was found.

    Args:
        name: what was looked at.
        state: of it.
        found: in words.
        to_do: what helps; empty where all is well.
    """

    name: str
    state: State
    found: str
    to_do: str = ""
