"""Vibration of the clamped robot: its linear modes, and its response to the rotor's speed.

These are two different things. A linear mode is a small motion about the equilibrium under gravity;
the driven robot bends far, and can respond to one speed in two ways.

Linear modes solve K phi = w^2 M phi with M and K = -dF/dq of the equilibrium, the rotor locked to
T. The damping ratio is phi' D phi / (2 w) with phi' M phi = 1 and D the hinges' damping.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import mujoco
import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.motion import TOP
from workbench.sim.command import sample_times, staircase
from workbench.sim.condition import Condition
from workbench.sim.effects.apply import applied
from workbench.sim.equilibrium import settle, unloaded
from workbench.sim.robot import SAMPLE_RATE_HZ, Robot, chain_of
from workbench.sim.simulate import simulate
from workbench.sim.statics import Statics, moving_dofs
from workbench.timeseries import TimeSeries

__all__ = [
    "Direction",
    "DrivenPeak",
    "DrivenResponse",
    "NaturalMode",
    "driven_peaks",
    "driven_response",
    "linear_modes",
    "mass_matrix",
]

Array = NDArray[np.float64]

Direction = Literal["up", "down"]
Axis = Literal["x", "z"]

_POINT_M = 1e-5  # a rotor of this radius is a point: its moment of inertia and its lever vanish
_DOWN = np.pi / 2


class NaturalMode(NamedTuple):
    """A natural mode of small motions.

    Args:
        hz: natural frequency.
        damping_ratio: of the critical damping.
        top_direction: (x, z) unit vector of T's motion, its greater component positive.
    """

    hz: float
    damping_ratio: float
    top_direction: tuple[float, float]


@dataclass(frozen=True)
class DrivenResponse:
    """Motion of T while the rotor's speed went through a staircase.

    Args:
        direction: whether the speeds rose or fell.
        speed: (n,) of the rotor against T [rad/s], in the order in which they were run.
        x: (n,) amplitude of T forward, half of peak to peak [m]; NaN where T fell.
        z: (n,) the same upward [m].
        change: (n,) of the greater amplitude over that of the window before, less one [1]; far from
            zero where the time held was too short or the motion is not periodic.
    """

    direction: Direction
    speed: Array
    x: Array
    z: Array
    change: Array


class DrivenPeak(NamedTuple):
    """A speed at which the driven amplitude is greater than at both neighbours.

    Args:
        direction: of the sweep.
        axis: of T's motion.
        speed_rad_s: of the rotor.
        amplitude_m: of T; NaN where it fell.
    """

    direction: Direction
    axis: Axis
    speed_rad_s: float
    amplitude_m: float


def linear_modes(
    robot: Robot, *, rotor_angle: float | None = None, count: int = 3
) -> list[NaturalMode]:
    """Return the slowest modes of the clamped robot about its equilibrium under gravity.

    Args:
        robot: of any state; its rest angles are found as for a simulation.
        rotor_angle: where the rotor is locked, from T in the world about +y from +x [rad]; None
            takes the whole rotor as a point mass at T.
        count: how many modes.

    Raises:
        InputError: when the robot does not stand.
    """
    robot = unloaded(applied(robot))
    if rotor_angle is None:
        robot = replace(robot, values=dict(robot.values) | {"rotor_radius": _POINT_M})
    model, data = settle(robot, "fixed", _DOWN if rotor_angle is None else rotor_angle)
    dofs = moving_dofs(model, "fixed")
    stiffness = Statics(model, data, dofs, "top", chain_of(robot, "fixed")).balance().stiffness
    mujoco.mj_forward(model, data)
    squares, shapes = scipy.linalg.eigh(
        (stiffness + stiffness.T) / 2, mass_matrix(model, data)[np.ix_(dofs, dofs)]
    )
    top = _top_jacobian(model, data)[:, dofs]
    damping = model.dof_damping[dofs]
    return [
        _mode(float(square), shape, damping, top)
        for square, shape in zip(squares[:count], shapes.T[:count], strict=True)
    ]


def driven_response(
    robot: Robot,
    speeds: Sequence[float],
    *,
    hold: float = 20.0,
    turns: int = 5,
    directions: Sequence[Direction] = ("up", "down"),
) -> list[DrivenResponse]:
    """Drive the clamped robot through the speeds, one continuing simulation for each direction.

    So a hysteresis of the response shows. Where T falls the motion ends, and the next speed starts
    from rest.

    Args:
        robot: of any state.
        speeds: of the rotor against T, positive, in any order [rad/s].
        hold: time at each speed [s].
        turns: of the rotor at the end of that time over which the amplitude is taken.
        directions: in which to go through them.

    Raises:
        InputError: when the time held is shorter than twice the turns, or the robot cannot stand.
    """
    rising = np.sort(np.asarray(speeds, dtype=float))
    if not (len(rising) and rising[0] > 0):
        raise InputError(f"{rising.tolist()}: a sweep needs speeds, all of them positive")
    if hold < 2 * _window(rising[0], turns):
        raise InputError(
            f"{hold:g} s at each speed are too short for twice {turns} turns at {rising[0]:g} "
            f"rad/s; hold for {2 * _window(rising[0], turns):.3g} s or more, or start faster"
        )
    orders = [rising if direction == "up" else rising[::-1] for direction in directions]
    with ThreadPoolExecutor(len(orders)) as pool:
        responses = pool.map(lambda order: _sweep(robot, order, hold, turns), orders)
    return [
        DrivenResponse(direction, order.copy(), *columns)
        for direction, order, columns in zip(directions, orders, responses, strict=True)
    ]


def driven_peaks(responses: Sequence[DrivenResponse]) -> list[DrivenPeak]:
    """Return where the driven amplitude peaks; these are not the linear modes."""
    peaks = []
    for response in responses:
        along: dict[Axis, Array] = {"x": response.x, "z": response.z}
        for axis, amplitude in along.items():
            for k in scipy.signal.find_peaks(np.nan_to_num(amplitude, nan=np.inf))[0]:
                peak = float(response.speed[k]), float(amplitude[k])
                peaks.append(DrivenPeak(response.direction, axis, *peak))
    return peaks


def mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the mass of all degrees of freedom, (nv, nv) [kg, kg m^2]."""
    full = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return full


