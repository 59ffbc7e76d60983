"""Planar chains step as the engine does; what is no planar chain is left to the engine.

They are compared with centrifugal forces at the engine's speeds; what taking them ahead gains is
tested in `test_sim_convergence.py`.
"""

from __future__ import annotations

import copy
from contextlib import AbstractContextManager
from dataclasses import replace
from unittest import mock

import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch

from tests.sim.rigs import with_effect
from workbench.sim import (
    EFFECTS,
    Condition,
    Drive,
    Robot,
    Simulation,
    Statics,
    Stepper,
    applied,
    at_rest,
    moving_dofs,
    simulate,
)
from workbench.sim.chain import PlanarChain, read_chain
from workbench.sim.statics import RotorKeeps

SAMPLES = 90
CONDITIONS = {
    "hop": Condition("hop", np.full(SAMPLES, 17.0)),
    "clamped": Condition("clamped", np.full(SAMPLES, 13.0)),
    "decay": Condition("decay", np.zeros(SAMPLES), pull=0.4),
    "drop": Condition("drop", np.zeros(SAMPLES), height=0.02),
    "torque": Condition("clamped", np.full(SAMPLES, 0.01), drive="torque"),
}
ALIKE, ALIKE_ON_THE_GROUND = 1e-11, 1e-6
"""[m, rad]; rounding alone: measured 1e-14 in what is clamped. A corner that grips where its load
just suffices magnifies it: measured 1e-17 before and up to 5e-8 after one did."""
EXACT = 1e-15
"""Tolerance of the engine's solver of dry friction; by its default, 1e-8, T is 1e-7 m off."""

BOOM = """
<mujoco><option integrator="implicitfast" timestep="0.001" gravity="{gravity}"/><worldbody>
  <body pos="0.1 0.02 1" quat="0.9 0 0.1 0">
    <inertial pos="0.02 0 0.01" mass="0.3" fullinertia="0.002 0.003 0.002 0 0.0002 0"/>
    <joint name="a" axis="0 1 0" damping="0.01 0.02 0.03" armature="0.001" ref="0.2"/>
    <body pos="0.2 0 0.1"><inertial pos="0 0 0.1" mass="0.1" diaginertia="0.001 0.002 0.001"/>
      <body pos="0.1 0.05 0.2" quat="0.8 0 -0.3 0">
        <inertial pos="0.05 0 0" mass="0.2" diaginertia="0.001 0.001 0.001"/>
        <joint name="b" axis="{axis}" stiffness="2 0.5 3" springref="0.3" {extra}/>
      </body></body></body></worldbody>
  <actuator><general joint="b" gainprm="2" biastype="affine" biasprm="0.1 -2 -0.05"/>
    <motor joint="a" gear="{gear}"/></actuator></mujoco>
"""
PLAIN = {"gravity": "1 0 -9.81", "axis": "0 1 0", "extra": "", "gear": "1"}


def by_engine(robot: Robot, condition: Condition) -> Simulation:
    exact = replace(robot, edits=(*robot.edits, _exactly))
    with mock.patch("workbench.sim.stepper.read_chain", return_value=None):
        return simulate(exact, condition)


def _exactly(spec: mujoco.MjSpec, robot: Robot) -> None:
    spec.option.tolerance, spec.option.ls_tolerance = EXACT, 1e-8


def alike(condition: Condition) -> float:
    return ALIKE if condition.foot == "fixed" else ALIKE_ON_THE_GROUND


def by_chain(robot: Robot, condition: Condition) -> Simulation:
    """Simulate with centrifugal forces at the speeds of the step before, as the engine has them."""
    with first_order():
        return simulate(robot, condition)


def first_order() -> AbstractContextManager[object]:
    """Let chains that are read within it be stepped by the engine's own rule."""
    return mock.patch("workbench.sim.stepper.read_chain", _as_engine)


def _as_engine(model: mujoco.MjModel) -> PlanarChain | None:
    chain = read_chain(model)
    return None if chain is None else replace(chain, ahead=0.0)


