"""The estimator on mechanisms whose data come from equations of motion written out here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.fit.recovery import fitted, noise_like, ratios
from workbench.errors import InputError
from workbench.fit import (
    Channel,
    Estimator,
    Free,
    Input,
    JointStart,
    MjcfRun,
    MjcfSystem,
    ParameterVector,
)
from workbench.fit.gain import stationary
from workbench.fit.systems.mjcf import HINGES

Array = NDArray[np.float64]
Force = Callable[[Any], Any]

GRAVITY = 9.81
ANGLE_NOISE = 5e-4  # [rad]

PENDULUM = """
<mujoco>
  <option timestep="0.001" integrator="RK4"/>
  <worldbody>
    <body name="arm">
      <joint name="pivot" axis="0 1 0" damping="{damping}" stiffness="{stiffness}"
             frictionloss="{friction}" solreffriction="0.002 1"/>
      <inertial pos="0 0 -0.25" mass="0.4" diaginertia="0.002 0.002 0.0001"/>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="pivot"/></actuator>
</mujoco>
"""
TRUTH = {"damping": 0.006, "friction": 0.012, "stiffness": 0.15}
PIVOT = [
    Free("damping", "pivot", 2e-3, flat=True),
    Free("frictionloss", "pivot", 4e-3, flat=True),
    Free("stiffness", "pivot", 0.05, flat=True),
]


def swung(times: Array, torque: Force, start: tuple[float, float]) -> Array:
    """Return the pendulum's true angles, (n,)."""
    inertia = 0.002 + 0.4 * 0.25**2

    def rates(t: float, x: Array) -> list[float]:
        moment = torque(t) - 0.4 * GRAVITY * 0.25 * np.sin(x[0]) - TRUTH["stiffness"] * x[0]
        moment -= TRUTH["damping"] * x[1] + TRUTH["friction"] * np.tanh(x[1] / 2e-4)
        return [x[1], moment / inertia]

    found = solve_ivp(
        rates, (0, times[-1]), start, "LSODA", times, rtol=1e-9, atol=1e-11, max_step=0.01
    )
    return found.y[0]


def chirp(t: Any) -> Any:
    return 0.25 * np.sin(2 * np.pi * (0.3 + 0.1 * t) * t)


def nothing(t: Any) -> Any:
    return 0.0 * t


@pytest.fixture(scope="module")
def pendulum_runs() -> list[MjcfRun]:
    rng, runs = np.random.default_rng(1), []
    times, stamps = np.arange(0, 4, 0.02), np.arange(0, 4, 0.004)
    for name, torque, start in (("chirp", chirp, (0.3, 0.0)), ("decay", nothing, (0.9, 0.5))):
        angles = swung(times, torque, start)
        angles += noise_like(times, ANGLE_NOISE, rng)
        guess = JointStart.seen(times, angles, ANGLE_NOISE)
        control = torque(stamps)[:, None]
        runs.append(MjcfRun(name, times, angles[:, None], {"pivot": guess}, stamps, control))
    return runs


def pendulum(runs: list[MjcfRun], free: Sequence[Free] = PIVOT, **off: float) -> MjcfSystem:
    """Return the pendulum with numbers that are off by factors."""
    values = {name: value * off.get(name, 1.0) for name, value in TRUTH.items()}
    spec = mujoco.MjSpec.from_string(PENDULUM.format(**values))
    channels = [Channel("angle", "position", "pivot", sigma=ANGLE_NOISE)]
    return MjcfSystem(spec, channels, runs, [Input("torque", "motor")], free)


def test_innovations_at_the_true_pendulum_are_the_noise(pendulum_runs):
    _, x, estimator = fitted(pendulum(pendulum_runs, []), {HINGES: 3e-5})
    assert ratios(estimator, x) == pytest.approx(1, abs=0.05)


def test_a_pendulum_thirty_percent_off_is_recovered(pendulum_runs):
    off = pendulum(pendulum_runs, damping=1.3, friction=0.7, stiffness=1.3)
    values, x, estimator = fitted(off, {HINGES: 1e-4})
    assert values["pivot damping"] == pytest.approx(TRUTH["damping"], rel=0.04)
    assert values["pivot frictionloss"] == pytest.approx(TRUTH["friction"], rel=0.04)
    assert values["pivot stiffness"] == pytest.approx(TRUTH["stiffness"], rel=0.02)
    assert ratios(estimator, x) == pytest.approx(1, abs=0.05)


