"""A leg: three causes at once, all found; one that both joints share, found as one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.rigs import write_rig
from workbench.diagnose import diagnose
from workbench.errors import FileFaults
from workbench.mechanism import load_mechanism

Array = NDArray[np.float64]

LEG = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body name="thigh">
      <joint name="hip" axis="0 1 0" damping="0.05" frictionloss="{hip}" solreffriction="0.004 1"/>
      <inertial pos="0 0 -0.1" mass="1" diaginertia="0.005 0.005 0.001"/>
      <body name="calf" pos="0 0 -0.21">
        <joint name="knee" axis="0 1 0" damping="0.02" frictionloss="{knee}" armature="{armature}"
               solreffriction="0.004 1"/>
        <inertial pos="0 0 -0.1" mass="0.2" diaginertia="0.001 0.001 0.0001"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="at_hip" joint="hip"/><motor name="at_knee" joint="knee"/></actuator>
</mujoco>
"""
RIG = """\
schema: workbench/rig-1
name: leg
model: model.xml
parameters:
  - {joint: hip, field: damping, tolerance: 0.02, unit: N m s/rad}
  - {joint: knee, field: damping, tolerance: 0.01, unit: N m s/rad}
channels:
  hip_rad: {joint: hip, noise: 5.0e-4}
  knee_rad: {joint: knee, noise: 5.0e-4}
inputs:
  hip_Nm: {actuator: at_hip}
  knee_Nm: {actuator: at_knee}
runs:
  - {data: run-0.csv, start: {hip: free, knee: free}}
  - {data: run-1.csv, start: {hip: free, knee: free}}
  - {data: run-2.csv, start: {hip: free, knee: free}, role: held_out}
effects:
  joints:
    hip: {coulomb_friction: 0.2, armature: 0.01, quadratic_damping: 0.05}
    knee: {coulomb_friction: 0.2, armature: 0.01, quadratic_damping: 0.05}
    hip + knee: {coulomb_friction: 0.2, armature: 0.01}
  inputs:
    hip_Nm: {gain: 0.1, delay: 0.01}
    knee_Nm: {gain: 0.1, delay: 0.01}
    hip_Nm + knee_Nm: {gain: 0.1}
"""
TRUE = {"hip": 0.12, "knee": 0.08, "armature": 0.004}
ALIKE = {"hip": 0.1, "knee": 0.1, "armature": 0.0}
NOISE, STEP_S, SAMPLE_S, SECONDS = 5e-4, 2e-3, 0.01, 3.0
AMPLITUDES = np.array([0.7, 0.25])  # [N m]


def recorded(true: Mapping[str, float], rng: np.random.Generator) -> Array:
    """Return time, both angles and both torques of a true leg, (n, 5) [s, rad, N m]."""
    model = mujoco.MjModel.from_xml_string(LEG.format(**true))
    assert model.opt.timestep == STEP_S
    data = mujoco.MjData(model)
    data.qpos[:] = -0.2, 0.4
    rates, phases = rng.uniform(0.4, 3.0, (2, 4)), rng.uniform(0, 2 * np.pi, (2, 4))

    def torque(t: float) -> Array:
        return AMPLITUDES * np.sin(2 * np.pi * rates * t + phases).sum(axis=1)

    rows = []
    for k in range(round(SECONDS / SAMPLE_S)):
        seen = data.qpos + NOISE * rng.standard_normal(2)
        rows.append([k * SAMPLE_S, *seen, *torque(data.time)])
        for _ in range(round(SAMPLE_S / STEP_S)):
            data.ctrl[:] = torque(data.time + STEP_S / 2)
            mujoco.mj_step(model, data)
    return np.array(rows)


def written(folder: Path, true: Mapping[str, float], rig: str = RIG) -> Path:
    """Write runs of a true leg and a rig that knows of no cause; return the rig's file."""
    rng = np.random.default_rng(3)
    runs = (recorded(true, rng) for _ in range(3))
    model = LEG.format(hip=0, knee=0, armature=0)
    return write_rig(folder, rig, model, "time_s,hip_rad,knee_rad,hip_Nm,knee_Nm", runs)


@pytest.mark.budget(25)  # a whole diagnosis
def test_three_causes_of_a_leg_are_named_together(tmp_path: Path) -> None:
    found = diagnose(load_mechanism(written(tmp_path, TRUE)), tmp_path / "out", threads=1)
    sizes = {one.name: next(iter(one.quantities.values())).value for one in found.causes}
    assert found.kind == "NAMED", found.reason
    assert sizes == {
        "hip_coulomb_friction": pytest.approx(TRUE["hip"], rel=0.05),
        "knee_coulomb_friction": pytest.approx(TRUE["knee"], rel=0.05),
        "knee_armature": pytest.approx(TRUE["armature"], rel=0.05),
    }
    assert found.removed is not None
    assert found.removed > 0.9


@pytest.mark.budget(25)  # a whole diagnosis
def test_what_both_joints_share_is_one_cause_with_one_number(tmp_path: Path) -> None:
    found = diagnose(load_mechanism(written(tmp_path, ALIKE)), tmp_path / "out", threads=1)
    assert found.kind == "NAMED", found.reason
    (cause,) = found.causes
    assert cause.name == "hip+knee_coulomb_friction"
    assert cause.quantities["frictionloss"].value == pytest.approx(0.1, rel=0.02)
    assert cause.sentence.startswith("hip and knee (each): frictionloss is 0.0998 N m")
    assert cause.sentence.endswith("more than the file says")
    assert found.removed is not None
    assert found.removed > 0.9  # by the file that was written, as it is read back


def test_a_shared_number_comes_on_top_of_what_each_has(tmp_path: Path) -> None:
    more = (
        "found:\n  - {cause: knee_damping, parameters: {damping: 0.03}}\n"
        "  - {cause: hip+knee_damping, parameters: {damping: 0.01}}\n"
        "  - {cause: hip_Nm+knee_Nm_gain, parameters: {share: 0.1}}\n"
    )
    stated = RIG.replace("hip + knee: {", "hip + knee: {damping: 0.02, ")
    stated = stated.replace("knee: {coulomb", "knee: {damping: 0.02, coulomb", 1)
    rig = load_mechanism(written(tmp_path, ALIKE, stated + more))
    system = rig.system([0], [])
    start = system.start(0, {}, coarse=False)
    assert start.model.dof_damping == pytest.approx([0.05 + 0.01, 0.03 + 0.01])
    plain = load_mechanism(written(tmp_path, ALIKE)).system([0], []).start(0, {}, coarse=False)
    assert start.control == pytest.approx(1.1 * plain.control)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("hip + knee: {", "hip + ankle: {", "the model has no joint 'ankle'; it has hip, knee"),
        ("hip + knee: {", "hip + hip: {", "hip + hip: one of them stands twice"),
        (
            "hip + knee: {coulomb_friction: 0.2, armature: 0.01}",
            "hip + hip: {compliance: 0.01}",
            "hip + hip: one of them stands twice",
        ),
        ("hip_Nm + knee_Nm", "hip_Nm + knee", "no input 'knee'; did you mean 'knee_Nm'?"),
    ],
)
def test_what_shares_a_number_must_be_there_once(
    tmp_path: Path, before: str, after: str, said: str
) -> None:
    with pytest.raises(FileFaults) as refused:
        load_mechanism(written(tmp_path, ALIKE, RIG.replace(before, after)))
    assert said in str(refused.value)
