"""Robots at rest are kept: a start is the same to the last bit, whatever was asked for before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bank.courses import Course
from tests.fit.filmed import ROBOT, measured, ramp, twin_motion
from workbench.fit import Hopper, Parameter, Scope
from workbench.fit.observer import Start
from workbench.fit.systems import hopper_rest
from workbench.fit.systems.hopper_rest import held, rest_of
from workbench.sim import applied, read_chain

K3 = Parameter("hinge_cubic_stiffness k3", "N m/rad^3", 0.0, 20.0, scope=Scope.CANDIDATE)
TILT = Parameter("camera_tilt tilt", "rad", 0.0, 0.01, scope=Scope.CANDIDATE)
CANDIDATES = {K3: ("hinge_cubic_stiffness", "k3"), TILT: ("camera_tilt", "tilt")}


@pytest.fixture(scope="module")
def system() -> Hopper:
    courses = [Course("clamped", 1.0, ramp(13.0)), Course("decay", 1.0, pull=0.4)]
    courses += [Course("drop", 0.5, height=0.02)]
    runs = [measured(twin_motion(one), one, k) for k, one in enumerate(courses)]
    return Hopper(ROBOT, runs, candidates=CANDIDATES)


@pytest.fixture(autouse=True)
def _nothing_kept() -> None:
    rest_of.cache_clear()
    held.cache_clear()


def numbers(start: Start) -> tuple[bytes, ...]:
    """Return all that a simulation takes from a start."""
    seen, chain = start.observation, start.chain
    assert chain is not None
    of_chain = (chain.links, chain.actuators, chain.ground, chain.laws)
    given = (start.state, start.control, seen.bias, seen.offsets, seen.mix, *of_chain)
    scalars = np.array([start.steps, start.lead, chain.step, *start.follow])
    return tuple(each.tobytes() for each in (scalars, *given))


@pytest.mark.parametrize("run", range(3), ids=["clamped", "decay", "drop"])
def test_a_start_is_the_same_whatever_was_asked_for_before(system: Hopper, run: int) -> None:
    own = system.own[run].every
    asked = [({}, coarse) for coarse in (False, True)]
    asked += [({p: p.nominal + p.deviation}, True) for p in (K3, TILT, *own)]
    fresh = []
    for values, coarse in asked:
        rest_of.cache_clear()
        held.cache_clear()
        fresh.append(numbers(system.start(run, values, coarse)))
    rest_of.cache_clear()
    for _ in range(2):
        for (values, coarse), expected in zip(asked, fresh, strict=True):
            assert numbers(system.start(run, values, coarse)) == expected
    assert len(set(fresh)) == len(asked)


def test_an_instant_of_release_or_a_place_of_t_asks_for_no_other_robot(system: Hopper) -> None:
    late, place = system.own[1].late, system.own[1].place
    assert late is not None
    for parameter in (late, *place):
        system.start(1, {parameter: parameter.deviation}, True)
    assert (rest_of.cache_info().misses, rest_of.cache_info().hits) == (1, 2)
    system.start(1, {K3: K3.deviation}, True)
    system.start(1, {}, False)
    assert rest_of.cache_info().misses == 3


@pytest.mark.parametrize("coarse", [False, True])
@pytest.mark.parametrize("run", range(3), ids=["clamped", "decay", "drop"])
def test_a_run_s_own_stiffness_is_that_of_a_stiffer_robot(
    system: Hopper, run: int, coarse: bool
) -> None:
    own = Hopper(ROBOT, system.runs, turned=system.turned, warmth=0.01)
    stiffer = own.own[run].stiffer
    assert stiffer is not None
    values = {name: 1.04 * ROBOT.values[name] for name in ("hinge_stiffness", "root_stiffness")}
    # dampers are stated by themselves
    other = Hopper(replace(ROBOT, values={**ROBOT.values, **values}), system.runs,
                   turned=system.turned)  # fmt: skip
    one, same = own.start(run, {stiffer: 0.04}, coarse), other.start(run, {}, coarse)
    usual = own.start(run, {}, coarse)
    assert one.chain is not None
    assert same.chain is not None
    assert np.allclose(one.chain.links, same.chain.links, rtol=1e-12, atol=1e-15)
    assert np.abs(one.state - same.state).max() < 1e-9
    assert np.abs(one.state - usual.state).max() > 1e-4


@pytest.mark.parametrize("run", range(3), ids=["clamped", "decay", "drop"])
def test_a_robot_that_is_no_chain_rests_by_the_engine_s_forces(
    system: Hopper, run: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = Hopper(ROBOT, system.runs, turned=system.turned, warmth=0.01)
    stiffer = own.own[run].stiffer
    assert stiffer is not None
    ours = own.start(run, {stiffer: 0.04}, False)
    for name in ("chain_of", "read_chain"):
        monkeypatch.setattr(hopper_rest, name, lambda *_: None)
    for cache in (hopper_rest._compiled, rest_of, held):
        cache.cache_clear()
    engine = own.start(run, {stiffer: 0.04}, False)
    hopper_rest._compiled.cache_clear()
    assert engine.chain is None
    assert ours.chain is not None
    read = read_chain(engine.model)
    assert read is not None
    assert np.allclose(read.links, ours.chain.links, rtol=1e-12, atol=1e-15)
    assert np.abs(ours.state - engine.state).max() < 1e-9


def test_a_robot_is_compiled_once_for_all_runs_whose_foot_is_held(system: Hopper) -> None:
    own = Hopper(ROBOT, system.runs, turned=system.turned, warmth=0.01)
    compiled = hopper_rest._compiled
    compiled.cache_clear()
    for k, run in enumerate(own.own[:2]):
        assert run.stiffer is not None
        for share in (0.0, 0.01, 0.02):
            own.start(k, {run.stiffer: share}, True)
    assert rest_of.cache_info().misses == 6
    assert compiled.cache_info().misses == 1


def test_robots_are_equal_by_what_they_are_and_not_by_when_they_were_made() -> None:
    hidden = {"hinge_cubic_stiffness": {"k3": 40.0}, "root_play": {"gap": 0.002}}
    one, same = (applied(replace(ROBOT, effects=dict(hidden))) for _ in range(2))
    assert one == same
    assert hash(one) == hash(same)
    other = applied(replace(ROBOT, effects=hidden | {"root_play": {"gap": 0.001}}))
    assert other != one
