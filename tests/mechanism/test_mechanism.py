"""Any MJCF as a rig of the estimator: hidden causes are found, and what a file says is used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import get_args

import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from workbench.diagnose import Amount, Rig
from workbench.diagnose.fits import Fits
from workbench.errors import InputError
from workbench.fit import Acts, JointStart, Scope
from workbench.mechanism import MechanismRig, load_mechanism
from workbench.mechanism.causes import SECTIONS
from workbench.schemas import ChannelEffect, InputEffect, JointEffect
from workbench.schemas.rig import ActuatorEffect, BodyEffect, GravityEffect

Array = NDArray[np.float64]
Control = Callable[[float], float]

PENDULUM = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="RK4"/>
  <worldbody>
    <body name="arm">
      <joint name="pivot" axis="0 1 0" damping="0.006" frictionloss="{friction}"
             solreffriction="0.004 1"/>
      <inertial pos="0 0 -0.25" mass="0.4" diaginertia="0.002 0.002 0.0001"/>
      <site name="bob" pos="0 0 -0.25"/>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="pivot"/></actuator>
</mujoco>
"""
SWING = """\
schema: workbench/rig-1
name: pendulum
model: model.xml
parameters:
  - {joint: pivot, field: damping, tolerance: 0.002, unit: N m s/rad}
channels:
  angle: {joint: pivot, column: angle_rad, noise: 5.0e-4}
inputs:
  torque: {actuator: motor, column: torque_Nm, between: held}
runs:
  - {data: high.csv, start: {pivot: 0.9}}
  - {data: low.csv, start: {pivot: held}}
  - {data: middle.csv, start: {pivot: free}, role: held_out}
effects:
  joints:
    pivot: {damping: 0.004, quadratic_damping: 0.004, coulomb_friction: 0.01,
            cubic_stiffness: 0.1, armature: 0.005}
  bodies:
    arm: {mass: 0.05}
  channels:
    angle: {offset: 0.01, gain: 0.02, delay: 0.005}
  inputs:
    torque: {gain: 0.05, offset: 0.02, delay: 0.01, lag: 0.01}
  actuators:
    motor: {gain: 0.05}
  gravity: {tilt_y: 0.02}
"""
NOISE = 5e-4  # [rad]


def nothing(t: float) -> float:
    return 0.0


def simulated(
    xml: str, times: Array, start: Mapping[str, float], control: Control = nothing
) -> tuple[Array, Array, Array]:
    """Return qpos, qvel and the place of the last site at some times, by steps of 1 ms."""
    model = mujoco.MjModel.from_xml_string(xml)
    steps = int(np.ceil((times[1] - times[0]) / 1e-3))
    model.opt.timestep = (times[1] - times[0]) / steps
    data = mujoco.MjData(model)
    for joint, place in start.items():
        data.joint(joint).qpos[:] = place
    rows = []
    for _ in times:
        mujoco.mj_forward(model, data)
        rows.append((data.qpos.copy(), data.qvel.copy(), data.site_xpos[-1].copy()))
        for _ in range(steps):
            data.ctrl[:] = control(data.time + 1e-9)
            mujoco.mj_step(model, data)
    qpos, qvel, places = (np.array(part) for part in zip(*rows, strict=True))
    return qpos, qvel, places


def write(path: Path, table: Mapping[str, Array]) -> None:
    rows = np.column_stack(list(table.values()))
    np.savetxt(path, rows, "%.9g", ",", header=",".join(table), comments="")


def stepped(t: float) -> float:
    """Return a command that a converter held from one fiftieth of a second to the next."""
    return 0.15 * float(np.sin(2 * np.pi * (0.5 + 0.7 * t) * t)) if t > 0 else 0.0


def held(t: float) -> float:
    return stepped(np.floor(50 * t + 1e-6) / 50)