def test_a_far_start_converges_from_strong_to_weak_correction(pendulum_runs):
    off = pendulum(pendulum_runs, damping=4, friction=0.2, stiffness=8)
    _, x, _ = fitted(off, {HINGES: 1e-3}, tolerance=1e-2)
    values, _, _ = fitted(off, {HINGES: 1e-4}, x)
    assert values["pivot damping"] == pytest.approx(TRUTH["damping"], rel=0.06)
    assert values["pivot frictionloss"] == pytest.approx(TRUTH["friction"], rel=0.06)
    assert values["pivot stiffness"] == pytest.approx(TRUTH["stiffness"], rel=0.03)


ARM = """
<mujoco>
  <option timestep="0.0025" integrator="RK4"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" damping="0.02"/>
      <inertial pos="0 0 -0.12" mass="0.8" diaginertia="0.006 0.006 0.0001"/>
      <body name="lower" pos="0 0 -0.3">
        <joint name="elbow" axis="0 1 0" damping="{damping}" stiffness="{stiffness}"/>
        <inertial pos="0 0 -0.1" mass="{mass}" diaginertia="0.003 0.003 0.0001"/>
        <site name="tip" pos="0 0 -0.25"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="shoulder" gear="{gear}"/></actuator>
</mujoco>
"""
ARM_TRUTH = {"damping": 0.01, "stiffness": 0.4, "mass": 0.5, "gear": 2.0}
ARM_NOISE = (1.5e-4, 1.5e-4, 5e-3)  # [m], [m], [rad/s]
ARM_CHANNELS = [
    Channel("tip x", "site", "tip", axis=(1, 0, 0), sigma=ARM_NOISE[0]),
    Channel("tip z", "site", "tip", axis=(0, 0, 1), sigma=ARM_NOISE[1]),
    Channel("rate", "speed", "shoulder", sigma=ARM_NOISE[2]),
]
ARM_FREE = [
    Free("damping", "elbow", 3e-3, flat=True),
    Free("stiffness", "elbow", 0.1, flat=True),
    Free("mass", "lower", 0.1, flat=True),
    Free("inertia", "lower", 0.3, flat=True),
    Free("gear", "motor", 0.5, flat=True),
]


def reached(times: Array, torque: Force, start: tuple[float, ...]) -> Array:
    """Return the two-link arm's true channels, (n, 3), from Lagrange's equations."""
    m1, m2, reach, c1, c2, i1, i2 = 0.8, 0.5, 0.3, 0.12, 0.1, 0.006, 0.003

    def rates(t: float, x: Array) -> list[float]:
        a, b, va, vb = x
        both, coupling = i2 + m2 * c2**2, m2 * reach * c2
        m11 = i1 + m1 * c1**2 + m2 * reach**2 + both + 2 * coupling * np.cos(b)
        m12 = both + coupling * np.cos(b)
        upper = 2 * torque(t) - 0.02 * va + coupling * np.sin(b) * (2 * va * vb + vb**2)
        upper -= GRAVITY * ((m1 * c1 + m2 * reach) * np.sin(a) + m2 * c2 * np.sin(a + b))
        lower = -0.01 * vb - 0.4 * b - coupling * np.sin(b) * va**2
        lower -= GRAVITY * m2 * c2 * np.sin(a + b)
        return [va, vb, *np.linalg.solve([[m11, m12], [m12, both]], [upper, lower])]

    a, b, va, _ = solve_ivp(rates, (0, times[-1]), start, "DOP853", times, rtol=1e-10, atol=1e-12).y
    x = -0.3 * np.sin(a) - 0.25 * np.sin(a + b)
    return np.column_stack([x, -0.3 * np.cos(a) - 0.25 * np.cos(a + b), va])


def sweep(t: Any) -> Any:
    return 0.4 * np.sin(2 * np.pi * (0.4 + 0.3 * t) * t)


@pytest.fixture(scope="module")
def arm_runs() -> list[MjcfRun]:
    rng, runs = np.random.default_rng(2), []
    times, stamps = np.arange(0, 4, 0.01), np.arange(0, 4, 0.005)
    for name, torque, start in (
        ("swept", sweep, (0.0, 0.0, 0.0, 0.0)),
        ("thrown", nothing, (0.8, -0.6, 0.4, 0.0)),
    ):
        values = reached(times, torque, start)
        values += noise_like(values, 1.0, rng) * ARM_NOISE
        guesses = {
            "shoulder": JointStart(start[0] + 0.01, 0.02, start[2] - 0.1, 0.1),
            "elbow": JointStart(start[1] - 0.01, 0.02, start[3] + 0.1, 0.1),
        }
        values[50:60] = np.nan  # nothing was seen
        values[80:90, 1] = np.nan  # one channel was not
        runs.append(MjcfRun(name, times, values, guesses, stamps, torque(stamps)[:, None]))
    return runs


