"""A hop that goes on from a moment while its foot stands, as it might be found in a track.

A hop forgets how it began; what its model gets wrong still shows in any short part of it. While
both ends of the foot stick to the ground, a state needs few numbers: where the foot stands, the
beam's lowest modes and the rotor's angle (`docs/decisions/0011-diagnosis.md`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.motion import ROTOR_ANGLE
from workbench.sim.condition import Condition
from workbench.sim.drive import hold_rotor
from workbench.sim.effects.apply import applied, driven
from workbench.sim.equilibrium import hinge_ids, world_angle
from workbench.sim.ground import CORNER_FIELDS, corner_records
from workbench.sim.modes import mass_matrix
from workbench.sim.motion import motion_of
from workbench.sim.robot import SAMPLE_RATE_HZ, Robot
from workbench.sim.simulate import at_rest, stepped
from workbench.timeseries import TimeSeries

__all__ = ["STANCE", "Standing"]

_MODES = 3
STANCE = ("foot x", "foot z", "foot pitch", *(f"bend {k}" for k in range(_MODES)),
          *(f"rate {k}" for k in range(_MODES)), "rotor")  # fmt: skip
"""What a stance is told by [m, m, rad, rad, rad/s, rad]: all beside rest, the rotor's in the world.
A bend of a mode is the most that it turns any increment by."""
_ROTOR = STANCE.index("rotor")
_TURN = 2 * np.pi
_BENDS, _RATES = slice(3, 3 + _MODES), slice(3 + _MODES, 3 + 2 * _MODES)


@dataclass(frozen=True, eq=False)
class Standing:
    """A planar robot at rest on its free foot, from which stances are made.

    Args:
        robot: with its effects applied.
        condition: what its motor makes of what it is commanded.
        model: of it.
        data: at rest.
        modes: (m, nv) of the beam, each turning it by 1 rad at most.
    """

    robot: Robot
    condition: Condition
    model: mujoco.MjModel
    data: mujoco.MjData
    modes: NDArray[np.float64]

    @classmethod
    def of(cls, robot: Robot, condition: Condition) -> Standing:
        """Return a robot at rest.

        Args:
            robot: planar, with effects.
            condition: of mode hop, with the command of the whole run.

        Raises:
            InputError: when it cannot be built, does not stand or is refused by `checks`.
        """
        changed, made = applied(robot), driven(condition, robot)
        model, data = at_rest(changed, made)
        return cls(changed, made, model, data, _beam_modes(changed, model, data))

    def go_on(
        self, begins: Sequence[int], stances: NDArray[np.float64], count: int
    ) -> list[TimeSeries]:
        """Return how it goes on from stances, one motion each, times those of the run.

        Args:
            begins: (w,) samples of the command that they stand at.
            stances: (w, len(STANCE)).
            count: samples of each motion, the stance included. What diverges keeps its last sample.
        """
        command = np.array([self.condition.command[at : at + count] for at in begins])
        rows = zip(stances, command, strict=True)
        starts = [(self.model, self._stood(stance, part[0])) for stance, part in rows]
        recorder, sane = stepped(starts, command, self.robot.steps_per_sample)
        found = []
        for row, begin in enumerate(begins):
            motion = motion_of(
                self.robot, self.model, recorder.samples(row), origin=self.data.body("foot").xpos
            )
            kept = np.minimum(np.arange(count), max(int(sane[row]), 1) - 1)
            times = (begin + np.arange(count)) / SAMPLE_RATE_HZ
            values, valid = motion.values[kept], motion.valid[kept]
            angle = values[:, motion.names.index(ROTOR_ANGLE)]
            angle += _TURN * np.round((stances[row, _ROTOR] - angle[0]) / _TURN)
            found.append(TimeSeries(times, values, motion.names, valid))
        return found

    def _stood(self, stance: NDArray[np.float64], speed: float) -> mujoco.MjData:
        model = self.model
        data = mujoco.MjData(model)
        data.qpos[:], data.act[:] = self.data.qpos, self.data.act
        data.userdata[:] = self.data.userdata
        data.qpos[:3] += stance[:3]
        anchors = corner_records(data.userdata)
        anchors[:, CORNER_FIELDS.index("anchor_m")] += stance[0]
        data.qpos[:] += stance[_BENDS] @ self.modes
        data.qvel[:] = stance[_RATES] @ self.modes
        rotor = data.joint("rotor")
        mujoco.mj_kinematics(model, data)
        rotor.qpos += stance[_ROTOR] - world_angle(data)
        rotor.qvel = speed
        hold_rotor(model, data)
        mujoco.mj_forward(model, data)
        return data


def _beam_modes(robot: Robot, model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Return the lowest modes of the beam on its foot, (m, nv), T turned the positive way.

    Gravity is left out: they only span what may be otherwise.
    """
    ids = hinge_ids(model, robot)
    at = model.jnt_dofadr[ids]
    stiffness = np.diag([float(np.ravel(model.jnt_stiffness[i])[0]) for i in ids])
    shapes = scipy.linalg.eigh(stiffness, mass_matrix(model, data)[np.ix_(at, at)])[1][:, :_MODES].T
    turned = np.cumsum(shapes, axis=1)
    modes = np.zeros((_MODES, model.nv))
    modes[:, at] = shapes / (np.sign(turned[:, -1]) * np.abs(turned).max(axis=1))[:, None]
    return modes
