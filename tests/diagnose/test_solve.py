"""The minimum between bounds, and the way to that of the true problem, beside scipy's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares, lsq_linear

from tests.diagnose.paper import PaperRig, measured
from workbench.diagnose import solve
from workbench.diagnose.layout import Layout
from workbench.diagnose.minimum import Prior, prior_of, step_from
from workbench.diagnose.noise import noise_of
from workbench.diagnose.problem import Problem
from workbench.diagnose.rig import Asked
from workbench.diagnose.solve import ENOUGH, fit


@pytest.mark.parametrize("seed", range(20))
def test_a_step_ends_at_the_minimum_within_all_bounds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    layout = Layout(measured(seed))
    count = len(layout)
    layout.low[:] = -rng.uniform(0.0, 1.0, count) * rng.integers(0, 2, count)
    layout.high[:] = rng.uniform(0.0, 1.0, count)
    mixing = rng.normal(size=(count + 3, count)) * 10 ** rng.uniform(-2, 2, count)
    mixing[:, 1] = mixing[:, 0] * 1.1 + 0.01 * mixing[:, 1]  # two that look alike
    curvature, slope = mixing.T @ mixing, mixing.T @ rng.normal(size=count + 3) * 3
    prior = Prior(10 ** rng.uniform(-2, 2, count), np.arange(count))
    step = step_from(layout, np.zeros(count), curvature, slope, prior)
    root = cholesky(prior.added_to(curvature))
    wanted = solve_triangular(root, slope, trans=1)
    theirs = lsq_linear(root, wanted, (layout.low - 1e-12, layout.high + 1e-12), method="bvls").x
    assert np.any((step.z == layout.low) | (step.z == layout.high))
    assert np.all((step.z >= layout.low) & (step.z <= layout.high))
    off = np.linalg.norm(root @ step.z - wanted) - np.linalg.norm(root @ theirs - wanted)
    assert abs(off) < 1e-6 * np.linalg.norm(wanted)


@pytest.mark.parametrize("seed", range(10))
def test_a_fit_follows_a_curved_valley_to_its_end(seed: int) -> None:
    rig = Counting(**vars(measured(seed, {"hardening": 0.08})))
    layout = Layout(rig)
    problem = Problem(rig, layout, noise_of(rig.runs, (0, 1, 2)), (0, 1, 2))
    prior = prior_of(layout, ("hardening",))
    begin = np.random.default_rng(seed).uniform(-1, 1, len(layout))
    begin[layout.base] *= 3.0  # at the end of a run the phase is up to 1.8 rad off
    begin[np.setdiff1d(np.arange(len(layout)), prior.free)] = 0.0
    free = prior.free

    def theirs(at: np.ndarray) -> np.ndarray:
        z = np.zeros(len(layout))
        z[free] = at
        return np.concatenate([*problem.residuals(z), np.sqrt(prior.precision[free]) * at])

    low, high = layout.low[free], layout.high[free]
    best = least_squares(theirs, np.zeros(len(free)), bounds=(low, high), x_scale="jac")
    asked = len(Counting.asked)
    found = fit(problem, begin, prior)
    assert found.cost < best.cost + ENOUGH, f"{found.cost:.1f} where scipy finds {best.cost:.1f}"
    assert len(Counting.asked) - asked < 60 * len(problem.runs)


class Counting(PaperRig):
    """Writes down what was asked for."""

    asked: ClassVar[list[Asked]] = []

    def predict(
        self, asked: Sequence[Asked], until: float = np.inf, coarse: bool = False
    ) -> list[np.ndarray]:
        """Count, and answer."""
        self.asked.extend(asked)
        return super().predict(asked, until, coarse)


class Biased(PaperRig):
    """Predicts a little too much in coarse steps, or a tenth too little."""

    fine: ClassVar[list[Asked]] = []
    missing: ClassVar[float] = 0.0

    def predict(
        self, asked: Sequence[Asked], until: float = np.inf, coarse: bool = False
    ) -> list[np.ndarray]:
        """Count what is asked in fine steps; twist what is asked in coarse ones."""
        found = super().predict(asked, until)
        if not coarse:
            self.fine.extend(asked)
            return found
        twist = 1.0 - self.missing
        return [1.01 * twist * values + 1e-3 for values in found]


@pytest.mark.parametrize("missing", [0.0, 0.1])
def test_trials_in_coarse_steps_end_where_fine_ones_do(
    missing: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is told is true, also where coarse steps miss a tenth of what moves."""
    monkeypatch.setattr(Biased, "missing", missing)
    fits = []
    for kind in (Counting, Biased):
        rig = kind(**vars(measured(3, {"hardening": 0.08})))
        layout = Layout(rig)
        problem = Problem(rig, layout, noise_of(rig.runs, (0, 1, 2)), (0, 1, 2))
        prior = prior_of(layout, ("hardening",))
        begin = np.zeros(len(layout))
        begin[layout.base] = 0.6, -0.4
        linear = Problem(Counting(**vars(rig)), layout, problem.noise, problem.runs).linear(
            begin, prior.free
        )
        asked = len(Biased.fine)
        fits.append(fit(problem, begin, prior, linear=linear))
    trials = (len(Biased.fine) - asked) / len(problem.runs)
    true = problem.residuals(fits[1].z)
    for told, really in zip(fits[1].residuals, true, strict=True):
        np.testing.assert_allclose(told, really, atol=1e-9)
    assert fits[1].cost < fits[0].cost + 2 * ENOUGH
    print(f"{trials:g} times all runs in fine steps")
    assert trials < 12


def test_a_fit_that_coarse_steps_misled_does_not_end_dearer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Biased, "missing", 0.7)
    rig = Biased(**vars(measured(3, {"hardening": 0.08})))
    layout = Layout(rig)
    problem = Problem(rig, layout, noise_of(rig.runs, (0, 1, 2)), (0, 1, 2))
    prior, begin = prior_of(layout, ("hardening",)), np.zeros(len(layout))
    linear = Problem(Counting(**vars(rig)), layout, problem.noise, problem.runs).linear(
        begin, prior.free
    )
    before = sum(float(one @ one) for one in linear.residuals) / 2
    found = fit(problem, begin, prior, linear=linear, settle=False)
    print(f"{before:.1f} before, {found.cost:.1f} after")
    assert found.cost <= before


def test_what_a_trial_teaches_changes_the_curvature_as_the_derivatives(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told = list[tuple[NDArray[np.float64], NDArray[np.float64]]]()
    whole = solve._Descent.step

    def step(way: Any) -> Any:
        found = whole(way)
        free = np.ix_(way._prior.free, way._prior.free)
        told.append((way._curvature[free], way.linear.curvature_of(way._prior.free)[free]))
        return found

    monkeypatch.setattr(solve._Descent, "step", step)
    rig = measured(3, {"hardening": 0.08})
    problem = Problem(rig, Layout(rig), noise_of(rig.runs, (0, 1, 2)), (0, 1, 2))
    fit(problem, np.zeros(len(problem.layout)), prior_of(problem.layout, ("hardening",)))
    assert len(told) > 4
    for kept, anew in told:
        np.testing.assert_allclose(kept, anew, rtol=1e-9, atol=1e-9 * np.abs(anew).max())
