"""An arm whose gear gives: its motor, which sensor and actuator are on, rings against the arm."""

from __future__ import annotations

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

RIGID = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body name="arm">
      <joint name="elbow" axis="0 1 0" damping="0.05" armature="{armature}"/>
      <inertial pos="0 0 -0.2" mass="0.6" diaginertia="0.004 0.004 0.001"/>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="elbow"/></actuator>
</mujoco>
"""
GIVING = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.0005" integrator="RK4"/>
  <worldbody>
    <body name="rotor">
      <joint name="motor" axis="0 1 0" damping="0.05"/>
      <inertial pos="0 0 0" mass="0.001" diaginertia="{armature} {armature} {armature}"/>
      <body name="arm">
        <joint name="gear" axis="0 1 0" stiffness="{stiffness}" damping="0.02"/>
        <inertial pos="0 0 -0.2" mass="0.6" diaginertia="0.004 0.004 0.001"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="motor"/></actuator>
</mujoco>
"""
RIG = """\
schema: workbench/rig-1
name: arm
model: model.xml
parameters:
  - {joint: elbow, field: damping, tolerance: 0.02, unit: N m s/rad}
channels:
  elbow_rad: {joint: elbow, noise: 5.0e-4}
inputs:
  torque_Nm: {actuator: motor}
runs:
  - {data: run-0.csv, start: {elbow: free}}
  - {data: run-1.csv, start: {elbow: free}}
  - {data: run-2.csv, start: {elbow: free}, role: held_out}
effects:
  joints:
    elbow: {coulomb_friction: 0.1, armature: 0.005, quadratic_damping: 0.05, compliance: 0.05}
  inputs:
    torque_Nm: {gain: 0.1, delay: 0.01, lag: 0.01}
"""
ARMATURE, STIFFNESS = 0.006, 15.0
"""The free gear rings at 8.7 Hz."""
NOISE, STEP_S, SAMPLE_S, SECONDS = 5e-4, 5e-4, 0.005, 3.0


def recorded(rng: np.random.Generator) -> Array:
    """Return time, the motor's angle and its torque, (n, 3) [s, rad, N m]."""
    xml = GIVING.format(armature=ARMATURE, stiffness=STIFFNESS)
    model = mujoco.MjModel.from_xml_string(xml)
    assert model.opt.timestep == STEP_S
    data = mujoco.MjData(model)
    rates, phases = rng.uniform(0.3, 9.0, 8), rng.uniform(0, 2 * np.pi, 8)

    def torque(t: float) -> float:
        return float(0.25 * np.sin(2 * np.pi * rates * t + phases).sum())

    rows = []
    for k in range(round(SECONDS / SAMPLE_S)):
        seen = data.qpos[0] + NOISE * rng.standard_normal()
        rows.append([k * SAMPLE_S, seen, torque(data.time)])
        for _ in range(round(SAMPLE_S / STEP_S)):
            data.ctrl[:] = torque(data.time + STEP_S / 2)
            mujoco.mj_step(model, data)
    return np.array(rows)


def written(folder: Path, armature: float = ARMATURE) -> Path:
    """Write runs of an arm whose gear gives and a rig whose gear is rigid."""
    rng = np.random.default_rng(4)
    runs = (recorded(rng) for _ in range(3))
    model = RIGID.format(armature=armature)
    return write_rig(folder, RIG, model, "time_s,elbow_rad,torque_Nm", runs)


@pytest.mark.budget(25)  # a whole diagnosis
def test_a_gear_that_gives_is_named_with_its_compliance(tmp_path: Path) -> None:
    found = diagnose(load_mechanism(written(tmp_path)), tmp_path / "out", threads=1)
    assert found.kind == "NAMED", found.reason
    (cause,) = found.causes
    assert cause.name == "elbow_compliance"
    assert cause.quantities["compliance"].value == pytest.approx(1 / STIFFNESS, rel=0.05)
    assert "the gear of elbow gives between its motor and what it moves" in cause.sentence
    assert found.removed is not None
    assert found.removed > 0.8  # by the file that was written; how the gear is damped is not fitted


def test_a_gear_needs_a_motor_with_inertia(tmp_path: Path) -> None:
    with pytest.raises(FileFaults) as refused:
        load_mechanism(written(tmp_path, armature=0.0))
    assert "compliance: elbow has no armature" in str(refused.value)
