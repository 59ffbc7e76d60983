"""The virtual laboratory: a motor, a robot and cameras in place of the real ones.

It follows the voltage at the simulated supply's terminals, never what the driver believes, and
leaves a genuine export on disk, which is then read like any other. The twin knows nothing of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, TOP
from workbench.schemas import CameraSettings, Mode, ModelFile, ShapeFile, VirtualSection
from workbench.sim import (
    SAMPLE_RATE_HZ,
    Condition,
    Robot,
    make_robot,
    sample_times,
    simulate,
    staircase,
)
from workbench.timeseries import TimeSeries
from workbench.tracking import Axes, BodyTake, Cloud, SampleStatus, Take

_PER_SAMPLE = 16  # the motor's lag is followed in steps of half a millisecond

_HAND_S = (0.2, 1.2)  # a person lets go so long after being asked
_LEAST_S = 0.5  # a motion shorter than this has no rotor speed
_DARK = slice(30, 32)  # frames at rest in which somebody hides all cameras

__all__ = ["film", "held", "let_go", "move", "true_robot"]

_START_M = np.array([-0.4, 0.15, 0.02])
"""Position of the robot in the cameras' volume, along the bench axes [m]."""


def true_robot(model: ModelFile, shape: ShapeFile, section: VirtualSection) -> Robot:
    """Return the robot of the virtual bench."""
    values = model.values() | section.parameters
    effects = model.quantities() | section.effects
    return make_robot(values, shape, section.increments, effects)


def held(mode: Mode, angle: float, pull: float | None, height: float | None) -> Condition:
    """Return how a robot is held before somebody lets go.

    Args:
        mode: of the run.
        angle: of the rotor [rad].
        pull: force on T [N].
        height: of the foot above the floor [m].
    """
    return Condition(mode, np.zeros(0), angle, pull=pull or 0.0, height=height or 0.0)


def move(
    robot: Robot,
    mode: Mode,
    history: Sequence[tuple[float, float]],
    duration: float,
    section: VirtualSection,
) -> TimeSeries:
    """Return what the robot did while the supply went through a history of voltages.

    Args:
        robot: the true one.
        mode: foot on the ground or fixed.
        history: (time [s], voltage at the terminals [V]), zero where the cameras start.
        duration: how long the cameras run [s].
        section: motor line, lag and start angle.
    """
    times = sample_times(duration)
    fine = np.arange(len(times) * _PER_SAMPLE) / (_PER_SAMPLE * SAMPLE_RATE_HZ)
    volts = staircase(fine, history)
    wanted = np.maximum(section.motor_slope * volts + section.motor_offset, 0.0)
    keep = np.exp(-1 / (_PER_SAMPLE * SAMPLE_RATE_HZ * section.motor_lag))
    lagging = accumulate(wanted.tolist(), lambda now, to: keep * now + (1 - keep) * to, initial=0.0)
    speed = np.array(list(lagging)[1:])
    # the motor turns from sample to sample by the mean of its speed between them
    mean = speed.reshape(len(times), _PER_SAMPLE).mean(axis=1)
    motion = simulate(robot, Condition(mode, mean, section.start_angle)).motion
    return _lying_still(motion, len(times))


def let_go(
    robot: Robot, held: Condition, asked: float, duration: float, rng: np.random.Generator
) -> TimeSeries:
    """Return what the robot did that a person held, and let go a moment after being asked.

    Args:
        robot: the true one.
        held: mode, pull or height, and start angle; its command is not used.
        asked: when the person was asked, zero where the cameras start [s].
        duration: how long the cameras run [s].
        rng: gives the moment, anywhere between two pictures of the cameras.
    """
    times = sample_times(duration)
    released = asked + rng.uniform(*_HAND_S)
    remaining_s = max(duration - released, _LEAST_S)  # they may let go too late
    locked = np.zeros(len(sample_times(remaining_s)) + 1)
    motion = simulate(robot, replace(held, command=locked)).motion
    motion = _lying_still(motion, len(locked))
    since = np.maximum(times - released, 0.0)
    values = scipy.interpolate.CubicSpline(motion.times, motion.values)(since)
    return TimeSeries(times, values, motion.names, np.isfinite(values))


