"""Effects of the drive, each by what follows from it and not by its own formula."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.motion import PITCH, ROTOR_ANGLE
from workbench.sim import (
    EFFECTS,
    SAMPLE_RATE_HZ,
    Condition,
    Robot,
    Simulation,
    sample_times,
    simulate,
    simulate_all,
)
from workbench.sim.drive import add_drive
from workbench.sim.droop_ripple import add_droop, add_ripple
from workbench.timeseries import TimeSeries

DRIVE = [effect for effect in EFFECTS.values() if effect.group == "drive"]
QUANTITIES = [(effect.name, quantity) for effect in DRIVE for quantity in effect.quantities]
SPEED = 13.0
ROTOR_WEIGHT = 0.1


def with_effect(robot: Robot, name: str, **values: float) -> Robot:
    return replace(robot, effects={name: values})


def clamped(speed: float = SPEED, duration: float = 4.0) -> Condition:
    return Condition("clamped", np.full(len(sample_times(duration)), speed))


def against_top(motion: TimeSeries) -> NDArray[np.float64]:
    """The rotor's angle as the motor has it: in the world, less the turn of T."""
    turn = motion[PITCH] + sum(motion[n] for n in motion.names if n.startswith("hinge_"))
    return motion[ROTOR_ANGLE] - turn


def speed_of(simulation: Simulation) -> NDArray[np.float64]:
    """Mean speed of the motor between samples."""
    return np.diff(against_top(simulation.motion)) * SAMPLE_RATE_HZ


def bench_rotor(weight: float = 0.0) -> mujoco.MjSpec:
    """A rotor on a fixed axle, `weight` the moment of its weight when it lies level [N m]."""
    spec = mujoco.MjSpec()
    spec.option.gravity = [0, 0, -weight / (0.01 * 0.03)]
    spec.option.timestep = 1 / 4080
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    body = spec.worldbody.add_body(name="rotor", mass=0.01, ipos=[0.03, 0, 0])
    body.inertia, body.explicitinertial = [4e-5] * 3, True
    body.add_joint(name="rotor", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    add_drive(spec, "speed")
    return spec


def turned(spec: mujoco.MjSpec, command: float, load: float, seconds: float) -> mujoco.MjData:
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[:], data.qfrc_applied[:] = command, -load
    mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))
    return data


@pytest.mark.parametrize(("name", "quantity"), QUANTITIES)
def test_zero_is_absence_and_a_step_moves_the_rotor(robot: Robot, name: str, quantity) -> None:
    size = max(quantity.step, 1e-3 * quantity.tolerance)
    robots = [robot, *(with_effect(robot, name, **{quantity.name: x}) for x in (0.0, size))]
    base, absent, moved = simulate_all([(r, clamped(duration=1.0)) for r in robots])
    assert np.array_equal(base.motion.values, absent.motion.values)
    assert np.abs(against_top(moved.motion) - against_top(base.motion)).max() > 1e-8


@pytest.mark.parametrize(("name", "quantity"), QUANTITIES)
def test_a_finite_difference_over_its_step_is_a_derivative(
    robot: Robot, name: str, quantity
) -> None:
    """Half the step gives the same slope within 2 %: neither rounding nor curvature shows."""
    steps = (0.0, quantity.step / 2, quantity.step)
    robots = [with_effect(robot, name, **{quantity.name: x}) for x in steps]
    base, half, full = (
        against_top(s.motion) for s in simulate_all([(r, clamped(duration=1.0)) for r in robots])
    )
    slope = (full - base) / quantity.step
    assert (half - base) / (quantity.step / 2) == pytest.approx(
        slope, abs=0.02 * float(np.abs(slope).max())
    )


@pytest.mark.parametrize("speed", [9.0, -9.0])
def test_an_offset_is_the_same_at_every_speed_and_none_while_the_motor_is_off(
    robot: Robot, speed: float
) -> None:
    command = np.concatenate([np.zeros(120), np.full(360, speed), np.full(360, 1.5 * speed)])
    condition = Condition("clamped", command)
    base, fast = (
        speed_of(simulate(r, condition))
        for r in (robot, with_effect(robot, "speed_offset", offset=0.4))
    )
    assert np.abs(fast[:119]).max() < 1e-6
    for part in (slice(240, 470), slice(600, 830)):
        assert abs(fast[part].mean()) - abs(base[part].mean()) == pytest.approx(0.4, abs=0.01)


def test_a_drift_grows_evenly_with_time(robot: Robot) -> None:
    rate, duration = 0.004, 8.0
    angle, plain = (
        against_top(simulate(r, clamped(SPEED, duration)).motion)
        for r in (with_effect(robot, "speed_drift", rate=rate), robot)
    )
    times = sample_times(duration)
    gained = angle - plain  # the integral of speed * rate * time
    assert gained == pytest.approx(0.5 * SPEED * rate * times**2, abs=0.005)


def test_a_loaded_motor_with_droop_follows_a_falling_line() -> None:
    slope = 40.0
    loads = np.array([-0.05, 0.0, 0.05, 0.1])
    speeds = []
    for load in loads:
        spec = bench_rotor()
        add_droop(spec, slope)
        speeds.append(float(turned(spec, 17.0, load, 2.0).qvel[0]))
    assert speeds == pytest.approx(17.0 - slope * loads, abs=1e-4)


