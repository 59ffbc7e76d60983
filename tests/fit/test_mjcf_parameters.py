"""Candidates that begin at zero, on a driven cart; what edits do to a model; refusals."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.fit.recovery import fitted, noise_like, ratios
from workbench.errors import InputError
from workbench.fit import (
    FIELDS,
    Acts,
    Channel,
    Edit,
    Free,
    Input,
    JointStart,
    MjcfRun,
    MjcfSystem,
    Scope,
    explicit_inertias,
)
from workbench.fit.systems.mjcf import SLIDES
from workbench.fit.systems.mjcf_parameters import parameter

Array = NDArray[np.float64]

GRAVITY = 9.81
PLACE_NOISE = 1e-4  # [m]
CART = """
<mujoco>
  <option timestep="0.0025" integrator="RK4"/>
  <worldbody>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0" stiffness="40" damping="0.5"/>
      <geom type="box" size="0.04 0.03 0.02" mass="0.5"/>
    </body>
  </worldbody>
  <actuator><motor name="coil" joint="rail"/></actuator>
</mujoco>
"""
HINGE = {"F": "N m", "L": "rad", "I": "kg m^2", "control": "control"}
SLIDE = {"F": "N", "L": "m", "I": "kg", "control": "control"}
TIMES, STAMPS = np.arange(0, 4, 0.01), np.arange(-0.1, 4, 0.004)


def sweep(t: Any) -> Any:
    return 2 * np.sin(2 * np.pi * (0.5 + 0.5 * t) * t) * (t > 0)


def moved(
    delay: float = 0.0, lag: float = 0.0, cubic: float = 0.0, quadratic: float = 0.0,
    friction: float = 0.0, tilt: float = 0.0, pulled: float = 0.0, late: float = 0.0,
    share: float = 0.0, offset: float = 0.0,
) -> Array:  # fmt: skip
    """Return the cart's true places, (n,), driven or let go from where it was pulled to."""

    def rates(t: float, x: Array) -> list[float]:
        command = 0.0 if pulled else (1 + share) * sweep(t - delay) + offset
        if pulled and t < late:
            return [0.0, 0.0, 0.0]
        force = (x[2] if lag else command) - 40 * x[0] - cubic * x[0] ** 3 - 0.5 * x[1]
        force -= quadratic * x[1] * abs(x[1]) + friction * np.tanh(x[1] / 1e-4)
        return [x[1], force / 0.5 - GRAVITY * np.sin(tilt), (command - x[2]) / lag if lag else 0.0]

    return solve_ivp(
        rates, (0, 4), (pulled, 0, 0), "LSODA", TIMES, rtol=1e-9, atol=1e-11, max_step=0.003
    ).y[0]


def cart(places: Array, free: list[Free], pulled: float = 0.0, late: float = 0.0) -> MjcfSystem:
    values = places + noise_like(places, PLACE_NOISE, np.random.default_rng(3))
    force = np.zeros_like(STAMPS) if pulled else sweep(STAMPS)
    run = MjcfRun(
        "run", TIMES, values[:, None], {"rail": JointStart(pulled)}, STAMPS, force[:, None], late
    )
    channels = [Channel("place", "position", "rail", sigma=PLACE_NOISE)]
    return MjcfSystem(
        mujoco.MjSpec.from_string(CART), channels, [run], [Input("force", "coil")], free
    )


CANDIDATES = [
    (Free("input_delay", "force", 0.01), {"delay": 0.015}, 0.015, 2e-4),
    (Free("input_lag", "force", 0.01), {"lag": 0.03}, 0.03, 3e-4),
    (Free("cubic_stiffness", "rail", 500), {"cubic": 2000}, 2000, 40),
    (Free("quadratic_damping", "rail", 0.5), {"quadratic": 1.5}, 1.5, 0.03),
    (Free("frictionloss", "rail", 0.05), {"friction": 0.1}, 0.1, 3e-3),
    (Free("input_scale", "force", 0.05), {"share": 0.1}, 0.1, 2e-3),
    (Free("input_offset", "force", 0.05), {"offset": 0.2}, 0.2, 4e-3),
    (Free("tilt_y", "", 0.01), {"tilt": 0.02}, 0.02, 4e-4),
]