def swing(folder: Path, friction: float = 0.004, delay: float = 0.0) -> Path:
    """Write the rig of a pendulum whose file has a friction of 0.004 N m."""
    rng, times = np.random.default_rng(1), np.arange(0, 3, 0.01)
    truth = PENDULUM.format(friction=friction)
    for name, start, control in (("high", 0.9, nothing), ("low", 0.3, held), ("middle", 0.6, held)):
        late = control if control is nothing else lambda t: held(t - delay)
        angle = simulated(truth, times, {"pivot": start}, late)[0][:, 0]
        command = np.array([control(t) for t in times])
        angle += NOISE * rng.standard_normal(len(times))
        write(folder / f"{name}.csv", {"time_s": times, "angle_rad": angle, "torque_Nm": command})
    (folder / "model.xml").write_text(PENDULUM.format(friction=0.004))
    (folder / "rig.yaml").write_text(SWING)
    return folder / "rig.yaml"


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swing(tmp_path_factory.mktemp("plain"))


@pytest.fixture
def rig_file(plain: Path) -> Callable[..., Path]:
    """Return what writes the pendulum's rig file with some words replaced, beside its data."""

    def changed(*pairs: tuple[str, str]) -> Path:
        text = SWING
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new)
        path = plain.parent / "changed.yaml"
        path.write_text(text)
        return path

    return changed


def refits(path: Path, count: int) -> tuple[MechanismRig, list[tuple[str, float, float]]]:
    """Return a rig and its candidates that promise most: name, gained cost and size, each."""
    rig = load_mechanism(path)
    fits = Fits(rig, threads=1)
    base = fits.base()
    found = []
    for promise in fits.promises(base)[:count]:
        begun = fits.refit([promise.name], base, promise)
        assert begun is not None
        refit = fits.weighed(begun)
        (parameter,) = fits.candidates[promise.name].quantities.values()
        found.append((promise.name, base.cost - refit.cost, refit.values[parameter.name]))
        before, after = (sum(map(np.sum, fits.judged(one))) for one in (base, refit))
        assert after < before
    return rig, found


def test_a_hidden_dry_friction_is_found_as_the_whole_number_of_the_file(tmp_path: Path) -> None:
    rig, [(name, gain, size)] = refits(swing(tmp_path, friction=0.016), 1)
    assert name == "pivot_coulomb_friction"
    assert gain > 100
    assert size == pytest.approx(0.016, rel=0.03)
    candidate = next(one for one in rig.candidates if one.name == "pivot_coulomb_friction")
    assert candidate.quantities["frictionloss"].nominal == 0.004
    told = candidate.sentence.format(frictionloss=Amount(0.016, 0.0157, 0.0163, "N m"))
    assert told == "dry friction of pivot: frictionloss = 0.0160 N m (0.0157 to 0.0163)"


def test_the_delay_of_a_held_input_is_found_within_a_millisecond(tmp_path: Path) -> None:
    """A lag begins like a delay, so that both promise the same; fitted, the delay gains more."""
    _, found = refits(swing(tmp_path, delay=0.015), 2)
    assert {name for name, _, _ in found} == {"torque_delay", "torque_lag"}
    name, _, size = max(found, key=lambda one: one[1])
    assert name == "torque_delay"
    assert size == pytest.approx(0.015, abs=1e-3)


ARM = """
<mujoco>
  <option timestep="0.0025" integrator="RK4"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" damping="0.02"/>
      <inertial pos="0 0 -0.12" mass="0.8" diaginertia="0.006 0.006 0.0001"/>
      <body name="lower" pos="0 0 -0.3">
        <joint name="elbow" axis="0 1 0" damping="0.01" stiffness="0.4" armature="{armature}"/>
        <inertial pos="0 0 -0.1" mass="0.5" diaginertia="0.003 0.003 0.0001"/>
        <site name="tip" pos="0 0 -0.25"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="shoulder"/></actuator>
</mujoco>
"""
REACH = """\
schema: workbench/rig-1
name: two joints
model: model.xml
parameters:
  - {joint: elbow, field: stiffness, tolerance: 0.02, unit: N m/rad}
  - {actuator: motor, field: gain, tolerance: 0.02, unit: N m/control}
channels:
  x: {site: tip, axis: x, column: x_mm, scale: 0.001, noise: 2.0e-4}
  z: {site: tip, axis: z, column: z_mm, scale: 0.001, noise: 2.0e-4}
  rate: {joint: shoulder, quantity: velocity, noise: 5.0e-3}
inputs:
  torque: {actuator: motor, between: held}
runs:
  - {data: driven.csv, inputs: driven-torque.csv}
  - data: thrown.csv
    inputs: thrown-torque.csv
    start:
      shoulder: {position: 0.8, tolerance: 0.05}
      elbow: {position: -0.6, tolerance: 0.05}
effects:
  joints:
    elbow: {stiffness: 0.05, armature: 0.002, coulomb_friction: 0.01, damping: 0.01}
    shoulder: {coulomb_friction: 0.02, armature: 0.005}
  bodies:
    lower: {mass: 0.05, inertia: 0.2}
    upper: {mass: 0.08}
  actuators:
    motor: {gain: 0.05}
  channels:
    x: {offset: 0.002, gain: 0.01}
  inputs:
    torque: {delay: 0.01}
"""


