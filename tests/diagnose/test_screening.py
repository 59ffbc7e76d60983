"""Screening: a cause that acts beyond a threshold is seen by secants where a foot lands."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.diagnose.candidates import Candidate
from workbench.diagnose.screening import screened
from workbench.fit import Parameter, ParameterVector, Scope

Array = NDArray[np.float64]
COUNT, TRUTH, THRESHOLD = 1200, 1.8, 0.4
TANGENT = 0.1


def parameter(name: str, scope: Scope) -> Parameter:
    return Parameter(name, "1", 0.0, 1.0, -5.0, 5.0, scope)


def candidate(name: str) -> Candidate:
    quantity = {"share": parameter(f"{name} share", Scope.CANDIDATE)}
    return Candidate(name, "contact", quantity, (), ("share", "1"), "", (), (), "")


class Sliding:
    """Residuals of a slip that nothing but enough of a cause changes, and of a smooth one.

    Args:
        lands: whether the run's residuals are said to be kinked.
    """

    def __init__(self, lands: bool) -> None:
        base = parameter("base", Scope.MODEL)
        numbers = [*candidate("slip").quantities.values(), *candidate("drag").quantities.values()]
        self.vector = ParameterVector((base, *numbers))
        self.system = SimpleNamespace(
            names=["hop"], sample_s=1 / 120, lands=lambda run: lands,
            seen=lambda run: np.zeros((COUNT, 1)),
        )  # fmt: skip
        self.edges = (0, COUNT, COUNT + 3)
        self.noise = np.random.default_rng(1).normal(size=COUNT)
        self.asked: list[float] = []

    def motion(self, x: Array) -> Array:
        base, slip, drag = x
        phase = np.arange(COUNT) / 40
        beyond = np.sign(slip) * max(abs(slip) - THRESHOLD, 0.0)
        return base + beyond * np.sin(phase) + 0.01 * drag * np.cos(phase)

    def residuals(self, x: Array) -> Array:
        truth = np.array([0.0, TRUTH, 0.0])
        return np.append(self.noise + self.motion(x) - self.motion(truth), x)

    def jacobian(
        self, x: Array, asked: Any = None, steps: Array | None = None, runs: Sequence[int] = (0,)
    ) -> Array:
        assert steps is not None
        self.asked += [float(steps[0])]
        columns = []
        for i in range(len(x)):
            step = np.zeros(len(x))
            step[i] = steps[i]
            change = self.residuals(x + step) - self.residuals(x)
            columns.append(change / step[i])
        return np.column_stack(columns)


def gains(lands: bool) -> tuple[dict[str, float], Sliding]:
    candidates = {name: candidate(name) for name in ("drag", "slip")}
    estimator: Any = Sliding(lands)

    def moving(names: Sequence[str]) -> dict[str, bool]:
        return {"base": True} | {f"{name} share": False for name in names}

    found = screened(estimator, np.zeros(3), candidates, moving, np.full(3, TANGENT))
    return {one.name: one.gain for one in found}, estimator


def test_a_cause_with_a_threshold_promises_little_by_tangents_and_much_by_secants() -> None:
    tangents, smooth = gains(lands=False)
    secants, _ = gains(lands=True)
    assert smooth.asked == [TANGENT]
    assert tangents["slip"] == pytest.approx(0.0, abs=1.0)
    whole = 0.5 * COUNT * (TRUTH - THRESHOLD) ** 2
    assert secants["slip"] == pytest.approx(whole, rel=0.2)


def test_secants_promise_nothing_of_a_cause_that_is_not_there() -> None:
    secants, estimator = gains(lands=True)
    assert len(estimator.asked) == 1 + 4
    assert list(secants) == ["slip", "drag"]
    assert secants["drag"] < 10