@pytest.mark.parametrize(("free", "truth", "size", "within"), CANDIDATES)
def test_a_candidate_at_zero_grows_to_its_size(free, truth, size, within):
    system = cart(moved(**truth), [free])
    values, x, estimator = fitted(system, {SLIDES: 1e-3}, 0.1)
    assert values[system.parameters[0].name] == pytest.approx(size, abs=within)
    assert ratios(estimator, x) == pytest.approx(1, abs=0.05)
    assert ratios(estimator, np.zeros(1)) > 1.1


@pytest.mark.parametrize(("free", "truth", "size", "within"), CANDIDATES)
def test_a_candidate_that_is_not_there_stays_at_zero(free, truth, size, within):
    system = cart(moved(), [free])
    values, _, _ = fitted(system, {SLIDES: 3e-4}, 0.1)
    assert values[system.parameters[0].name] == pytest.approx(0, abs=within)


def test_scale_offset_and_delay_of_a_sensor_are_recovered():
    places = np.interp(TIMES - 0.003, TIMES, moved()) * 1.03 + 2e-3
    free = [
        Free("offset", "place", 1e-3),
        Free("scale", "place", 0.02),
        Free("delay", "place", 0.005),
    ]
    values, _, _ = fitted(cart(places, free), {SLIDES: 3e-4})
    assert values["place offset"] == pytest.approx(2e-3, abs=5e-5)
    assert values["place scale"] == pytest.approx(0.03, abs=3e-3)
    assert values["place delay"] == pytest.approx(0.003, abs=2e-4)


@pytest.mark.parametrize("late", [0.012, -0.0])
def test_a_release_at_an_uncertain_time_is_found(late):
    system = cart(moved(pulled=0.03, late=late), [Free("mass", "cart", 0.1)], 0.03, 0.01)
    values, x, estimator = fitted(system, {SLIDES: 1e-4})
    assert values["time zero of run"] == pytest.approx(late, abs=5e-4)
    assert values["cart mass"] == pytest.approx(0.5, rel=0.01)
    assert ratios(estimator, x) == pytest.approx(1, abs=0.05)


EVERYTHING = """
<mujoco>
  <compiler fusestatic="true"/>
  <worldbody>
    <body name="a" euler="0 30 0">
      <joint name="hinge" axis="0 1 0" stiffness="2 3 4" damping="0.1 0.2 0.3" springref="10"
             frictionloss="0.01" armature="0.02"/>
      <geom type="capsule" fromto="0 0 0 0.1 0 -0.2" size="0.02"/>
      <geom type="sphere" size="0.03" pos="0 0.02 0"/>
      <body name="b" pos="0 0 -0.3">
        <joint name="slide" type="slide" axis="0 0 1"/>
        <inertial pos="0.01 0 0" mass="0.2" fullinertia="0.002 0.003 0.004 0.0001 0.0002 0"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="servo" joint="hinge" kp="5"/></actuator>
</mujoco>
"""
OWNERS = {"body": "b", "joint": "hinge", "actuator": "servo", "gravity": ""}
OF_MODEL = [key for key, field in FIELDS.items() if field.acts is Acts.MODEL and not field.adds]


def test_explicit_inertias_compile_to_the_same_model():
    spec = mujoco.MjSpec.from_string(EVERYTHING)
    before, (_, after) = spec.compile(), explicit_inertias(spec)
    for name in ("body_mass", "body_inertia", "body_ipos", "dof_M0", "qpos_spring"):
        assert getattr(after, name) == pytest.approx(getattr(before, name)), name
    assert np.abs(np.sum(after.body_iquat * before.body_iquat, axis=1)) == pytest.approx(1)


