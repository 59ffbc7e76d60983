"""The estimator on mechanisms whose data come from equations of motion written out here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from workbench.errors import InputError
from workbench.fit.estimator import Estimator
from workbench.fit.parameters import ParameterVector
from workbench.fit.systems.mjcf import HINGES, MjcfSystem
from workbench.fit.systems.mjcf_parameters import Free
from workbench.fit.systems.mjcf_runs import Channel, Input, JointStart, MjcfRun

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

    found = solve_ivp(rates, (0, times[-1]), start, "LSODA", times, rtol=1e-9, atol=1e-11,
                      max_step=0.01)  # fmt: skip
    return found.y[0]


def chirp(t: Any) -> Any:
    return 0.25 * np.sin(2 * np.pi * (0.3 + 0.1 * t) * t)


def nothing(t: Any) -> Any:
    return 0.0 * t


def noise_like(values: Array, sigma: float, rng: np.random.Generator) -> Array:
    """Return white noise whose root mean square is exactly sigma, for sharp ratios."""
    noise = rng.normal(size=values.shape)
    return sigma * noise / np.sqrt(np.mean(noise**2, axis=0))


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


def pendulum(runs: list[MjcfRun], **off: float) -> MjcfSystem:
    """Return the pendulum with numbers that are off by factors."""
    values = {name: value * off.get(name, 1.0) for name, value in TRUTH.items()}
    spec = mujoco.MjSpec.from_string(PENDULUM.format(**values))
    channels = [Channel("angle", "position", "pivot", sigma=ANGLE_NOISE)]
    return MjcfSystem(spec, channels, runs, [Input("torque", "motor")], PIVOT)


def fitted(
    system: MjcfSystem,
    noise: dict[str, float],
    start: Array | None = None,
    tolerance: float = 1e-4,
) -> tuple[dict[str, float], Array, Estimator]:
    """Return the values by name, the minimiser's numbers and the estimator."""
    vector = ParameterVector(system.parameters)
    estimator = Estimator.of(system, vector, noise, threads=1)
    at = np.zeros(len(vector)) if start is None else start
    derivatives: Any = estimator.jacobian
    x = least_squares(estimator.residuals, at, derivatives, bounds=vector.bounds,
                      xtol=tolerance, ftol=tolerance).x  # fmt: skip
    return {p.name: value for p, value in vector.values(x).items()}, x, estimator


def ratios(estimator: Estimator, x: Array) -> Array:
    """Return the root mean square of each run's whitened innovations."""
    return np.array([np.sqrt(np.mean(one.white**2)) for one in estimator.innovations(x)])


def test_innovations_at_the_true_pendulum_are_the_noise(pendulum_runs):
    _, x, estimator = fitted(pendulum(pendulum_runs).freeing([]), {HINGES: 3e-5})
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


def test_a_ball_joint_is_refused(pendulum_runs):
    spec = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><body name='top'><joint name='hip' type='ball'/>"
        "<geom size='0.1'/></body></worldbody></mujoco>"
    )
    with pytest.raises(InputError, match="joint 'hip' of body 'top' is a ball joint"):
        MjcfSystem(spec, [], pendulum_runs)
