"""A leg with friction in both joints and an armature in one: three causes at once, all found."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.diagnose import diagnose, load_mechanism

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
  inputs:
    hip_Nm: {gain: 0.1, delay: 0.01}
    knee_Nm: {gain: 0.1, delay: 0.01}
"""
TRUE = {"hip": 0.12, "knee": 0.08, "armature": 0.004}
NOISE, STEP_S, SAMPLE_S, SECONDS = 5e-4, 2e-3, 0.01, 3.0
AMPLITUDES = np.array([0.7, 0.25])  # [N m]


def recorded(rng: np.random.Generator) -> Array:
    """Return time, both angles and both torques of the true leg, (n, 5) [s, rad, N m]."""
    model = mujoco.MjModel.from_xml_string(LEG.format(**TRUE))
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


@pytest.mark.budget(25)  # a whole diagnosis
def test_three_causes_of_a_leg_are_named_together(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    for k in range(3):
        head = "time_s,hip_rad,knee_rad,hip_Nm,knee_Nm"
        np.savetxt(tmp_path / f"run-{k}.csv", recorded(rng), "%.9g", ",", header=head, comments="")
    (tmp_path / "model.xml").write_text(LEG.format(hip=0, knee=0, armature=0))
    (tmp_path / "rig.yaml").write_text(RIG)
    found = diagnose(load_mechanism(tmp_path / "rig.yaml"), tmp_path / "out", threads=1)
    sizes = {one.name: next(iter(one.quantities.values())).value for one in found.causes}
    assert found.kind == "NAMED", found.reason
    assert sizes == {
        "hip_coulomb_friction": pytest.approx(TRUE["hip"], rel=0.05),
        "knee_coulomb_friction": pytest.approx(TRUE["knee"], rel=0.05),
        "knee_armature": pytest.approx(TRUE["armature"], rel=0.05),
    }
    assert found.removed is not None
    assert found.removed > 0.9
