"""Whether intervals hold the truth as often as they say, where clutter and strangers are about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose.paper import CAUSES, TERMS, PaperRig, cause, measured
from workbench.diagnose.intervals import spread
from workbench.diagnose.judging import Hypothesis, judged
from workbench.diagnose.layout import Layout
from workbench.diagnose.minimum import prior_of
from workbench.diagnose.noise import noise_of
from workbench.diagnose.problem import Problem
from workbench.diagnose.solve import fit

TRUE = 0.5
LITTLE = {"creep": 4.3e-3, "hardening": 7.9e-4, "scale": 1.1e-3, "wander": 2.1e-2}
"""Amounts that leave 0.05 noise deviations of a run's fit."""
DRAWS = 100
LEAST = 0.82


def fitted(rig: PaperRig) -> Hypothesis:
    """Return the wobble fitted to the runs to fit."""
    train = (0, 1, 2)
    layout = Layout(rig)
    problem = Problem(rig, layout, noise_of(rig.runs, train), train)
    z = np.zeros(len(layout))
    linear = problem.linear(z, np.arange(len(layout)))
    found = fit(problem, z, prior_of(layout, ("wobble",)), linear=linear)
    return judged(problem, ("wobble",), found)


@pytest.fixture(autouse=True)
def _wandering(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let there be a cause that looks much like a wobble."""
    monkeypatch.setitem(TERMS, "wander", lambda t, a: 1e-3 * np.sin(10.7 * t))


def coverage(clutter: float = 0.0, strange_m: float = 0.0) -> tuple[float, float]:
    """Return how often 90 % intervals hold the truth: ours, and those of the noise alone.

    Args:
        clutter: of every other cause, in what clutter is taken to be.
        strange_m: size of a swing in each run that no cause explains [m].
    """
    hits = np.zeros(2)
    for seed in range(DRAWS):
        rng = np.random.default_rng([seed, 7])
        little = {name: clutter * rng.standard_normal() * one for name, one in LITTLE.items()}
        rig = measured(seed, {"wobble": TRUE, **little})
        one = fitted(with_strangers(rig, strange_m, rng))
        layout, prior = one.near.layout, prior_of(one.near.layout, ("wobble",))
        (i,) = layout.of_cause["wobble"]
        off = abs(layout.value(int(i), float(one.fit.z[i])) - TRUE) / layout.unknowns[i].tolerance
        at = np.searchsorted(prior.free, i)
        alone = np.linalg.inv(prior.added_to(one.fit.linear.curvature))[at, at]
        hits += off <= spread(one, "wobble").within90[0], off <= 1.645 * np.sqrt(alone)
    ours, plain = hits / DRAWS
    print(f"holds the truth: {ours:.2f}; where noise alone is counted {plain:.2f}")
    return float(ours), float(plain)


def with_strangers(rig: PaperRig, size_m: float, rng: np.random.Generator) -> PaperRig:
    """Return a rig with a swing near the wobble's frequency in each run, of any size and phase."""
    runs = []
    for run in rig.runs:
        sine, cosine = np.sin(11.2 * run.times), np.cos(11.2 * run.times)
        swing = size_m * (rng.standard_normal(2) @ [sine, cosine])
        runs.append(replace(run, values=run.values + swing[:, None]))
    return replace(rig, runs=tuple(runs), causes=(*CAUSES, cause("wander")))


def test_intervals_hold_the_truth_in_noise() -> None:
    ours, plain = coverage()
    assert ours >= LEAST
    assert plain >= LEAST


def test_intervals_hold_the_truth_in_clutter() -> None:
    ours, plain = coverage(clutter=1.0)
    assert ours >= LEAST
    assert plain < LEAST


def test_intervals_hold_the_truth_beside_what_nothing_explains() -> None:
    ours, plain = coverage(strange_m=1e-4)
    assert ours >= LEAST
    assert plain < 0.6