def test_a_hidden_armature_of_an_arm_is_found_with_inputs_of_another_rate(tmp_path: Path) -> None:
    rng, times, stamps = np.random.default_rng(2), np.arange(0, 3, 0.01), np.arange(-0.1, 3, 0.02)
    truth = ARM.format(armature=0.003)
    for name, start, control in (
        ("driven", {}, lambda t: 6 * held(t)),
        ("thrown", {"shoulder": 0.82, "elbow": -0.57}, nothing),
    ):
        _, qvel, places = simulated(truth, times, start, control)
        noise = rng.standard_normal((len(times), 3)) * (2e-4, 2e-4, 5e-3)
        x, z = 1000 * (places[:, [0, 2]] + noise[:, :2]).T
        rate = qvel[:, 0] + noise[:, 2]
        write(tmp_path / f"{name}.csv", {"time_s": times, "x_mm": x, "z_mm": z, "rate": rate})
        torque = np.array([control(t) for t in stamps])
        write(tmp_path / f"{name}-torque.csv", {"time_s": stamps, "torque": torque})
    (tmp_path / "model.xml").write_text(ARM.format(armature=0))
    (tmp_path / "rig.yaml").write_text(REACH)
    rig = load_mechanism(tmp_path / "rig.yaml")
    fits = Fits(rig, threads=1)
    base = fits.base()
    promises = fits.promises(base)
    assert promises[0].name == "elbow_armature"
    begun = fits.refit(["elbow_armature"], base, promises[0])
    assert begun is not None
    refit = fits.ended(begun)
    assert refit.values["elbow armature"] == pytest.approx(0.003, rel=0.05)
    assert refit.values["elbow at the start of thrown"] == pytest.approx(-0.57, abs=3e-3)


def test_a_candidate_that_is_a_base_parameter_frees_it(plain: Path) -> None:
    rig = load_mechanism(plain)
    candidates = {one.name: one for one in rig.candidates}
    assert [one.name for one in rig.base] == ["pivot damping"]
    assert (rig.base[0].scope, rig.base[0].flat) == (Scope.MODEL, False)
    assert candidates["pivot_damping"].frees == ("pivot damping",)
    assert candidates["pivot_damping"].quantities == {}
    assert candidates["pivot_coulomb_friction"].frees == ()
    groups = {one.name: one.group for one in rig.candidates}
    assert groups["gravity_tilt_y"] == "outside"
    assert groups["torque_lag"] == groups["motor_gain"] == "drive"
    assert candidates["arm_mass"].confused_with == ("pivot_armature", "motor_gain", "torque_gain")
    assert candidates["torque_delay"].confused_with == ("angle_delay", "torque_gain", "torque_lag")
    assert set(candidates["arm_mass"].shows_in) == {"run"}


def test_a_system_frees_exactly_what_is_asked(plain: Path) -> None:
    rig = load_mechanism(plain)
    friction = next(
        one.quantities["frictionloss"] for one in rig.candidates if "coulomb" in one.name
    )
    system = rig.system([0, 2], [*rig.base, friction])
    assert system.names == ["high", "middle"]
    own = [one.name for one in system.parameters if one.scope is Scope.RUN]
    assert own == ["pivot at the start of middle", "speed of pivot at the start of middle"]
    assert system.parameters[:2] == (*rig.base, friction)
    assert rig.names == ("high", "low", "middle")
    assert rig.roles == ("train", "train", "held_out")
    assert [path.name for path in rig.files.values()] == [
        "model.xml",
        "high.csv",
        "low.csv",
        "middle.csv",
    ]


