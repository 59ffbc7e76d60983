"""The missing force: forces that are hidden are found, by their law and size."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.bank.courses import Course, Quantities
from tests.fit.filmed import ROBOT, measured, ramp, twin_motion
from workbench.diagnose import ABSENT, MissingForceAnalysis, missing_force
from workbench.diagnose.hypothesis import Hypothesis
from workbench.diagnose.missing import INDEPENDENT
from workbench.fit import Estimator, Hopper, ParameterVector
from workbench.motion import TOP
from workbench.timeseries import TimeSeries

DECAY = Course("decay", 4.0, pull=0.8)
CLAMPED = Course("clamped", 4.0, ramp(8.5))
DRAG: Quantities = {"air_drag": {"c": 0.1}}
COULOMB: Quantities = {"hinge_coulomb_friction": {"torque": 1e-3}}
CUBIC: Quantities = {"hinge_cubic_stiffness": {"k3": 300.0}}
EMPTY = np.zeros((0, 0))


def hypothesis(system: Hopper, noise: float = 0.5) -> Hypothesis:
    """The nominal robot, observed with a share of the strong process noise."""
    vector = ParameterVector(system.parameters)
    process = {group: noise * q for group, q in system.strong.items()}
    estimator = Estimator.of(system, vector, process, threads=1)
    x = np.array([p.number(p.nominal) for p in vector.parameters])
    return Hypothesis((), estimator, x, (), 0.0, EMPTY)


@cache
def found(*courses: Course, hidden: str = "") -> MissingForceAnalysis:
    effects = {"": {}, "drag": DRAG, "coulomb": COULOMB, "cubic": CUBIC}[hidden]
    runs = [measured(twin_motion(one, effects), one, k) for k, one in enumerate(courses)]
    system = Hopper(ROBOT, runs)
    if "clamped" in [one.mode for one in courses]:
        base = hypothesis(system, 1.0)
        system = system.refined([i.qpos for i in base.estimator.innovations(base.x, keep=True)])
    missing = missing_force(hypothesis(system))
    assert missing is not None
    return missing


def test_nothing_is_missing_where_nothing_is_hidden() -> None:
    missing = found(DECAY)
    assert missing.sentence == ABSENT
    assert missing.power == pytest.approx(1.0, abs=0.25), "the cameras' noise is foretold"


def test_air_is_found_as_a_force_against_the_motion_with_the_square_of_speed() -> None:
    missing = found(DECAY, hidden="drag")
    best = missing.dependences[0]
    assert best.name.startswith("velocity")
    assert best.law == "with the square of speed"
    assert best.share > 0.9
    assert missing.sentence.startswith("a force at T against the motion, ")
    assert missing.sentence.endswith(f"({100 * best.share:.0f} % of what is missing)")


def test_the_size_of_a_hidden_force_is_told_in_newtons() -> None:
    motion = twin_motion(DECAY, DRAG).between(0.1, 3.9)
    velocity = np.gradient(np.column_stack([motion[TOP[0]], motion[TOP[2]]]), motion.times, axis=0)
    force = 0.1 * np.linalg.norm(velocity, axis=1) * np.linalg.norm(velocity, axis=1)
    best = found(DECAY, hidden="drag").dependences[0]
    assert best.size == pytest.approx(float(np.sqrt(np.mean(force**2))), rel=0.15)


def test_dry_friction_is_found_as_independent_of_speed() -> None:
    missing = found(DECAY, CLAMPED, hidden="coulomb")
    best = missing.dependences[0]
    assert best.name.startswith("velocity")
    assert best.law == "independent of speed"
    assert ", independent of speed (" in missing.sentence


def test_a_beam_that_stiffens_is_found_by_the_place_of_the_top() -> None:
    missing = found(DECAY, hidden="cubic")
    best = missing.dependences[0]
    assert best.name.startswith("displacement")
    assert best.law == "with its cube"
    assert "towards the middle of its motion" in missing.sentence


def test_the_worst_run_lacks_most_and_only_a_driven_one_has_a_rotor_that_turns() -> None:
    missing = found(DECAY, CLAMPED, hidden="coulomb")
    decay, clamped = missing.forces
    assert missing.worst.rms == max(decay.rms, clamped.rms)
    assert "rotor's angle" in clamped.coordinates
    assert "rotor's angle" not in decay.coordinates
    assert clamped.force.shape == clamped.sigma.shape == (len(clamped.times), 2)


def shaken(seed: int) -> Hopper:
    """A decay whose top is off by what no coordinate tells, with a memory of a tenth of a second.

    Without a longer one: what drifts does depend on time.
    """
    seen, rng = measured(twin_motion(DECAY), DECAY, 3), np.random.default_rng(seed)
    motion = seen.motion
    white = rng.standard_normal(len(motion.times))
    off = 1e-3 * np.asarray(lfilter([1.0], [1.0, -0.9], white))
    columns = {name: motion[name] for name in motion.names}
    columns[TOP[0]] = columns[TOP[0]] + np.where(motion.times > 0, off, 0.0)
    return Hopper(ROBOT, [replace(seen, motion=TimeSeries.of(motion.times, columns))])


def test_chance_is_seldom_told_as_a_dependence() -> None:
    """Of seeds 1 to 140 one was (39)."""
    told = [missing_force(hypothesis(shaken(seed), 1.0)) for seed in range(5)]
    assert sum(one is not None and one.sentence == INDEPENDENT for one in told) >= 4


def test_what_is_no_hopping_robot_has_none() -> None:
    class Other:
        estimator = type("E", (), {"system": object(), "noise": {}})()

    assert missing_force(Other()) is None  # pyright: ignore[reportArgumentType]