def apart(robot: Robot, condition: Condition) -> float:
    """Return the greatest difference of a place or an angle between both ways."""
    ours, engine = by_chain(robot, condition).motion, by_engine(robot, condition).motion
    names = [name for name in engine.names if name.endswith(("_m", "_rad"))]
    return max(float(np.abs(ours[name] - engine[name]).max()) for name in names)


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("name", CONDITIONS)
def test_the_robot_moves_as_the_engine_moves_it(robot: Robot, name: str, planar: bool) -> None:
    found, condition = replace(robot, planar=planar), CONDITIONS[name]
    assert read_chain(at_rest(found, condition)[0]) is not None
    assert 0 < apart(found, condition) < alike(condition)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_acts_as_in_the_engine(robot: Robot, name: str) -> None:
    effect = EFFECTS[name]
    changed = with_effect(robot, name, **{q.name: q.tolerance for q in effect.quantities})
    condition = CONDITIONS[effect.excited_by[0]]
    assert apart(changed, condition) < alike(condition)
    assert read_chain(at_rest(applied(changed), condition)[0]) is not None


@pytest.mark.parametrize("torque", [1e-4, 1e-2])
@pytest.mark.parametrize("condition", ["hop", "clamped", "decay"])
def test_dry_friction_is_that_of_the_engine(robot: Robot, condition: str, torque: float) -> None:
    rubbing = with_effect(robot, "hinge_coulomb_friction", torque=torque)
    assert 0 < apart(rubbing, CONDITIONS[condition]) < alike(CONDITIONS[condition])


def test_dry_friction_of_many_hinges_is_that_of_the_engine(robot: Robot) -> None:
    """Step by step: with 31 hinges that stick and slip, one rounding grows to micrometres.

    So it does between two runs of the engine whose beams differ by 1e-14 of their mass.
    """
    many = replace(with_effect(robot, "hinge_coulomb_friction", torque=1e-3), increments=32)
    exact = replace(many, planar=True, edits=(_exactly,))
    model, data = at_rest(applied(exact), CONDITIONS["decay"])
    batch = Batch(model, nsim=1, nthread=1, persistent=True)
    with first_order():
        stepper, apart = Stepper(batch, [model]), []
    for _ in range(2000):
        mujoco.mj_getState(model, data, batch.state[0], int(mujoco.mjtState.mjSTATE_INTEGRATION))
        batch.forward(stage=int(mujoco.mjtStage.mjSTAGE_VEL))
        stepper.step(1)
        mujoco.mj_step(model, data)
        apart.append(np.abs(batch.bind("qvel")[0] - data.qvel).max())
    assert read_chain(model) is not None
    assert 0 < max(apart) < 1e-10


def test_motor_power_and_forces_are_those_of_the_engine(robot: Robot) -> None:
    ours, engine = (way(robot, CONDITIONS["hop"]).motion for way in (by_chain, by_engine))
    for name in ("motor_power_W", "ground_x_N", "ground_z_N", "corners_touching"):
        assert np.ptp(engine[name]) > 0
        assert np.abs(ours[name] - engine[name]).max() < 1e-6, name


@pytest.mark.parametrize("keeps", ["world", "top"])
@pytest.mark.parametrize("condition", ["hop", "decay"])
def test_the_statics_are_those_of_the_engine(
    robot: Robot, condition: str, keeps: RotorKeeps
) -> None:
    """With a pull on T, a slope, a play and a cable, each of which has its part in it.

    Friction in the hinges has none at rest.
    """
    effects = {
        "root_play": {"gap": 0.01},
        "tether": {"pull": 0.05, "stiffness": 3.0},
        "hinge_coulomb_friction": {"torque": 3e-4},
    }
    bent = replace(applied(replace(robot, effects=effects)), slope=0.02)
    model, data = at_rest(bent, CONDITIONS[condition])
    data.xfrc_applied[model.body("top").id, [0, 2]] = 0.2, -0.1
    dofs = moving_dofs(model, CONDITIONS[condition].foot)
    chain = read_chain(model)
    assert chain is not None
    ours, engine = (Statics(model, data, dofs, keeps, one).balance() for one in (chain, None))
    assert np.abs(engine.stiffness).max() > 5
    assert np.abs(engine.force).max() > 0.01
    assert np.abs(ours.stiffness - engine.stiffness).max() < 1e-8
    assert np.abs(ours.force - engine.force).max() < 1e-12
    assert np.abs(ours.top - engine.top).max() < 1e-14
    assert np.abs(ours.slopes - engine.slopes).max() < 1e-9