def test_noise_is_what_the_file_states_or_what_the_training_runs_show(
    rig_file: Callable[..., Path],
) -> None:
    assert load_mechanism(rig_file(("5.0e-4", "2.0e-3"))).channels[0].sigma == 2e-3
    (channel,) = load_mechanism(rig_file((", noise: 5.0e-4", ""))).channels
    assert channel.sigma == pytest.approx(NOISE, rel=0.1)


def test_a_run_may_begin_in_motion_late_or_near_a_place(
    plain: Path, rig_file: Callable[..., Path]
) -> None:
    rig = load_mechanism(
        rig_file(
            ("high.csv, start: {pivot: 0.9}", "high.csv, begins: 1 s, start: {pivot: free}"),
            ("low.csv, start: {pivot: held}", "low.csv, late: 10 ms, start: {pivot: held}"),
            ("{pivot: free}, role", "{pivot: {position: 0.6, tolerance: 0.1}}, role"),
        )
    )
    rows = np.loadtxt(plain.parent / "high.csv", delimiter=",", skiprows=1)
    high, low, middle = rig.runs
    assert high.times[0] == 0.0
    assert len(high.times) == 200
    start = high.start["pivot"]
    assert start.position == pytest.approx(rows[100, 1], abs=2 * NOISE)
    assert start.speed == pytest.approx((rows[102, 1] - rows[98, 1]) / 0.04, abs=0.1)
    assert start.position_deviation > 0.01  # as wide as what the channel may read wrong
    assert low.late_deviation == pytest.approx(0.01)
    assert low.start["pivot"].speed_deviation == 0
    assert middle.start["pivot"] == JointStart(0.6, 0.1)


def test_rest_before_a_run_tells_where_a_joint_was_held(
    tmp_path: Path, rig_file: Callable[..., Path], plain: Path
) -> None:
    rows = np.loadtxt(plain.parent / "low.csv", delimiter=",", skiprows=1)
    rows[:50, 1] = 0.25 + 1e-4 * (-1.0) ** np.arange(50)
    table = dict(zip(("time_s", "angle_rad", "torque_Nm"), rows.T, strict=True))
    pq.write_table(pa.table(table), plain.parent / "rest.parquet")
    (one,) = load_mechanism(
        rig_file(
            ("low.csv, start", "rest.parquet, begins: 0.5 s, start"),
            ("  - {data: high.csv, start: {pivot: 0.9}}\n", ""),
            ("  - {data: middle.csv, start: {pivot: free}, role: held_out}\n", ""),
            ("    angle: {offset: 0.01, gain: 0.02, delay: 0.005}", "    angle: {delay: 0.005}"),
        )
    ).runs
    assert one.start["pivot"].position == pytest.approx(0.25, abs=2e-4)
    assert one.start["pivot"].position_deviation == pytest.approx(NOISE)
    assert abs(one.times[0]) < 1e-12
    assert one.input_times[0] == pytest.approx(-0.5)


def test_a_slower_run_is_one_with_samples_that_were_not_seen(
    rig_file: Callable[..., Path], plain: Path
) -> None:
    lines = (plain.parent / "low.csv").read_text().splitlines()
    (plain.parent / "slow.csv").write_text("\n".join([lines[0], *lines[1::2]]) + "\n")
    slow = load_mechanism(rig_file(("low.csv", "slow.csv"))).runs[1]
    assert slow.sample_s == pytest.approx(0.01)
    assert np.isnan(slow.values[1::2]).all()
    assert np.isfinite(slow.values[::2]).all()
    (plain.parent / "odd.csv").write_text("\n".join([lines[0], *lines[1:101:2], *lines[103::2]]))
    with pytest.raises(InputError, match=r"odd\.csv:52: a step of 0\.0[34] s among steps of 0\.02"):
        load_mechanism(rig_file(("low.csv", "odd.csv")))


