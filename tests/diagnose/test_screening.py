"""Screening: a cause that acts beyond a threshold is seen by secants where a foot lands."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.diagnose.screening import promising, screened
from workbench.fit.linear import Linear

Array = NDArray[np.float64]
COUNT, TRUTH, THRESHOLD = 1200, 1.8, 0.4
TANGENT = 0.1
COLUMNS = {"slip": [1], "drag": [2]}


def motion(x: Array) -> Array:
    """Return residuals of a slip that nothing but enough of it changes, and of a smooth drag."""
    base, slip, drag = x
    phase = np.arange(COUNT) / 40
    beyond = np.sign(slip) * max(abs(slip) - THRESHOLD, 0.0)
    return base + beyond * np.sin(phase) + 0.01 * drag * np.cos(phase)


def slopes(reach: float) -> Array:
    steps = reach * np.eye(3)
    return np.column_stack([(motion(step) - motion(np.zeros(3))) / reach for step in steps])


def moving(names: Sequence[str]) -> dict[str, bool]:
    return {"base": True} | dict.fromkeys(names, False)


def gains(*reaches: float) -> dict[str, float]:
    noise = np.random.default_rng(1).normal(size=COUNT)
    residuals = noise - motion(np.array([0.0, TRUTH, 0.0]))
    names, edges = ("base", "slip", "drag"), np.arange(0, COUNT + 1, 120)
    own = np.zeros(3, dtype=np.bool_)
    near = Linear(names, own, np.zeros(3), residuals, slopes(TANGENT), edges)
    near = promising(near, [slopes(one) for one in reaches], COLUMNS, lambda name: moving([name]))
    candidates: Any = {name: SimpleNamespace(instead_of=()) for name in COLUMNS}
    found = screened(near, candidates, moving)
    return {one.name: one.gain for one in found}


def test_a_cause_with_a_threshold_promises_little_by_tangents_and_much_by_secants() -> None:
    assert gains()["slip"] == pytest.approx(0.0, abs=1.0)
    whole = 0.5 * COUNT * (TRUTH - THRESHOLD) ** 2
    assert gains(-2.0, 2.0)["slip"] == pytest.approx(whole, rel=0.2)


def test_secants_promise_nothing_of_a_cause_that_is_not_there() -> None:
    secants = gains(-2.0, 2.0)
    assert list(secants) == ["slip", "drag"]
    assert secants["drag"] < 10