def test_the_speed_falls_in_proportion_to_the_torque_that_turns_the_rotor(robot: Robot) -> None:
    """Torque from the rotor's own power balance: what the motor gives over how fast it turns."""
    slope = 30.0
    result = simulate(with_effect(robot, "motor_droop", slope=slope), clamped(11.0, 6.0))
    power = result.motion["motor_power_W"]
    speed = np.gradient(against_top(result.motion)) * SAMPLE_RATE_HZ
    steady = slice(240, -1)
    torque, lost = power[steady] / speed[steady], 11.0 - speed[steady]
    fitted = np.polyfit(torque, lost, 1)
    assert fitted[0] == pytest.approx(slope, rel=0.03)
    assert fitted[1] == pytest.approx(0.0, abs=0.02)
    assert np.corrcoef(torque, lost)[0, 1] > 0.99


def test_droop_shows_most_where_t_swings_most(robot: Robot) -> None:
    droopy = with_effect(robot, "motor_droop", slope=20.0)
    speeds = (6.0, 9.0, 12.0, 15.0, 18.0)
    results = simulate_all([(droopy, clamped(w, 8.0)) for w in speeds])
    late = slice(480, None)
    swing = [np.ptp(r.motion["top_x_m"][late]) + np.ptp(r.motion["top_z_m"][late]) for r in results]
    lost = [w - speed_of(r)[late].mean() for w, r in zip(speeds, results, strict=True)]
    assert np.argmax(lost) == np.argmax(swing)
    assert max(lost) > 3 * min(lost)


def test_the_gearbox_holds_a_rotor_whose_motor_is_off() -> None:
    spec = bench_rotor(ROTOR_WEIGHT)
    add_droop(spec, 100.0)
    held = turned(spec, 0.0, 0.0, 3.0)
    assert held.qpos[0] == pytest.approx(ROTOR_WEIGHT / 20 * (1 + 100 * 0.1), rel=0.01)
    assert held.qvel[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "wave"),
    [
        ("cos_1", np.cos),
        ("sin_1", np.sin),
        ("cos_2", lambda p: np.cos(2 * p)),
        ("sin_2", lambda p: np.sin(2 * p)),
    ],
)
def test_the_speed_s_harmonic_against_the_world_angle_is_the_ripple(
    robot: Robot, name: str, wave
) -> None:
    result = simulate(with_effect(robot, "speed_ripple", **{name: 0.05}), clamped(9.0, 6.0))
    angle = result.motion[ROTOR_ANGLE]
    middle = (angle[1:] + angle[:-1])[240:] / 2
    speed = speed_of(result)[240:] / 9.0
    waves = [f(k * middle) for k in (1, 2) for f in (np.cos, np.sin)]
    basis = np.column_stack([np.ones_like(middle), *waves])
    shares = np.linalg.lstsq(basis, speed)[0][1:]
    expected = [0.05 if np.allclose(w, wave(middle)) else 0.0 for w in waves]
    assert shares == pytest.approx(expected, abs=0.002)


def test_the_ripple_turns_with_the_world_and_not_with_t() -> None:
    """A turn of the whole bench shifts the phase against T by that turn."""
    spec = bench_rotor()
    spec.body("rotor").quat = [np.cos(0.5), 0, np.sin(0.5), 0]  # 1 rad about +y
    add_ripple(spec, [0.1, 0.0, 0.0, 0.0])
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[:] = 5.0
    angles, speeds = [], []
    for _ in range(3):
        for _ in range(2000):
            mujoco.mj_step(model, data)
            angles.append(data.qpos[0])
            speeds.append(data.qvel[0])
    basis = np.column_stack([np.ones(4000), np.cos(angles[2000:]), np.sin(angles[2000:])])
    _, c, s = np.linalg.lstsq(basis, np.array(speeds[2000:]))[0] / 5.0
    assert (c, s) == pytest.approx((0.1 * np.cos(1), -0.1 * np.sin(1)), abs=0.001)


def test_droop_and_ripple_together_do_not_depend_on_their_order(robot: Robot) -> None:
    both = {"motor_droop": {"slope": 20.0}, "speed_ripple": {"sin_1": 0.03}}
    swapped = dict(reversed(both.items()))
    first, second = simulate_all([(replace(robot, effects=e), clamped()) for e in (both, swapped)])
    assert np.array_equal(first.motion.values, second.motion.values)
    alone = simulate(replace(robot, effects={"motor_droop": both["motor_droop"]}), clamped())
    assert np.abs(first.motion.values - alone.motion.values).max() > 1e-3


@pytest.mark.parametrize("name", ["motor_droop", "speed_ripple"])
def test_a_motor_that_is_not_driven_by_speed_is_refused(robot: Robot, name: str) -> None:
    quantity = EFFECTS[name].quantities[0].name
    condition = replace(clamped(4.0), drive="voltage")
    with pytest.raises(InputError, match=rf"effect {name} changes how the drive 'speed' turns"):
        simulate(with_effect(robot, name, **{quantity: 0.01}), condition)