def arm(runs: list[MjcfRun], free: Sequence[Free] = ARM_FREE, **off: float) -> MjcfSystem:
    values = {name: value * off.get(name, 1.0) for name, value in ARM_TRUTH.items()}
    spec = mujoco.MjSpec.from_string(ARM.format(**values))
    return MjcfSystem(spec, ARM_CHANNELS, runs, [Input("torque", "motor")], free)


def test_innovations_of_places_and_a_speed_are_the_noise_at_the_true_arm(arm_runs):
    _, x, estimator = fitted(arm(arm_runs, []), {HINGES: 3e-5})
    assert ratios(estimator, x) == pytest.approx(1, abs=0.05)


def test_an_arm_whose_numbers_are_off_is_recovered_with_its_starts(arm_runs):
    off = arm(arm_runs, damping=1.3, stiffness=0.7, mass=1.3, gear=0.7)
    values, x, estimator = fitted(off, {HINGES: 1e-4})
    assert values["elbow damping"] == pytest.approx(ARM_TRUTH["damping"], rel=0.02)
    assert values["elbow stiffness"] == pytest.approx(ARM_TRUTH["stiffness"], rel=0.01)
    assert values["lower mass"] == pytest.approx(ARM_TRUTH["mass"], rel=0.01)
    assert values["lower inertia"] == pytest.approx(1.3, rel=0.02)  # it went with the mass
    assert values["motor gear"] == pytest.approx(ARM_TRUTH["gear"], rel=0.01)
    assert values["shoulder at the start of thrown"] == pytest.approx(0.8, abs=2e-3)
    assert ratios(estimator, x) == pytest.approx(1, abs=0.05)


def test_a_speed_that_is_seen_makes_the_observer_surer_of_speeds(arm_runs):
    with_speed, places = arm(arm_runs), [run.values[:, :2] for run in arm_runs]
    runs = [replace(run, values=v) for run, v in zip(arm_runs, places, strict=True)]
    without = MjcfSystem(with_speed.spec, ARM_CHANNELS[:2], runs, [Input("torque", "motor")])
    rates = [
        np.trace(
            stationary(s.modes(0), s.process(0, {HINGES: 1e-3}), s.sigma(0), s.sample_s).covariance[
                2:, 2:
            ]
        )
        for s in (with_speed, without)
    ]
    assert rates[0] < 0.9 * rates[1]


CHAIN_LINKS = 10


def chain(links: int) -> str:
    body = '<site name="tip" pos="0 0 -0.05"/>'
    for i in reversed(range(links)):
        body = (
            f'<body pos="0 0 {-0.05 if i else 0}"><joint name="j{i}" axis="0 1 0" damping="2e-4" '
            'stiffness="0.3"/><inertial pos="0 0 -0.025" mass="0.02" diaginertia="5e-6 5e-6 1e-6"/>'
            f"{body}</body>"
        )
    return f'<mujoco><option timestep="0.001"/><worldbody>{body}</worldbody></mujoco>'


def test_of_a_long_chain_only_the_lowest_modes_are_corrected(arm_runs):
    times = arm_runs[0].times
    channels = [Channel("x", "site", "tip", axis=(1, 0, 0), sigma=2e-4)]
    run = MjcfRun("still", times, noise_like(times[:, None], 2e-4, np.random.default_rng(4)))
    system = MjcfSystem(mujoco.MjSpec.from_string(chain(CHAIN_LINKS)), channels, [run], modes=3)
    estimator = Estimator.of(system, ParameterVector(()), {HINGES: 1e-3}, threads=1)
    found = estimator.innovations(np.zeros(0), keep=True)[0]
    basis, moved = estimator.gains[0].basis, found.qpos[1]
    assert basis.shape == (CHAIN_LINKS, 3)
    within = basis @ np.linalg.lstsq(basis, moved, rcond=None)[0]
    assert np.linalg.norm(moved - within) < 0.1 * np.linalg.norm(moved)
    assert found.sane == len(times)


def test_a_ball_joint_is_refused(pendulum_runs):
    spec = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><body name='top'><joint name='hip' type='ball'/>"
        "<geom size='0.1'/></body></worldbody></mujoco>"
    )
    with pytest.raises(InputError, match="joint 'hip' of body 'top' is a ball joint"):
        MjcfSystem(spec, [], pendulum_runs)
