"""Each drive against the line it stands for."""

from __future__ import annotations

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from workbench.motion import PITCH, ROTOR_ANGLE
from workbench.sim import (
    MOTOR,
    Condition,
    Drive,
    Motor,
    Robot,
    Simulation,
    motor,
    sample_times,
    simulate,
)
from workbench.sim.drive import DRIVES, add_drive

ROTOR_INERTIA = 0.0334 * 0.035**2 + 0.008 * 0.035**2 / 3  # about the shaft [kg m^2]


def bench_rotor(drive: Drive) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A rotor on a fixed axle, in balance, so that only the drive turns it."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 1 / 4080
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    body = spec.worldbody.add_body(name="rotor", mass=0.0414, inertia=[ROTOR_INERTIA] * 3)
    body.explicitinertial = True
    body.add_joint(name="rotor", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    add_drive(spec, drive)
    model = spec.compile()
    return model, mujoco.MjData(model)


def steady_speed(volts: float, load: float) -> float:
    """Speed of the DC motor after two seconds against a torque [N m]."""
    model, data = bench_rotor("voltage")
    data.ctrl[:] = volts
    data.qfrc_applied[:] = -load
    mujoco.mj_step(model, data, nstep=round(2 / model.opt.timestep))
    return float(data.qvel[0])


def free_speed(one: Motor, volts: float) -> float:
    """The speed behind the gearbox without load [rad/s], in closed form."""
    left = volts - one.no_load_current * one.resistance
    return max(left, 0.0) / (one.back_emf * one.gear)


def run(robot: Robot, drive: Drive, value: float, duration: float = 6.0) -> Simulation:
    command = np.full(len(sample_times(duration)), value)
    return simulate(robot, Condition("clamped", command, drive=drive))


def against_top(simulation: Simulation) -> np.ndarray:
    """The rotor's angle as the motor has it: in the world, less the turn of T."""
    motion = simulation.motion
    turn = motion[PITCH] + sum(motion[n] for n in motion.names if n.startswith("hinge_"))
    return motion[ROTOR_ANGLE] - turn


@pytest.mark.parametrize("drive", DRIVES)
def test_every_drive_takes_its_command_at_all_its_actuators(robot: Robot, drive: Drive) -> None:
    result = run(robot, drive, 0.0, 0.5)
    assert result.outcome == "completed"
    assert np.ptp(against_top(result)) < 1e-3  # nothing turns the rotor that hangs at rest


def test_a_constant_torque_accelerates_the_rotor_by_torque_over_inertia(robot: Robot) -> None:
    stiff = {"gravity": 0.0, "hinge_stiffness": 100.0, "root_stiffness": 100.0}
    stiff |= {"hinge_damping": 0.1, "root_damping": 0.1, "top_mass": 1e3}  # T stands still
    rigid = replace(robot, values=dict(robot.values) | stiff)
    torque = 1e-5
    turned = against_top(run(rigid, "torque", torque, 2.0))
    times = sample_times(2.0)
    expected = 0.5 * torque / ROTOR_INERTIA * times**2
    assert turned - turned[0] == pytest.approx(expected, rel=0.01, abs=1e-5)


def test_a_constant_torque_on_the_bench_is_exact() -> None:
    model, data = bench_rotor("torque")
    data.ctrl[:] = 1e-3
    mujoco.mj_step(model, data, nstep=4080)
    assert data.qvel[0] == pytest.approx(1e-3 / ROTOR_INERTIA, rel=1e-6)


@pytest.mark.parametrize("volts", [1.0, 3.0, 5.5])
def test_the_motor_runs_free_at_the_data_sheet_s_speed(volts: float) -> None:
    assert steady_speed(volts, 0.0) == pytest.approx(free_speed(MOTOR, volts), rel=0.01)


def test_the_motor_follows_the_data_sheet_s_line_from_free_running_to_stall() -> None:
    free, stall = 12300 * 2 * np.pi / 60 / 115, 3.53e-3 * 115 * 0.85**4
    loads = np.array([0.0, 0.3, 0.6, 0.9]) * stall
    speeds = [steady_speed(3.0, load) for load in loads]
    assert speeds == pytest.approx(free * (1 - loads / stall), rel=0.01)
    at_rest = np.polyfit(speeds, loads, 1)[1]
    assert at_rest == pytest.approx(stall, rel=0.01)
    assert steady_speed(3.0, 1.02 * stall) == pytest.approx(0, abs=1e-6)


def test_short_circuited_the_motor_brakes_by_back_emf_and_friction() -> None:
    model, data = bench_rotor("voltage")
    data.ctrl[:] = 3.0
    mujoco.mj_step(model, data, nstep=8000)
    data.ctrl[:] = 0.0
    mujoco.mj_forward(model, data)
    emf = MOTOR.back_emf * MOTOR.gear * data.qvel[0]
    assert emf == pytest.approx(3.0 - 0.15 * 3.0 / 2.10, rel=0.01)  # what 0.15 A leaves of 3 V
    torque = MOTOR.torque_constant * emf / MOTOR.resistance + MOTOR.friction
    assert data.actuator_force[0] == pytest.approx(-MOTOR.passed_on * torque, rel=0.01)


def test_armature_and_gear_slow_the_start() -> None:
    """Free of load the speed rises with the motor's own time constant, near 0.07 s."""
    model, data = bench_rotor("voltage")
    inertia = ROTOR_INERTIA + 115**2 * MOTOR.armature
    slope = MOTOR.passed_on * MOTOR.torque_constant * MOTOR.back_emf * 115 / MOTOR.resistance
    constant = inertia / slope
    data.ctrl[:] = 3.0
    mujoco.mj_step(model, data, nstep=round(constant / model.opt.timestep))
    assert data.qvel[0] == pytest.approx(free_speed(MOTOR, 3.0) * (1 - np.exp(-1)), rel=0.01)
    assert constant == pytest.approx(0.072, abs=0.002)


def test_friction_holds_the_motor_below_its_starting_voltage() -> None:
    drop = MOTOR.no_load_current * MOTOR.resistance
    assert steady_speed(0.9 * drop, 0.0) == pytest.approx(0, abs=1e-4)
    assert steady_speed(1.1 * drop, 0.0) > 0.05


def test_the_motor_turns_steadily_but_for_the_weight_it_lifts(robot: Robot) -> None:
    speed = np.diff(against_top(run(robot, "voltage", 4.5, 8.0))) * 120
    early, late = speed[3 * 120 : 5 * 120], speed[5 * 120 :]
    assert early.mean() == pytest.approx(late.mean(), rel=0.02)
    assert late.mean() == pytest.approx(free_speed(MOTOR, 4.5), rel=0.05)
    assert 0.2 < np.ptp(late) < 4


def test_the_thesis_line_lies_within_a_tenth_from_three_volts_on() -> None:
    """Eq. 5.7, omega = 4.4 U - 2.9, is of the real robot; nothing here was fitted to it."""
    for volts in (3.0, 4.0, 5.0, 5.5):
        assert free_speed(MOTOR, volts) == pytest.approx(4.4 * volts - 2.9, rel=0.1)
    assert free_speed(MOTOR, 1.0) > 2 * (4.4 - 2.9)  # the gears' own friction is not in the sheet


def test_the_motor_s_docstring_lists_its_free_speeds() -> None:
    rows = re.findall(r"^ +([\d.]+) +([\d.]+) +([\d.]+) +([\d.]+)$", motor.__doc__ or "", re.M)
    assert len(rows) == 6
    other = Motor("FA-130RA-2270", 1.5, 9100 * 2 * np.pi / 60, 0.20, 2.55e-3, 2.20)
    for volts, *speeds in ([float(number) for number in row] for row in rows):
        motors = [free_speed(one, volts) for one in (MOTOR, other)]
        assert speeds == pytest.approx([*motors, 4.4 * volts - 2.9], abs=0.051)


def test_the_servo_holds_its_speed(robot: Robot) -> None:
    turned = against_top(run(robot, "speed", 17.0))
    assert (turned[-1] - turned[120]) / 5 == pytest.approx(17.0, rel=1e-3)
    assert turned - turned[0] == pytest.approx(17.0 * sample_times(6.0), abs=5e-3)
