"""Samples of the engine's arrays during a simulation, and the motion made of them."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from workbench.motion import CORNER_FORCES, FOOT, PITCH, ROTOR, ROTOR_ANGLE, ROTOR_SPEED, TOP
from workbench.motion import rotor_angle as angle_of
from workbench.motion import rotor_speed as speed_of
from workbench.sim.ground import CORNER_FIELDS, LOOSE, UNLOCKED, corner_records
from workbench.sim.robot import SAMPLE_RATE_HZ, Robot, hinge_name
from workbench.timeseries import TimeSeries

__all__ = ["ENERGY", "SampleRecorder", "Samples", "motion_of"]

ENERGY = int(mujoco.mjtEnableBit.mjENBL_ENERGY)
"""Flag of a model whose energies are computed; they cost a few percent."""


@dataclass(frozen=True)
class Samples:
    """The engine's arrays of one simulation at its samples.

    Args:
        qpos: (n, nq) [m, rad].
        foot: (n, 3) xpos of the foot [m].
        axes: (n, 9) xmat of the foot [1].
        top: (n, 3) xpos of T [m].
        rotor: (n, 3) site_xpos of the rotor [m].
        corners: (n, nuserdata) of `corner_records` [units of `CORNER_FIELDS`].
        energy: (n, 2) potential and kinetic [J].
        power: (n,) of the motor [W].
    """

    qpos: NDArray[np.float64]
    foot: NDArray[np.float64]
    axes: NDArray[np.float64]
    top: NDArray[np.float64]
    rotor: NDArray[np.float64]
    corners: NDArray[np.float64]
    energy: NDArray[np.float64]
    power: NDArray[np.float64]


class SampleRecorder:
    """Records samples of every simulation of a batch.

    Args:
        batch: its bound arrays are read at each `take`.
        torque: (s, nu) of the actuators, read likewise [N m].
        count: how many samples there will be.
    """

    def __init__(self, batch: Batch, torque: NDArray[np.float64], count: int) -> None:
        model = batch.model
        positions, joint = batch.bind("xpos"), model.joint("rotor").dofadr[0]
        foot, top = model.body("foot").id, model.body("top").id
        self._sources: dict[str, NDArray[np.float64]] = {
            "qpos": batch.bind("qpos"),
            "foot": positions[:, foot],
            "axes": batch.bind("xmat")[:, foot],
            "top": positions[:, top],
            "rotor": batch.bind("site_xpos")[:, model.site("rotor").id],
            "corners": batch.bind("userdata"),
            "energy": batch.bind("energy"),
        }
        self._torque, self._speed = torque, batch.bind("qvel")[:, joint]
        self._kept: dict[str, NDArray[np.float64]] = {
            name: np.empty((batch.nsim, count, source.shape[1]))
            for name, source in self._sources.items()
        }
        self._kept["power"] = np.empty((batch.nsim, count))

    def take(self, k: int) -> None:
        """Record the present state as sample k."""
        for name, source in self._sources.items():
            self._kept[name][:, k] = source
        self._kept["power"][:, k] = self._torque.sum(axis=1) * self._speed

    def samples(self, row: int) -> Samples:
        """Return the samples of one simulation."""
        return Samples(**{name: kept[row] for name, kept in self._kept.items()})


def motion_of(
    robot: Robot,
    model: mujoco.MjModel,
    samples: Samples,
    rest: float = 0.0,
    origin: NDArray[np.float64] | None = None,
) -> TimeSeries:
    """Return the motion, positions against the foot's.

    Args:
        robot: simulated.
        model: of it.
        samples: of its simulation.
        rest: time before zero for which the first sample is repeated [s].
        origin: (3,) of the foot at rest; None where the first sample is at rest [m].
    """
    still = round(rest * SAMPLE_RATE_HZ)
    index = np.concatenate([np.zeros(still, dtype=int), np.arange(len(samples.top))])
    times = (np.arange(len(index)) - still) / SAMPLE_RATE_HZ
    base = samples.foot[0] if origin is None else origin
    columns: dict[str, NDArray[np.float64]] = {}
    for names, path in ((FOOT, samples.foot), (TOP, samples.top), (ROTOR, samples.rotor)):
        columns |= dict(zip(names, (path - base)[index].T, strict=True))
    columns[PITCH] = np.arctan2(-samples.axes[index, 6], samples.axes[index, 0])
    columns[ROTOR_ANGLE] = angle_of(samples.top, samples.rotor)[index]
    columns[ROTOR_SPEED] = speed_of(times, columns[ROTOR_ANGLE])
    columns |= _hinges(robot, model, samples.qpos[index])
    if model.nuserdata:
        columns |= _ground(corner_records(samples.corners[index]))
    columns["motor_power_W"] = samples.power[index]
    if model.opt.enableflags & ENERGY:
        columns["potential_energy_J"] = samples.energy[index, 0]
        columns["kinetic_energy_J"] = samples.energy[index, 1]
    return TimeSeries.of(times, columns)


def _hinges(
    robot: Robot, model: mujoco.MjModel, qpos: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    columns: dict[str, NDArray[np.float64]] = {}
    for k, hinge in enumerate(robot.hinges):
        angle = np.full(len(qpos), hinge.angle)
        if hinge.stiffness is not None:
            angle = qpos[:, model.joint(hinge_name(k)).qposadr[0]]
        columns[f"{hinge_name(k)}_rad"] = angle
    return columns


def _ground(corners: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Return each corner's force, their sums, how many touch and how many of these slide."""
    fields = {axis: CORNER_FIELDS.index(f"force_{axis}_N") for axis in "xyz"}
    each = {
        name: corners[:, k, field]
        for k, names in enumerate(CORNER_FORCES)
        for name, field in zip(names, fields.values(), strict=True)
    }
    forces = each | {
        f"ground_{axis}_N": corners[:, :, field].sum(axis=1) for axis, field in fields.items()
    }
    touching = corners[:, :, CORNER_FIELDS.index("force_z_N")] > 0
    sliding = touching & np.isin(corners[:, :, 0], (UNLOCKED, LOOSE))
    return forces | {
        "corners_touching": touching.sum(axis=1).astype(float),
        "corners_sliding": sliding.sum(axis=1).astype(float),
    }