def film(
    motion: TimeSeries, cameras: CameraSettings, section: VirtualSection, rng: np.random.Generator
) -> Take:
    """Return what the cameras see: noisy markers, with gaps, in the export's axes."""
    axes = Axes(up=cameras.axes.up, forward=cameras.axes.forward)
    tip = motion[PITCH] + sum(motion[n] for n in motion.names if n.startswith("hinge_"))
    poses = {
        cameras.bodies.foot: (FOOT, motion[PITCH]),
        cameras.bodies.top: (TOP, tip),
        cameras.bodies.rotor: (ROTOR, motion[ROTOR_ANGLE]),
    }
    bodies: dict[str, BodyTake] = {}
    for i, (name, (point, angle)) in enumerate(poses.items(), start=1):
        positions = np.array(cameras.markers.get(name, ((0, 20, 0), (0, -20, 0)))) / 1000
        origin = motion.select(point).values + _START_M
        bodies[name] = _seen(name, i, origin, angle, positions, axes, section, rng)
    rate = cameras.axes.rate or 120.0
    count = len(motion)
    return Take(
        path="",
        sha256="",
        format="row" if section.export.startswith("row") else "motive",
        version=section.export.rpartition("-")[2],
        rate_hz=rate,
        jitter_s=0.0,
        indices=np.arange(count),
        times=np.arange(count) / rate,
        bodies=bodies,
        cloud=Cloud.empty(count),
    )


def _lying_still(motion: TimeSeries, count: int) -> TimeSeries:
    """Repeat the last sample up to `count`: a robot that fell stays on the floor."""
    missing = count - len(motion)
    if missing <= 0:
        return motion
    times = motion.times[-1] + np.arange(1, missing + 1) / SAMPLE_RATE_HZ
    return TimeSeries(
        np.concatenate([motion.times, times]),
        np.concatenate([motion.values, np.repeat(motion.values[-1:], missing, axis=0)]),
        motion.names,
        np.concatenate([motion.valid, np.repeat(motion.valid[-1:], missing, axis=0)]),
    )


def _seen(
    name: str,
    number: int,
    origin: NDArray[np.float64],
    angle: NDArray[np.float64],
    positions: NDArray[np.float64],
    axes: Axes,
    section: VirtualSection,
    rng: np.random.Generator,
) -> BodyTake:
    """Return one body's markers: true places, plus noise, minus what the cameras lose."""
    true = origin[:, None, :] + _turned(positions, angle)
    noise = rng.normal(0.0, section.noise, true.shape)
    measured = true + noise
    # the tracker fits the rigid body: its solved markers share the markers' mean error
    shared = noise.mean(axis=1, keepdims=True)
    solved = true + shared
    hidden = _gaps(len(true), len(positions), section, rng)
    measured[hidden] = np.nan
    lost = hidden.sum(axis=1) > len(positions) - 2
    last = np.maximum.accumulate(np.where(lost, 0, np.arange(len(true))))
    quaternion = np.zeros((len(true), 4))
    quaternion[:, 0], quaternion[:, 2] = np.cos(angle / 2), np.sin(angle / 2)
    return BodyTake(
        name=name,
        id=str(number),
        position=_blank(axes.points_to_export(origin + shared[:, 0]), lost),
        quaternion=_blank(axes.quaternions_to_export(quaternion), lost),
        measured=axes.points_to_export(measured),
        solved=axes.points_to_export(solved[last]),  # stays where it was while the body is lost
        marker_names=tuple(f"{name}_{k}" for k in range(1, len(positions) + 1)),
        missing=np.where(lost, SampleStatus.LOST, SampleStatus.SEEN).astype(np.int8),
    )


def _turned(positions: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return marker places (m, 3) turned about +y by each angle (n,): (n, m, 3)."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = positions.T
    return np.stack([c * x + s * z, np.broadcast_to(y, (len(angle), len(y))), c * z - s * x], -1)


def _gaps(
    count: int, markers: int, section: VirtualSection, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Return which marker samples are hidden, (n, m): half of the gaps hide a whole body.

    Where there are gaps at all, two frames show nothing of any body, as real takes have them.
    """
    hidden = np.zeros((count, markers), dtype=bool)
    mean = max(1.0, section.gap_length * 120)
    for _ in range(rng.poisson(section.gap_share * count / mean)):
        start, length = rng.integers(count), rng.geometric(1 / mean)
        which = slice(None) if rng.random() < 0.5 else rng.integers(markers)
        hidden[start : start + length, which] = True
    hidden[0] = False
    hidden[_DARK] = section.gap_share > 0
    return hidden


def _blank(values: NDArray[np.float64], lost: NDArray[np.bool_]) -> NDArray[np.float64]:
    return np.where(lost[:, None], np.nan, values)
