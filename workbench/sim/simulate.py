"""Run one robot from rest under a given rotor speed and record its motion at 120 Hz."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, ROTOR_SPEED, TOP
from workbench.motion import rotor_angle as angle_of
from workbench.motion import rotor_speed as speed_of
from workbench.sim.equilibrium import FALLEN_M, settle, unloaded
from workbench.sim.ground import CORNER_FIELDS, corner_records
from workbench.sim.robot import STEP_S, STEPS_PER_SAMPLE, Robot, hinge_name
from workbench.timeseries import TimeSeries

__all__ = ["Outcome", "Simulation", "simulate", "staircase", "step_times"]

Outcome = Literal["completed", "fell", "diverged"]


@dataclass(frozen=True)
class Simulation:
    """What one simulation gave.

    Args:
        outcome: `fell` when T went below 0.05 m, `diverged` when the numbers blew up; the motion
            then ends there.
        motion: channels of `workbench.motion` plus hinge angles and ground forces, 120 Hz, time
            from the start of the simulation, places against the foot at rest.
        sink_m: how far the foot's centre rests below the floor.
    """

    outcome: Outcome
    motion: TimeSeries
    sink_m: float


def step_times(duration: float) -> NDArray[np.float64]:
    """Return the start times of the steps that cover a duration [s]."""
    samples = int(np.floor(duration * 120 + 1e-9))
    return np.arange(samples * STEPS_PER_SAMPLE + 1, dtype=np.float64) * STEP_S


def staircase(
    times: NDArray[np.float64], changes: Sequence[tuple[float, float]]
) -> NDArray[np.float64]:
    """Return speeds that hold each value from its time on; zero before the first.

    Args:
        times: (n,) [s].
        changes: (time [s], speed [rad/s]) in order of time.
    """
    begins = np.array([t for t, _ in changes])
    speeds = np.array([0.0] + [speed for _, speed in changes])
    return speeds[np.searchsorted(begins, times + STEP_S / 2, side="right")]


def simulate(
    robot: Robot,
    mode: Literal["hop", "clamped"],
    speed: NDArray[np.float64],
    start_angle: float,
) -> Simulation:
    """Simulate from rest.

    Args:
        robot: its parameters and shape.
        mode: foot on the ground or fixed.
        speed: (n,) motor speed at each of `step_times` [rad/s], relative to T as a motor's is.
        start_angle: where the rotor stands at rest, about +y from +x [rad].

    Raises:
        InputError: when the robot cannot be built or does not stand.
    """
    model, data = settle(unloaded(robot), mode, start_angle)
    joint = float(data.joint("rotor").qpos[0])
    travel = np.concatenate([[0.0], np.cumsum(speed[:-1]) * STEP_S])
    control = np.column_stack([joint + travel, speed])
    batch = Batch(model, nsim=1, nthread=1)
    spec = int(mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_getState(model, data, batch.state[0], spec)
    record = batch.rollout(len(speed), control[None], record=("sensordata", "userdata"))
    motion = _motion(model, robot, record["sensordata"][0], record["userdata"][0])
    sink = -float(data.qpos[2]) if mode == "hop" else 0.0
    return _cut(motion, diverged=bool(batch.warning.any()), sink=sink)


def _motion(
    model: mujoco.MjModel,
    robot: Robot,
    sensordata: NDArray[np.float64],
    userdata: NDArray[np.float64],
) -> TimeSeries:
    """Take every 17th step; sensors describe the state before a step, hence times from zero."""
    sensors = sensordata[::STEPS_PER_SAMPLE]
    times = np.arange(len(sensors), dtype=np.float64) * (STEPS_PER_SAMPLE * STEP_S)
    foot, top, rotor = (
        _sensor(model, sensors, f"{name}_position") for name in ("foot", "top", "rotor")
    )
    base = foot[0]
    angle = angle_of(top, rotor)
    columns: dict[str, NDArray[np.float64]] = {}
    for names, path in ((FOOT, foot), (TOP, top), (ROTOR, rotor)):
        columns |= dict(zip(names, (path - base).T, strict=True))
    columns[PITCH] = _pitch(_sensor(model, sensors, "foot_quaternion"))
    columns[ROTOR_ANGLE] = angle
    columns[ROTOR_SPEED] = speed_of(times, angle)
    for k in range(robot.increments):
        columns[f"{hinge_name(k)}_rad"] = _sensor(model, sensors, hinge_name(k))[:, 0]
    if model.nuserdata:
        corners = corner_records(userdata[::STEPS_PER_SAMPLE])
        for axis in "xz":
            force = corners[:, :, CORNER_FIELDS.index(f"force_{axis}_N")]
            columns[f"ground_{axis}_N"] = force.sum(axis=1)
    return TimeSeries.of(times, columns)


def _sensor(model: mujoco.MjModel, sensors: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    sensor = model.sensor(name)
    return sensors[:, sensor.adr[0] : sensor.adr[0] + sensor.dim[0]]


def _pitch(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation about +y of the foot's forward axis in the hopping plane."""
    w, x, y, z = quaternion.T
    return np.arctan2(-2 * (x * z - w * y), 1 - 2 * (y * y + z * z))


def _cut(motion: TimeSeries, *, diverged: bool, sink: float) -> Simulation:
    """End the motion where the robot fell or the numbers stopped making sense."""
    finite = np.isfinite(motion[TOP[2]]) & (np.abs(motion[TOP[2]]) < 10)
    low = ~(motion[TOP[2]] - sink >= FALLEN_M)
    bad = low | ~finite
    if not bad.any():
        return Simulation("diverged" if diverged else "completed", motion, sink)
    end = max(int(np.argmax(bad)), 1)
    outcome: Outcome = "fell" if finite[: end + 1].all() and not diverged else "diverged"
    keep = TimeSeries(motion.times[:end], motion.values[:end], motion.names, motion.valid[:end])
    return Simulation(outcome, keep, sink)
