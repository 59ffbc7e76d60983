"""How often an answer of a kind was right in the bank of hidden-effect cases.

`confidence.json` is written by `python -m benchmarks.bank.learn` from answers to cases of the
hopping robot. It says nothing of other machines.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from workbench.diagnose.decide import Kind

__all__ = ["Confidence", "confidence_in"]

_LEARNT = Path(__file__).with_name("confidence.json")
_FEWEST = 5  # answers of a kind that something is learnt from


@dataclass(frozen=True)
class Confidence:
    """What was learnt of one kind of answer.

    Args:
        kind: of the answer.
        right: answers of that kind that were right; of a SET, that hold the true causes.
        count: of all that kind.
    """

    kind: Kind
    right: int
    count: int

    @property
    def share(self) -> float:
        """Return the probability that such an answer is right: the mean of Jeffreys' posterior."""
        return (self.right + 0.5) / (self.count + 1)

    @property
    def sentence(self) -> str:
        """Return it in words."""
        said = "hold the true cause" if self.kind == "SET" else "are right"
        return f"of {self.count} answers {self.kind} to hidden causes, {self.right} {said}"

    def as_json(self) -> dict[str, Any]:
        """Return it as the command line prints it."""
        return {"share": round(self.share, 3), "right": self.right, "of": self.count}


def confidence_in(kind: Kind) -> Confidence | None:
    """Return what was learnt of a kind of answer; None where there were too few."""
    right, count = _learnt().get(kind, (0, 0))
    return Confidence(kind, right, count) if count >= _FEWEST else None


@cache
def _learnt() -> dict[str, tuple[int, int]]:
    return json.loads(_LEARNT.read_text(encoding="utf-8"))["answers"]
