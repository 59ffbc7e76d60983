"""Derivatives in long steps are those of the steps that runs are compared in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.diagnose.hidden import DOCUMENT, SHAPE, runs_of, truth
from tests.diagnose.hidden import Asked as Run
from workbench.diagnose import HopperRig
from workbench.diagnose.layout import Layout
from workbench.diagnose.noise import Noise
from workbench.diagnose.problem import Problem
from workbench.diagnose.rig import Asked

RUNS = (Run("clamped", 15.0, 2.0), Run("decay", 0.8, 2.0), Run("hop", 17.0, 1.5))
HELD, HOP = (0, 1), (2,)


class InOwnSteps(HopperRig):
    """The same rig, which simulates nothing in coarse steps."""

    def predict(
        self, asked: Sequence[Asked], until: float = np.inf, coarse: bool = False
    ) -> list[NDArray[np.float64]]:
        del coarse
        return super().predict(asked, until)


def columns(rig: HopperRig, runs: Sequence[int]) -> tuple[Layout, NDArray[np.float64]]:
    layout = Layout(rig)
    noise = [Noise(np.full(len(r.channels), 3e-4), np.zeros(len(r.channels))) for r in rig.runs]
    problem = Problem(rig, layout, noise, runs)
    linear = problem.linear(np.zeros(len(layout)), np.arange(len(layout)))
    return layout, np.concatenate(linear.jacobians)


@pytest.fixture(scope="module")
def rigs() -> tuple[HopperRig, HopperRig]:
    runs = runs_of(truth(1, {}), 1, RUNS)
    return HopperRig(runs, DOCUMENT, SHAPE), InOwnSteps(runs, DOCUMENT, SHAPE)


@pytest.mark.long
def test_long_steps_tell_the_same_derivatives_with_the_foot_held(
    rigs: tuple[HopperRig, HopperRig],
) -> None:
    (layout, coarse), (_, exact) = (columns(rig, HELD) for rig in rigs)
    size = np.linalg.norm(exact, axis=0)
    felt = size > 1e-3 * np.sqrt(len(exact))
    assert felt.sum() > 40
    cosine = np.sum(coarse * exact, axis=0)[felt] / (np.linalg.norm(coarse, axis=0) * size)[felt]
    worst = np.argsort(cosine)[:3]
    names = [layout.unknowns[i].name for i in np.flatnonzero(felt)[worst]]
    print("least alike:", dict(zip(names, cosine[worst], strict=True)))
    assert cosine.min() > 0.998, names
    assert np.linalg.norm(coarse, axis=0)[felt] / size[felt] == pytest.approx(1, abs=0.02)


@pytest.mark.long
def test_steps_twice_as_long_tell_the_derivatives_of_a_hop(
    rigs: tuple[HopperRig, HopperRig],
) -> None:
    (layout, coarse), (_, exact) = (columns(rig, HOP) for rig in rigs)
    size = np.linalg.norm(exact, axis=0)
    felt = size > 1e-3 * np.sqrt(len(exact))
    assert felt.sum() > 40
    cosine = np.sum(coarse * exact, axis=0)[felt] / (np.linalg.norm(coarse, axis=0) * size)[felt]
    worst = np.argsort(cosine)[:3]
    names = [layout.unknowns[i].name for i in np.flatnonzero(felt)[worst]]
    print("least alike:", dict(zip(names, cosine[worst], strict=True)))
    assert cosine.min() > 0.8, names
    assert np.percentile(cosine, 10) > 0.95, names


@pytest.mark.parametrize("speed", [17.0, 19.0])
def test_a_hop_is_compared_no_longer_than_straight_lines_tell_of_it(speed: float) -> None:
    """Derivatives by small and by larger steps part after 2 s (decision 11)."""
    rig = HopperRig(runs_of(truth(1, {}), 1, [Run("hop", speed, 6.0)]), DOCUMENT, SHAPE)
    assert 1.0 <= rig.runs[0].times[-1] <= 2.0


@pytest.mark.long
def test_causes_are_derived_by_steps_that_whole_runs_answer_in_proportion() -> None:
    """Ten seconds beside a resonance: a hundredth of the stiffness moves T by ten times the noise.

    What a release makes of a step too long is no base number, and would be taken for a cause.
    """
    rig = HopperRig(runs_of(truth(1, {}), 1, [Run("clamped", 13.0, 10.0)]), DOCUMENT, SHAPE)
    layout = Layout(rig)
    noise = [Noise(np.full(len(r.channels), 3e-4), np.zeros(len(r.channels))) for r in rig.runs]
    problem = Problem(rig, layout, noise, (0,))
    names = [name for name in layout.of_cause if name not in layout.numerics]
    asked = layout.quantities(tuple(names))
    whole = problem.linear(np.zeros(len(layout)), asked).jacobians[0][:, asked]
    problem.steps[asked] /= 2
    half = problem.linear(np.zeros(len(layout)), asked).jacobians[0][:, asked]
    size = np.linalg.norm(half, axis=0)
    felt = np.flatnonzero(size > 1e-3 * np.sqrt(len(half)))
    off = np.linalg.norm(whole - half, axis=0)[felt] / size[felt]
    worst = felt[np.argsort(-off)[:3]]
    print({layout.unknowns[asked[i]].name: round(float(o), 4)
           for i, o in zip(worst, np.sort(off)[::-1], strict=False)})  # fmt: skip
    assert off.max() < 0.02, [layout.unknowns[asked[i]].name for i in worst]