@pytest.mark.parametrize("key", OF_MODEL)
def test_what_an_edit_writes_is_read_back_and_changes_the_acceleration(key):
    spec, _ = explicit_inertias(mujoco.MjSpec.from_string(EVERYTHING))
    found, edit = parameter(spec, Free(key, OWNERS[FIELDS[key].owner], 0.1), HINGE)
    changed = spec.copy()
    edit.apply(changed, found.nominal + 0.3)
    if key not in ("inertia", "tilt_x", "tilt_y"):  # those are relative to the model
        assert FIELDS[key].read(changed, edit.owner) == pytest.approx(found.nominal + 0.3)
    assert not np.allclose(accelerations(changed), accelerations(spec), rtol=1e-6)
    assert FIELDS[key].read(spec, edit.owner) == found.nominal


def accelerations(spec: mujoco.MjSpec) -> Array:
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = (0.4, 0.05), (1.0, -0.5), 0.7
    mujoco.mj_forward(model, data)
    return data.qacc.copy()


def test_an_edit_at_the_nominal_value_changes_nothing():
    spec, _ = explicit_inertias(mujoco.MjSpec.from_string(EVERYTHING))
    for key in OF_MODEL:
        changed = spec.copy()
        found, edit = parameter(spec, Free(key, OWNERS[FIELDS[key].owner], 0.1), HINGE)
        edit.apply(changed, found.nominal)
        assert accelerations(changed) == pytest.approx(accelerations(spec), rel=1e-9), key


def test_a_gear_adds_a_joint_that_bends_by_its_compliance():
    spec, rigid = explicit_inertias(mujoco.MjSpec.from_string(EVERYTHING))
    edit = Edit("compliance", "hinge")
    edit.apply(spec, 0.0)  # as stiff as the step shows
    stiff = spec.compile()
    found, _ = parameter(spec, Free("compliance", "hinge", 0.01), HINGE)
    assert found.nominal == found.low == pytest.approx((0.002 / 0.5) ** 2 / 0.02)
    edit.apply(spec, 0.05)
    model = spec.compile()
    gear = model.joint("hinge gear")
    assert [m.nv for m in (rigid, stiff, model)] == [2, 3, 3]
    assert model.jnt_stiffness[gear.id] == pytest.approx(1 / 0.05)
    assert model.dof_armature[gear.dofadr[0]] == 0
    assert model.dof_armature[model.joint("hinge").dofadr[0]] == 0.02
    data = mujoco.MjData(model)
    data.joint("hinge").qpos[:], data.joint("hinge gear").qpos[:] = 0.3, 0.1
    mujoco.mj_forward(model, data)
    together = mujoco.MjData(rigid)
    together.joint("hinge").qpos[:] = 0.4
    mujoco.mj_forward(rigid, together)
    assert data.body("b").xpos == pytest.approx(together.body("b").xpos)


def test_a_servo_keeps_its_feedback_and_a_default_friction_becomes_sharp():
    spec, _ = explicit_inertias(mujoco.MjSpec.from_string(EVERYTHING))
    _, gain = parameter(spec, Free("gain", "servo", 1), HINGE)
    _, friction = parameter(spec, Free("frictionloss", "slide", 1), SLIDE)
    _, stated = parameter(spec, Free("frictionloss", "hinge", 1), HINGE)
    for edit in (gain, friction, stated):
        edit.apply(spec, 7.0)
    model = spec.compile()
    assert model.actuator_biasprm[0, 1] == -7
    assert model.dof_solref[1, 0] == 2 * model.opt.timestep
    assert model.dof_solref[0, 0] == 0.02


def test_parameters_say_what_they_are():
    system = cart(moved(), [Free("damping", "rail", 0.1),
                            Free("frictionloss", "rail", 0.1, Scope.CANDIDATE),
                            Free("input_lag", "force", 0.01, Scope.CANDIDATE),
                            Free("offset", "place", 1e-3, flat=True)])  # fmt: skip
    damping, friction, lag, offset = system.parameters
    assert (damping.unit, damping.nominal, damping.positive) == ("N s/m", 0.5, True)
    assert (friction.unit, friction.nominal, friction.low) == ("N", 0.0, 0.0)
    assert (friction.scope, lag.acts, offset.acts) == (
        Scope.CANDIDATE,
        Acts.DRIVE,
        Acts.OBSERVATION,
    )
    assert (offset.unit, offset.flat) == ("m", True)