@pytest.mark.parametrize("extra", ["", 'frictionloss="0.05"'])
def test_a_boom_of_another_kind_moves_as_in_the_engine(extra: str) -> None:
    model = mujoco.MjModel.from_xml_string(BOOM.format(**PLAIN | {"extra": extra}))
    model.opt.tolerance = EXACT
    assert read_chain(model) is not None
    batch, data = Batch(model, nsim=1, nthread=1, persistent=True), mujoco.MjData(model)
    batch.forward(stage=int(mujoco.mjtStage.mjSTAGE_VEL))
    stepper = Stepper(batch, [model])
    for k in range(40):
        batch.bind("ctrl")[:] = data.ctrl[:] = [np.sin(0.3 * k), 0.1]
        stepper.step(25)
        mujoco.mj_step(model, data, nstep=25)
        assert np.abs(batch.bind("qpos")[0] - data.qpos).max() < 1e-12
    assert np.abs(data.qpos).max() > 0.3
    assert batch.bind("time").item() == pytest.approx(1.0)


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("name", ["hop", "clamped"])
def test_places_alone_are_those_of_the_engine(robot: Robot, name: str, planar: bool) -> None:
    model, data = at_rest(replace(robot, planar=planar), CONDITIONS[name])
    shown_as_in_the_engine(model, data, 17.0)


def test_places_of_turned_bodies_without_a_hinge_are_those_of_the_engine() -> None:
    model = mujoco.MjModel.from_xml_string(BOOM.format(**PLAIN))
    shown_as_in_the_engine(model, mujoco.MjData(model), 0.5)


def shown_as_in_the_engine(model: mujoco.MjModel, data: mujoco.MjData, command: float) -> None:
    batch, whole = Batch(model, nsim=1, nthread=1, persistent=True), mujoco.mjtState
    mujoco.mj_getState(model, data, batch.state[0], int(whole.mjSTATE_INTEGRATION))
    batch.forward(stage=int(mujoco.mjtStage.mjSTAGE_VEL))
    with first_order():
        stepper = Stepper(batch, [model], places_alone=True)
    batch.bind("ctrl")[:] = data.ctrl[:] = command
    for _ in range(5):
        stepper.step(34)
        mujoco.mj_step(model, data, nstep=34)
    mujoco.mj_forward(model, data)
    hinges = model.jnt_type != int(mujoco.mjtJoint.mjJNT_SLIDE)
    for name, rows in (("xpos", slice(None)), ("xmat", slice(None)), ("xanchor", hinges)):
        ours, engine = getattr(stepper, name)[0], getattr(data, name)
        assert np.abs(ours[rows] - engine[rows]).max() < 1e-10, name
    assert np.abs(batch.bind("qpos")[0] - data.qpos).max() < 1e-10


@pytest.mark.parametrize(
    "change",
    [
        {"gravity": "0 1 -9.81"},
        {"axis": "0 1 0.1"},
        {"extra": 'frictionloss="0.1" solreffriction="-100 -10"'},
        {"extra": 'pos="0.01 0 0"'},
        {"extra": 'limited="true" range="-1 1"'},
        {"gear": "2"},
    ],
    ids=lambda change: next(iter(change)),
)
def test_what_is_no_planar_chain_is_left_to_the_engine(change: dict[str, str]) -> None:
    assert read_chain(mujoco.MjModel.from_xml_string(BOOM.format(**PLAIN | change))) is None


def test_a_motor_with_its_own_states_is_left_to_the_engine(robot: Robot) -> None:
    volts = Condition("clamped", np.full(9, 3.0), drive="voltage")
    assert read_chain(at_rest(robot, volts)[0]) is None
    assert apart(robot, volts) == 0.0


