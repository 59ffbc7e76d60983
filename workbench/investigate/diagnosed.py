"""A diagnosis with what it left in its folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.diagnose import Diagnosis
from workbench.investigate.next_protocol import Following, next_object

__all__ = ["Diagnosed"]


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosed:
    """A diagnosis, what is to be run next, and its page.

    Args:
        found: the answer.
        proposed: what would show more; None where nothing was proposed.
        report: the page.
    """

    found: Diagnosis
    proposed: Following | None
    report: Path

    def as_json(self) -> dict[str, Any]:
        """Return what the command line prints."""
        return self.found.as_json() | next_object(self.proposed) | {"report": str(self.report)}

    def __repr__(self) -> str:
        """Return it in a few lines: the answer, its causes, the files."""
        extended = self.found.extended
        model = "none" if extended is None else str(extended.source)
        return f"{self.found!r}\n  model: {model}, report: {self.report}"