@pytest.mark.parametrize(
    ("free", "words"),
    [
        (Free("dampning", "rail", 1), "'dampning' cannot be fitted; did you mean 'damping'"),
        (Free("damping", "rial", 1), "there is no joint 'rial'; did you mean 'rail'"),
        (Free("input_delay", "coil", 1), "there is no input 'coil'.*there are force"),
    ],
)
def test_unknown_names_are_refused_with_those_there_are(free, words):
    with pytest.raises(InputError, match=words):
        cart(moved(), [free])


def test_dry_friction_needs_constraints():
    spec = mujoco.MjSpec.from_string(CART)
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    with pytest.raises(InputError, match="rail frictionloss: the model's options disable"):
        parameter(spec, Free("frictionloss", "rail", 0.1), SLIDE)


def test_a_place_in_the_world_may_be_seen_late_and_a_speed_not():
    spec = mujoco.MjSpec.from_string(CART)
    places = np.interp(TIMES - 0.003, TIMES, moved())
    values = places + noise_like(places, PLACE_NOISE, np.random.default_rng(3))
    run = MjcfRun("run", TIMES, values[:, None], {}, STAMPS, sweep(STAMPS)[:, None])
    x = Channel("x", "body", "cart", axis=(1, 0, 0), sigma=PLACE_NOISE)
    free, force = [Free("delay", "x", 0.005)], [Input("force", "coil")]
    found, _, _ = fitted(MjcfSystem(spec, [x], [run], force, free), {SLIDES: 3e-4})
    assert found["x delay"] == pytest.approx(0.003, abs=2e-4)
    speed = Channel("x", "speed", "rail", sigma=1e-4)
    with pytest.raises(InputError, match="channel x: only that of a place can have a fitted delay"):
        MjcfSystem(spec, [speed], [run], force, free)


@pytest.mark.parametrize(
    ("actuator", "unit"),
    [
        ('<motor name="coil" joint="rail"/>', "N"),
        ('<motor name="coil" joint="rail" gear="3"/>', "control"),
        ('<position name="coil" joint="rail" kp="50"/>', "m"),
    ],
)
def test_an_input_s_offset_has_the_unit_of_its_control(actuator, unit):
    spec = mujoco.MjSpec.from_string(CART.replace('<motor name="coil" joint="rail"/>', actuator))
    run = MjcfRun("run", TIMES, np.zeros((len(TIMES), 1)), {}, STAMPS, sweep(STAMPS)[:, None])
    speed = Channel("v", "speed", "rail", sigma=1e-4)
    free = [Free("input_offset", "force", 0.1), Free("offset", "v", 0.1)]
    system = MjcfSystem(spec, [speed], [run], [Input("force", "coil")], free)
    assert [one.unit for one in system.parameters] == [unit, "m/s"]


def test_what_is_given_is_in_the_model_and_where_a_fit_begins():
    """A mechanism with given numbers is the one whose file has them."""
    spec, places = mujoco.MjSpec.from_string(CART), moved()
    run = MjcfRun("run", TIMES, places[:, None], {}, STAMPS, sweep(STAMPS)[:, None])
    channels = [Channel("place", "position", "rail", sigma=PLACE_NOISE)]
    given = {Edit("stiffness", "rail"): 44.0, Edit("input_delay", "force"): 0.01}
    free = [Free("stiffness", "rail", 4), Free("input_delay", "force", 0.01)]
    system, held = (
        MjcfSystem(spec, channels, [run], [Input("force", "coil")], fitted, given=given)
        for fitted in (free, [])
    )
    assert [one.nominal for one in system.parameters] == [44.0, 0.01]
    held = held.start(0, {}, coarse=False)
    moved_there = cart(places, free).start(
        0, dict(zip(cart(places, free).parameters, (44.0, 0.01), strict=True)), coarse=False
    )
    assert held.model.jnt_stiffness == pytest.approx(moved_there.model.jnt_stiffness)
    assert held.control == pytest.approx(moved_there.control)
