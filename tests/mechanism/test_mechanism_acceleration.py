"""A shaken oscillator of which an accelerometer alone tells: its hardening spring is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.rigs import write_rig
from workbench.diagnose import diagnose
from workbench.errors import FileFaults
from workbench.mechanism import load_mechanism

Array = NDArray[np.float64]

MODEL = """
<mujoco>
  <option timestep="0.002" integrator="RK4" gravity="0 0 0"/>
  <worldbody>
    <body name="block">
      <joint name="mode" type="slide" axis="1 0 0" stiffness="400" damping="0.6"/>
      <geom type="box" size="0.05 0.05 0.05" mass="1"/>
    </body>
  </worldbody>
  <actuator><motor name="shaker" joint="mode"/></actuator>
</mujoco>
"""
RIG = """\
schema: workbench/rig-1
name: beam
model: model.xml
parameters:
  - {joint: mode, field: damping, tolerance: 0.2, unit: N s/m}
  - {joint: mode, field: stiffness, tolerance: 20, unit: N/m}
channels:
  accelerometer: {joint: mode, quantity: acceleration, noise: 0.05}
inputs:
  force: {actuator: shaker}
runs:
  - {data: run-0.csv}
  - {data: run-1.csv}
  - {data: run-2.csv, role: held_out}
effects:
  joints:
    mode: {cubic_stiffness: 5.0e+4, quadratic_damping: 1, coulomb_friction: 0.05}
  channels:
    accelerometer: {gain: 0.05}
  inputs:
    force: {gain: 0.05, delay: 0.005}
"""
MASS, STIFFNESS, DAMPING, CUBIC, NOISE = 1.0, 410.0, 0.7, 1e5, 0.05
TIMES = np.arange(0, 4, 0.004)


def recorded(cubic: float, rng: np.random.Generator) -> Array:
    """Return time, acceleration and force, (n, 3) [s, m/s^2, N]; it begins at rest."""
    rates, phases = rng.uniform(1.0, 6.0, 6), rng.uniform(0, 2 * np.pi, 6)
    force = np.sin(2 * np.pi * np.outer(TIMES, rates) + phases).sum(axis=1)
    force *= 1 - np.exp(-TIMES / 0.3)

    def pushed(t: float, x: Array) -> float:
        held = float(np.interp(t, TIMES, force))
        return (held - STIFFNESS * x[0] - cubic * x[0] ** 3 - DAMPING * x[1]) / MASS

    found = solve_ivp(
        lambda t, x: (x[1], pushed(t, x)), (0, 4), (0, 0), "LSODA", TIMES,
        rtol=1e-9, atol=1e-12, max_step=0.004,
    )  # fmt: skip
    felt = [pushed(t, x) for t, x in zip(TIMES, found.y.T, strict=True)]
    return np.column_stack([TIMES, felt + NOISE * rng.standard_normal(len(TIMES)), force])


def written(folder: Path, cubic: float = CUBIC, rig: str = RIG) -> Path:
    """Write runs of a block whose spring hardens, and a rig that takes it for straight."""
    rng = np.random.default_rng(5)
    runs = (recorded(cubic, rng) for _ in range(3))
    return write_rig(folder, rig, MODEL, "time_s,accelerometer,force", runs)


@pytest.mark.budget(25)  # a whole diagnosis
def test_a_hardening_spring_is_named_from_an_accelerometer(tmp_path: Path) -> None:
    found = diagnose(load_mechanism(written(tmp_path)), tmp_path / "out", threads=1)
    assert found.kind == "NAMED", found.reason
    (cause,) = found.causes
    assert cause.name == "mode_cubic_stiffness"
    assert cause.quantities["cubic_stiffness"].value == pytest.approx(CUBIC, rel=0.05)
    refitted = {one.name: one.now for one in found.observer.refit}
    assert refitted["mode stiffness"] == pytest.approx(STIFFNESS, rel=0.01)
    assert refitted["mode damping"] == pytest.approx(DAMPING, rel=0.05)
    assert found.removed is not None
    assert found.removed > 0.8


@pytest.mark.budget(25)  # a whole diagnosis
def test_a_straight_spring_is_clean(tmp_path: Path) -> None:
    found = diagnose(load_mechanism(written(tmp_path, 0.0)), tmp_path / "out", threads=1)
    assert (found.kind, found.causes) == ("CLEAN", ()), found.reason


def test_an_acceleration_has_no_offset(tmp_path: Path) -> None:
    rig = RIG.replace("accelerometer: {gain: 0.05}", "accelerometer: {offset: 0.05}")
    with pytest.raises(FileFaults) as refused:
        load_mechanism(written(tmp_path, rig=rig))
    assert "an acceleration is compared as the speed that it adds up to" in str(refused.value)