def test_numbers_that_blow_up_end_the_motion(robot: Robot) -> None:
    model, data = at_rest(robot, CONDITIONS["clamped"])
    model.opt.timestep *= 20
    batch = Batch(model, nsim=2, nthread=1, persistent=True)
    batch.bind("qpos")[:] = data.qpos
    batch.bind("qpos")[1, 3] += 0.5
    batch.forward(stage=int(mujoco.mjtStage.mjSTAGE_VEL))
    stepper = Stepper(batch, [model, model])
    for _ in range(60):
        stepper.step(34)
    assert stepper.broken.any()
    assert np.isfinite(batch.bind("qpos")).all()


@pytest.mark.parametrize("drive", ["speed", "voltage"])
def test_a_lead_is_so_many_steps_of_its_own(robot: Robot, drive: Drive) -> None:
    """Of each simulation that has one, by a chain and by the engine; of first order as its own."""
    condition = Condition("decay", np.zeros(2), pull=0.5, drive=drive)
    model, data = at_rest(robot, condition)
    data.qpos[:-1] += 0.01
    leads, whole = np.array([0.0, 0.004, 0.011]), int(mujoco.mjtState.mjSTATE_INTEGRATION)

    def batch_of(models: list[mujoco.MjModel]) -> Batch:
        batch = Batch(model, nsim=len(models), nthread=1, persistent=True)
        for row in batch.state:
            mujoco.mj_getState(model, data, row, whole)
        batch.set_models(models)
        batch.forward(stage=int(mujoco.mjtStage.mjSTAGE_VEL))
        return batch

    batch = batch_of([model] * 3)
    stepper = Stepper(batch, [model] * 3)
    stepper.lead(leads, 40)
    led = batch.state.copy()
    stepper.step(5)
    for row, lead in enumerate(leads):
        own = copy.copy(model)
        own.opt.timestep = max(lead, 1e-3) / 40
        alone = batch_of([own])
        with first_order():
            stepper_alone = Stepper(alone, [own])
        if lead:
            stepper_alone.step(40)
        assert np.abs(led[row] - alone.state[0]).max() < 1e-12
        after = batch_of([model])
        after.state[:] = led[row]
        Stepper(after, [model]).step(5)
        assert np.abs(batch.state[row] - after.state[0]).max() < 1e-9
    assert np.abs(led[2] - led[1]).max() > 1e-3


def test_many_unlike_chains_step_to_the_bits_of_each_alone(robot: Robot) -> None:
    """Eleven make more than one block; some rub, one blows up, and one is not asked."""
    model, data = at_rest(robot, CONDITIONS["hop"])
    rubbing = with_effect(robot, "hinge_coulomb_friction", torque=1e-3)
    other, _ = at_rest(applied(rubbing), CONDITIONS["hop"])
    models = [(model, other)[i % 2] for i in range(11)]
    state = np.empty(mujoco.mj_stateSize(model, int(mujoco.mjtState.mjSTATE_INTEGRATION)))
    mujoco.mj_getState(model, data, state, int(mujoco.mjtState.mjSTATE_INTEGRATION))

    def stepped(numbers: list[int], rows: list[int]) -> tuple[np.ndarray, np.ndarray]:
        some = [models[i] for i in numbers]
        batch = Batch(model, nsim=len(some), nthread=1, persistent=True)
        batch.state[:] = state
        batch.set_models(some)
        for row, i in enumerate(numbers):
            batch.bind("qpos")[row, -1] += 0.1 * i
            batch.bind("qvel")[row, -1] = 1e9 if i == 4 else 17.0
        batch.forward(stage=int(mujoco.mjtStage.mjSTAGE_VEL))
        stepper = Stepper(batch, some)
        stepper.step(60, np.array(rows, dtype=np.int32))
        return batch.state.copy(), stepper.broken

    asked = [0, 1, 2, 3, 4, 5, 6, 8, 9, 10]
    together, broken = stepped(list(range(11)), asked)
    assert broken.tolist() == [i == 4 for i in range(11)]
    for i in asked:
        assert np.array_equal(together[i], stepped([i], [0])[0][0]), i
    assert np.array_equal(together[7], stepped([7], [])[0][0])
    assert len(np.unique(together, axis=0)) == 11