def _top_jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the derivative of T's (x, z) by the degrees of freedom, (2, nv)."""
    jacobian = np.empty((3, model.nv))
    top = model.body("top").id
    mujoco.mj_jac(model, data, jacobian, None, data.xpos[top], top)
    return jacobian[[0, 2]]


def _mode(square: float, shape: Array, damping: Array, top: Array) -> NaturalMode:
    omega = float(np.sqrt(square))
    direction = top @ shape
    direction *= np.sign(direction[np.abs(direction).argmax()]) / np.linalg.norm(direction)
    ratio = float(shape @ (damping * shape)) / (2 * omega)
    return NaturalMode(omega / (2 * np.pi), ratio, (float(direction[0]), float(direction[1])))


def _sweep(robot: Robot, speeds: Array, hold: float, turns: int) -> Array:
    """Return amplitudes along x and z and their change at each speed, (3, n)."""
    rows: list[tuple[float, float, float]] = []
    while len(rows) < len(speeds):
        remaining = speeds[len(rows) :]
        motion = simulate(robot, _staircase_of(remaining, hold)).motion
        held = int((motion.times[-1] + 1.5 / SAMPLE_RATE_HZ) / hold)
        for k, speed in enumerate(remaining[:held]):
            rows.append(_amplitudes(motion, hold * (k + 1), _window(speed, turns)))
        if held < len(remaining):
            rows.append((np.nan, np.nan, np.nan))
    return np.array(rows).T


def _staircase_of(speeds: Array, hold: float) -> Condition:
    times = sample_times(hold * len(speeds))
    begins = hold * np.arange(len(speeds))
    return Condition("clamped", staircase(times, list(zip(begins, speeds, strict=True))))


def _amplitudes(motion: TimeSeries, end: float, window: float) -> tuple[float, float, float]:
    """Return T's amplitudes along x and z over a window that ends there, and their change."""
    before, last = (
        [np.ptp(motion.between(begin, begin + window)[TOP[axis]]) / 2 for axis in (0, 2)]
        for begin in (end - 2 * window, end - window)
    )
    return float(last[0]), float(last[1]), float(max(last) / max(before) - 1)


def _window(speed: float, turns: int) -> float:
    return 2 * np.pi * turns / speed
