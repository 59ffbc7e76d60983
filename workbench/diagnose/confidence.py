"""How sure a cause is: how often causes of such weight were true where the truth was known.

The weight of the evidence compares the causes that were tried. Of those that nobody thought of, and
of runs that no model follows, it knows nothing; so it is no chance. The bank's sealed cases tell
the chance: `confidence.csv` holds what `python -m benchmarks.bank.calibrate` learnt of them.
"""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["TABLE", "confidence"]

TABLE = Path(__file__).with_name("confidence.csv")
"""`answer` NAMED or SET, and by rising `weight` what share was `right` of so many `causes`."""


def confidence(answer: str, weight: float) -> float:
    """Return how often a cause of this weight was a true one, between entries on a line.

    Args:
        answer: SET, or one that names causes.
        weight: of the evidence, 0 to 1.
    """
    weights, right = _table()["SET" if answer == "SET" else "NAMED"]
    return float(np.interp(weight, weights, right))


@cache
def _table() -> dict[str, NDArray[np.float64]]:
    """Return (2, n) weights and shares by answer."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {
        answer: np.array(
            [[float(row[key]) for row in rows if row["answer"] == answer]
             for key in ("weight", "right")]
        ) for answer in ("NAMED", "SET")
    }  # fmt: skip