def test_uneven_stamps_are_put_on_an_even_clock_and_rounded_ones_are_one(
    rig_file: Callable[..., Path], plain: Path
) -> None:
    rows = np.loadtxt(plain.parent / "high.csv", delimiter=",", skiprows=1)
    even = rows[:, 0].copy()
    rows[:, 1] = np.cos(3 * even)
    early = even + 0.003 * np.sin(np.arange(len(even)))
    table = {"time_s": early, "angle_rad": np.cos(3 * early), "torque_Nm": rows[:, 2]}
    write(plain.parent / "uneven.csv", table)
    moved = load_mechanism(rig_file(("high.csv", "uneven.csv"))).runs[0]
    assert moved.values[:, 0] == pytest.approx(rows[:, 1], abs=1e-4)
    stamps = np.arange(300) / 240
    table = {"time_s": stamps.round(3), "angle_rad": np.cos(stamps), "torque_Nm": rows[:, 2]}
    write(plain.parent / "rounded.csv", table)
    whole = SWING[: SWING.index("  - {data: low")] + SWING[SWING.index("effects:") :]
    path = rig_file()
    path.write_text(whole.replace("high.csv", "rounded.csv"))
    (run,) = load_mechanism(path).runs
    assert run.values[:, 0] == pytest.approx(np.cos(stamps), abs=1e-9)
    assert run.sample_s == pytest.approx(1 / 240, rel=1e-4)


def test_an_input_by_a_curve_has_points_between_its_stamps(rig_file: Callable[..., Path]) -> None:
    curved = load_mechanism(rig_file(("between: held", "between: curve"))).runs[1]
    plainly = load_mechanism(rig_file()).runs[1]
    assert len(curved.input_times) == 8 * (len(plainly.input_times) - 1) + 1
    assert curved.inputs[::8] == pytest.approx(plainly.inputs, abs=1e-12)


def test_an_extended_rig_is_read_back_with_what_was_found(plain: Path, tmp_path: Path) -> None:
    rig = load_mechanism(plain)
    effects = {
        "pivot_coulomb_friction": {"frictionloss": (0.016, 2e-4)},
        "torque_delay": {"delay": (0.015, 1e-4)},
        "angle_offset": {"offset": (0.01, 1e-3)},
        "pivot_damping": {},
    }
    extended = rig.extend(tmp_path / "out" / "one", {"pivot damping": 0.0071}, effects, "april")
    assert extended.source == tmp_path / "out" / "one.yaml"
    text = extended.source.read_text()
    assert text.startswith("# extended by april")
    assert "standard_errors:\n    frictionloss: 0.0002" in text
    names = {one.name for one in extended.candidates}
    assert not {"pivot_coulomb_friction", "torque_delay", "angle_offset"} & names
    assert "pivot_damping" in names
    assert extended.base[0].nominal == 0.0071
    fixed, free = extended.system([1], []), rig.system([1], rig.base)
    model = fixed.start(0, {}, coarse=False).model
    assert model.dof_frictionloss[0] == 0.016
    assert model.dof_damping[0] == 0.0071
    assert fixed.start(0, {}, coarse=False).observation.bias == pytest.approx([0.01])
    before = free.start(0, {}, coarse=False).control[:, 0]
    after = fixed.start(0, {}, coarse=False).control[:, 0]
    assert after[11:20] == pytest.approx((before[9:18] + before[10:19]) / 2, abs=1e-9)
    assert extended.runs[1].start["pivot"].position == pytest.approx(
        rig.runs[1].start["pivot"].position - 0.01
    )
    with pytest.raises(InputError, match=r"one\.yaml: exists; a rig is never changed"):
        rig.extend(tmp_path / "out" / "one", {}, effects, "april")


def test_a_number_of_an_older_file_is_added_to_the_model_s(rig_file: Callable[..., Path]) -> None:
    for quantity, value in (("friction", 0.012), ("frictionloss", 0.016)):
        words = f"{{cause: pivot_coulomb_friction, parameters: {{{quantity}: {value}}}}}"
        rig = load_mechanism(rig_file(("effects:\n", f"found: [{words}]\neffects:\n")))
        model = rig.system([0], []).start(0, {}, coarse=False).model
        assert model.dof_frictionloss[0] == pytest.approx(0.016)


def test_every_effect_of_the_schema_is_a_cause_of_a_field() -> None:
    schema = {
        "joints": JointEffect, "bodies": BodyEffect, "actuators": ActuatorEffect,
        "channels": ChannelEffect, "inputs": InputEffect, "gravity": GravityEffect,
    }  # fmt: skip
    assert {key: set(kinds) for key, kinds in SECTIONS.items()} == {
        key: set(get_args(literal)) for key, literal in schema.items()
    }


