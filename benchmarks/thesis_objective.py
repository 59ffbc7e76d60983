"""The thesis' fmincon criterion, Appendix D, as printed: kept to show beside a fit what it does.

Its own text says that no satisfying results were found. The reason is in the formula: `tracklsq`
looks at no measured data. It rewards whatever makes T swing far up and down near the drive's
frequency, so its minimum is a robot in resonance with 20.5 rad/s, not the robot on the bench.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import mujoco
import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.sim import Robot, compile_model, require_stable

__all__ = [
    "FMINCON_HIGH",
    "FMINCON_LOW",
    "FMINCON_ORDER",
    "FMINCON_START",
    "MOST_ITERATIONS",
    "OMEGA_RAD_S",
    "SAMPLES",
    "SAMPLING_S",
    "FminconFit",
    "criterion_value",
    "fmincon_criterion",
    "fmincon_fit",
    "fmincon_index",
    "free_swing",
]

OMEGA_RAD_S = 20.5
SAMPLES = 20_001
SAMPLING_S = 0.001
FMINCON_ORDER = ("hinge_stiffness", "hinge_damping", "root_stiffness", "root_damping")
"""k_Leg_n, d_Leg_n, k_T and d_T [N m/rad] and [N m s/rad]."""
FMINCON_START = (2.05, 0.06, 14.1, 0.3)
FMINCON_LOW = (2.0, 0.001, 2.0, 0.001)
FMINCON_HIGH = (40.0, 5.0, 40.0, 5.0)

_CONSTANT = 10_000.0
_BESIDE = 20  # entries of the spectrum that are looked at either side of the index
_X_WEIGHT = 0.5
_CHANGE = 1e-5  # TolFun
_STEPS_PER_SAMPLE = 8  # of the engine: the stiffest beam within the bounds allows 0.129 ms
_ROTOR_START = np.pi / 2  # [rad] below T
MOST_ITERATIONS = 100

Criterion = Callable[[Robot], float]


@dataclass(frozen=True)
class FminconFit:
    """Where the thesis' minimisation ends.

    Args:
        values: of the four parameters, SI.
        criterion: there.
        criterion_at_start: where it began.
        evaluations: simulations of 20 s.
        message: why it ended, in the words of the optimiser.
    """

    values: Mapping[str, float]
    criterion: float
    criterion_at_start: float
    evaluations: int
    message: str


def fmincon_index() -> int:
    """Return `Index`, the entry that Appendix D takes for the drive: 65, in MATLAB counted from 1.

    round(20.5 / (2 pi) * 20001 * 0.001) is the number of turns in 20.001 s. Entry 1 of MATLAB's fft
    is the mean, so that 65 turns stand in entry 66: the index is one too low. The window hides it.
    """
    return round(OMEGA_RAD_S / (2 * np.pi) * SAMPLES * SAMPLING_S)


def criterion_value(top: NDArray[np.float64]) -> float:
    """Return F of Appendix D for a motion of T.

    F = 10000 - max |Z(Index-20:Index+20)| + 0.5 max |X(Index-20:Index+20)|, X and Z being the sums
    of an FFT without a factor [m]. The 41 entries span 2.2 to 4.2 Hz, that is 13.8 to 26.4 rad/s:
    not the drive's frequency, but whatever is strongest around it.

    Args:
        top: (20001, 2) x and z of T, sampled at 1 kHz [m].

    Raises:
        InputError: for another number of samples, since the index would mean another frequency.
    """
    if top.shape != (SAMPLES, 2):
        raise InputError(
            f"the criterion of Appendix D takes x and z of T in {SAMPLES} samples at 1 kHz, "
            f"not an array of shape {top.shape}; simulate 20 s, or resample the motion"
        )
    size = np.abs(np.fft.fft(top, axis=0))
    entry = fmincon_index() - 1  # Python counts from zero
    x, z = size[entry - _BESIDE : entry + _BESIDE + 1].max(axis=0)
    return float(_CONSTANT - z + _X_WEIGHT * x)


def free_swing(robot: Robot) -> NDArray[np.float64]:
    """Simulate what Appendix D looks at: x and z of T, (20001, 2) [m], at 1 kHz.

    The foot is clamped and the rotor turns at 20.5 rad/s from the first instant. As in the thesis'
    model the hinges begin where their springs rest (section 3.3.3), so that gravity sets the beam
    swinging: some parameters within the bounds, the start among them, belong to a beam that cannot
    stand, and `simulate`, which begins at rest and records at 120 Hz, refuses those.

    Raises:
        InputError: when the beam is too stiff for the step.
    """
    model = compile_model(robot, "fixed")
    model.opt.timestep = SAMPLING_S / _STEPS_PER_SAMPLE
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos_spring
    mujoco.mj_forward(model, data)
    arm = data.site("rotor").xpos - data.body("top").xpos
    data.joint("rotor").qpos[:] = _ROTOR_START - np.arctan2(-arm[2], arm[0])
    data.act[:] = data.joint("rotor").qpos
    data.ctrl[:] = OMEGA_RAD_S
    mujoco.mj_forward(model, data)
    require_stable(model, data)
    top = np.empty((SAMPLES, 2))
    place = data.body("top").xpos
    for k in range(SAMPLES):
        top[k] = place[0], place[2]
        mujoco.mj_step(model, data, nstep=_STEPS_PER_SAMPLE)
    return top


def fmincon_criterion(robot: Robot) -> float:
    """Return F of Appendix D for a robot; the smaller, the better it is held to be.

    Raises:
        InputError: when the beam is too stiff for the step.
    """
    return criterion_value(free_swing(robot))


def fmincon_fit(
    robot: Robot, criterion: Criterion = fmincon_criterion, iterations: int = MOST_ITERATIONS
) -> FminconFit:
    """Minimise the criterion of Appendix D from its start within its bounds.

    The thesis asks fmincon for `trust-region-reflective`, which needs gradients; it gives none, and
    MATLAB then falls back to `active-set`, a sequential quadratic programme with forward
    differences. Scipy's SLSQP is that method; `TolFun` is its `ftol`, `TolX` has no counterpart.

    Args:
        robot: everything but the four parameters.
        criterion: of a robot with the four parameters replaced.
        iterations: of the optimiser, at most.

    Raises:
        InputError: when a beam on the way is too stiff for the step.
    """

    def value(x: NDArray[np.float64]) -> float:
        named = dict(zip(FMINCON_ORDER, map(float, x), strict=True))
        return criterion(replace(robot, values=dict(robot.values) | named))

    with ThreadPoolExecutor() as pool:
        found = scipy.optimize.minimize(
            value,
            FMINCON_START,
            method="SLSQP",
            bounds=list(zip(FMINCON_LOW, FMINCON_HIGH, strict=True)),
            options={"ftol": _CHANGE, "maxiter": iterations, "workers": pool.map},
        )
    return FminconFit(
        values=dict(zip(FMINCON_ORDER, map(float, found.x), strict=True)),
        criterion=float(found.fun),
        criterion_at_start=value(np.array(FMINCON_START)),
        evaluations=int(found.nfev) + 1,
        message=str(found.message),
    )
