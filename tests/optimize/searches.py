"""The searches that every test of the loop makes: whole ones, and of the expensive ones small ones.

Apart from `contract.py`, as processes that are killed need no pytest.
"""

from __future__ import annotations

import pytest

from tests.optimize.contract import ALGORITHMS

GUIDED = tuple(name for name in ALGORITHMS if name.startswith("guided"))
WHOLE, SMALL = 240, 84
"""Evaluations; in a small one the guided searches learn three times, once from what they learnt."""
SEARCHES = [
    *((name, WHOLE) for name in ALGORITHMS if name not in GUIDED),
    (GUIDED[-1], SMALL),
    *(pytest.param(name, SMALL, marks=pytest.mark.long) for name in GUIDED[:-1]),
    *(pytest.param(name, WHOLE, marks=pytest.mark.long) for name in GUIDED),
]
