"""Whether intervals hold the truth as often as they say, where clutter and strangers are about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose.paper import CAUSES, TERMS, PaperRig, cause, measured
from workbench.diagnose.hypotheses import doubt_of
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


def fitted(rig: PaperRig) -> tuple[Hypothesis, float]:
    """Return the wobble fitted to the runs to fit, and how far chance moves what is left."""
    train = (0, 1, 2)
    layout = Layout(rig)
    problem = Problem(rig, layout, noise_of(rig.runs, train), train)
    z = np.zeros(len(layout))
    linear = problem.linear(z, np.arange(len(layout)))
    found = fit(problem, z, prior_of(layout, ("wobble",)), linear=linear)
    return judged(problem, ("wobble",), found), doubt_of(problem)


@pytest.fixture(autouse=True)
def _wandering(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let there be a cause that looks much like a wobble."""
    monkeypatch.setitem(TERMS, "wander", lambda t, a: 1e-3 * np.sin(10.7 * t))


def coverage(
    clutter: float = 0.0, strange_m: float = 0.0, same: bool = False
) -> tuple[float, float]:
    """Return how often 90 % intervals hold the truth: ours, and those of the noise alone.

    Args:
        clutter: of every other cause, in what clutter is taken to be.
        strange_m: size of a swing in each run that no cause explains [m].
        same: whether that is the same swing in all runs.
    """
    hits = np.zeros(2)
    for seed in range(DRAWS):
        rng = np.random.default_rng([seed, 7])
        little = {name: clutter * rng.standard_normal() * one for name, one in LITTLE.items()}
        rig = measured(seed, {"wobble": TRUE, **little})
        one, doubt = fitted(with_strangers(rig, strange_m, rng, same))
        layout, prior = one.near.layout, prior_of(one.near.layout, ("wobble",))
        (i,) = layout.of_cause["wobble"]
        off = abs(layout.value(int(i), float(one.fit.z[i])) - TRUE) / layout.unknowns[i].tolerance
        at = np.searchsorted(prior.free, i)
        alone = np.linalg.inv(prior.added_to(one.fit.linear.curvature))[at, at]
        hits += off <= spread(one, "wobble", doubt).within90[0], off <= 1.645 * np.sqrt(alone)
    ours, plain = hits / DRAWS
    print(f"holds the truth: {ours:.2f}; where noise alone is counted {plain:.2f}")
    return float(ours), float(plain)


def with_strangers(rig: PaperRig, size_m: float, rng: np.random.Generator, same: bool) -> PaperRig:
    """Return a rig with a swing in each run, of any size and phase.

    It is near the wobble's frequency; one that all runs have in common is at any.
    """
    runs, drawn = [], rng.standard_normal((len(rig.runs), 2))
    speed = rng.uniform(8, 14) if same else 11.2  # [rad/s]
    for k, run in enumerate(rig.runs):
        sine, cosine = np.sin(speed * run.times), np.cos(speed * run.times)
        swing = size_m * (drawn[0 if same else k] @ [sine, cosine])
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


def test_intervals_hold_the_truth_beside_what_all_runs_have_in_common() -> None:
    """No run tells of it by pulling its own way."""
    ours, plain = coverage(strange_m=1e-4, same=True)
    assert ours >= LEAST
    assert plain < LEAST