def test_a_drive_s_candidates_act_on_the_drive(plain: Path) -> None:
    for one in load_mechanism(plain).candidates:
        for parameter in one.quantities.values():
            assert parameter.scope is Scope.CANDIDATE
            assert (parameter.acts is Acts.DRIVE) == one.name.startswith("torque")
            assert (parameter.acts is Acts.OBSERVATION) == one.name.startswith("angle")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("model: model.xml", "model: modell.xml", r"changed\.yaml:3:1: model: .*modell\.xml is no"),
        ("angle: {joint: pivot", "angle: {joint: pivto",
         r"7:11: the model has no joint 'pivto'; did you mean 'pivot'\?; it has pivot"),
        ("actuator: motor", "actuator: coil", r"9:12: the model has no actuator 'coil'; it has mo"),
        ("unit: N m s/rad", "unit: N s/m", r"unit: damping of pivot is in 'N m s/rad', not 'N s/m"),
        ("data: high.csv", "data: hihg.csv", r"11:6: data: .*hihg\.csv is no file; did you mean"),
        ("data: high.csv", "data: high.csv, inputs: hihg.csv",
         r"11:22: inputs: .*hihg\.csv is no file; did you mean 'high\.csv'"),
        ("column: angle_rad", "column: angle",
         r"11:6: high\.csv has no column 'angle'; did you mean 'angle_rad'\?; it has time_s"),
        ("high.csv,", "high.csv, begins: 50 s,", r"begins: 50 s is not within 0 and 2\.99 s of"),
        ("high.csv,", "high.csv, begins: 2.95 s,", r"high\.csv has 5 samples after 2\.95 s; a run"),
        ("low.csv,", "low.csv, late: 0 s,", r"late is not above 0 s"),
        ("{data: middle.csv,", "{data: middle.csv, late: 5 ms,", r"late goes with a start at rest"),
        ("    angle: {offset", "    angel: {offset", r"no channel 'angel'; did you mean 'angle'"),
        ("    motor: {gain", "    motro: {gain", r"no actuator 'motro'; did you mean 'motor'"),
        ("field: damping", "field: gain", r"field gain is an actuator's; name the actuator and no"),
        ("lag: 0.01", "lagg: 0.01", r"lagg"),
        ("noise: 5.0e-4", "noise: 0", r"noise: 0 is not .*above 0"),
        ("effects:\n", "found: [{cause: pivot_cubic, parameters: {k3: 1}}]\neffects:\n",
         r"14:10: cause: 'pivot_cubic' is none of the rig's effects"),
        ("effects:\n", "found: [{cause: pivot_damping, parameters: {k: 1}}]\neffects:\n",
         r"pivot_damping has no quantity 'k'; it has damping"),
        ("angle: {joint: pivot,", "angle: {joint: pivot, quantity: velocity,",
         r"pivot begins 'held', but no channel measures its position; .*speed_tolerance"),
        ("  torque: {actuator: motor", "  motor: {actuator: motor", r"no input 'torque'"),
    ],
)  # fmt: skip
def test_a_fault_of_the_rig_file_is_told_where_it_stands(
    rig_file: Callable[..., Path], old: str, new: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        load_mechanism(rig_file((old, new)))


def test_a_delay_of_a_speed_and_a_friction_that_is_switched_off_are_no_candidates(
    rig_file: Callable[..., Path], plain: Path
) -> None:
    off = PENDULUM.format(friction=0.004).replace(
        'integrator="RK4"/>', 'integrator="RK4"><flag frictionloss="disable"/></option>'
    )
    (plain.parent / "off.xml").write_text(off)
    with pytest.raises(InputError, match=r"16:55: coulomb_friction: the model's options disable"):
        load_mechanism(rig_file(("model.xml", "off.xml")))
    rate = "channels:\n  rate: {joint: pivot, quantity: velocity, column: angle_rad}\n  angle:"
    path = rig_file(("channels:\n  angle:", rate), ("    angle: {offset", "    rate: {offset"))
    with pytest.raises(InputError, match=r"delay: only a channel of a place can have one"):
        load_mechanism(path)


def test_a_model_that_cannot_be_used_is_told_in_words(
    rig_file: Callable[..., Path], plain: Path
) -> None:
    (plain.parent / "bad.xml").write_text(PENDULUM.replace('mass="0.4"', 'mass="heavy"'))
    with pytest.raises(InputError, match=r"bad\.xml: MuJoCo refuses it: "):
        load_mechanism(rig_file(("model.xml", "bad.xml")))
    ball = PENDULUM.format(friction=0).replace(
        "</worldbody>",
        "<body name='top'><joint name='hip' type='ball'/><geom size='.1'/></body></worldbody>",
    )
    (plain.parent / "ball.xml").write_text(ball)
    with pytest.raises(InputError, match=r"ball\.xml: joint 'hip' of body 'top' is a ball joint"):
        load_mechanism(rig_file(("model.xml", "ball.xml")))


@pytest.mark.parametrize(
    ("line", "cells", "message"),
    [
        (9, "0.07,0,0", r"bad\.csv:10: time 0\.07 s follows 0\.07 s; times must increase"),
        (9, ",0,0", r"bad\.csv:10: a sample without a time"),
        (9, "0.08,dark,0", r"bad\.csv:10: angle_rad is 'dark'; it must be a number, or nothing"),
        (9, "0.08,0,", r"bad\.csv:10: input torque_Nm is empty; what acted must be known"),
        (9, "0.08,0", r"bad\.csv: cannot be read as a table: .*Expected 3 columns, got 2"),
    ],
)
def test_data_that_cannot_be_used_are_refused_with_their_line(
    rig_file: Callable[..., Path], plain: Path, line: int, cells: str, message: str
) -> None:
    lines = (plain.parent / "high.csv").read_text().splitlines()
    lines[line] = cells
    (plain.parent / "bad.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=message):
        load_mechanism(rig_file(("high.csv", "bad.csv")))


def test_noise_that_the_data_do_not_tell_must_be_stated(
    rig_file: Callable[..., Path], plain: Path
) -> None:
    lines = (plain.parent / "high.csv").read_text().splitlines()
    cells = [line.split(",") for line in lines[1:]]
    for name, step in (("still", 10.0), ("steps", 0.01)):
        rows = [f"{t},{step * round(float(a) / step):g},{u}" for t, a, u in cells]
        (plain.parent / f"{name}.csv").write_text("\n".join([lines[0], *rows]) + "\n")
    pairs = [(", noise: 5.0e-4", "")]
    pairs += [(name, "still.csv") for name in ("high.csv", "low.csv", "middle.csv")]
    with pytest.raises(InputError, match=r"7:3: angle: its noise cannot be found .* state `noise`"):
        load_mechanism(rig_file(*pairs))
    stepped_pairs = [(old, new.replace("still", "steps")) for old, new in pairs]
    (channel,) = load_mechanism(rig_file(*stepped_pairs)).channels
    assert channel.sigma == pytest.approx(0.01 / np.sqrt(12), rel=0.3)


def test_a_rig_is_what_the_engine_asks_for(plain: Path, tmp_path: Path) -> None:
    rig: Rig = load_mechanism(plain)
    assert [one.channels for one in rig.facts] == [("angle",)] * 3
    assert [one.role for one in rig.facts] == ["train", "train", "held_out"]
    assert list(rig.faults()) == []
    assert rig.repeats() == 1.0
    true, off = (rig.errors([1, 2], {"pivot damping": d}, None, 1) for d in (0.006, 0.012))
    assert true is not None
    assert off is not None
    assert (true.unit, true.noise_floor) == ("rad", NOISE)
    assert true.rmse == pytest.approx(NOISE, rel=0.1)
    assert off.rmse > 10 * NOISE
    assert rig.errors([], None, None) is None


def test_a_freed_number_is_told_beside_that_of_the_file(plain: Path) -> None:
    freed = next(one for one in load_mechanism(plain).candidates if one.frees)
    assert freed.freed == ("added", "N m s/rad")
    told = freed.sentence.format(added=Amount(-0.001, -0.002, -0.0005, "N m s/rad"))
    assert told.startswith("pivot damping is 0.00100 N m s/rad (0.000500 to 0.00200) less than the")
    assert told.endswith("0.00600 N m s/rad of the file")
