"""How near a hop came to tipping over."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.motion import FOOT, PITCH, ROTOR, TOP
from workbench.shape import curve
from workbench.sim import Robot, applied
from workbench.timeseries import TimeSeries

__all__ = ["centre_of_mass", "tipping_margin"]


def tipping_margin(robot: Robot, motion: TimeSeries) -> float:
    """Return the least angle by which the robot could still have tipped [rad].

    At every moment with a corner on the ground: the angle between the vertical and the line from
    an edge of the foot, the front one or the rear one, to the robot's centre of mass; positive
    while the centre is between the edges, zero when it stands over one. What it takes to tip over
    from there at rest; the swing that it already has is not counted.

    Args:
        robot: that moved.
        motion: of a simulated hop.
    """
    robot = applied(robot)
    mass = centre_of_mass(robot, motion)
    x, z, pitch = motion[FOOT[0]], motion[FOOT[2]], motion[PITCH]
    half = robot.values["foot_length"] / 2
    margins = []
    for edge in (half, -half):
        edge_x, edge_z = x + edge * np.cos(pitch), z - edge * np.sin(pitch)
        inward = np.sign(edge) * (edge_x - mass[:, 0])
        margins.append(np.arctan2(inward, mass[:, 1] - edge_z))
    touching = motion["corners_touching"] > 0
    return float(np.min(margins, axis=0)[touching].min(initial=np.pi))


def centre_of_mass(robot: Robot, motion: TimeSeries) -> NDArray[np.float64]:
    """Return the path of the whole robot's centre of mass, (n, 2) as x, z [m].

    Args:
        robot: with its effects applied.
        motion: of a simulation, with the angles of all hinges.
    """
    values = robot.values
    foot, top, rotor = (
        np.column_stack([motion[names[0]], motion[names[2]]]) for names in (FOOT, TOP, ROTOR)
    )
    arm = (top + rotor) / 2
    masses = [values[n] for n in ("foot_mass", "beam_mass", "top_mass", "rotor_mass")]
    masses.append(values["rotor_arm_mass"])
    positions = [foot, _beam_centre(robot, motion, foot), top, rotor, arm]
    total = sum(mass * position for mass, position in zip(masses, positions, strict=True))
    return np.asarray(total, dtype=np.float64) / sum(masses)


def _beam_centre(
    robot: Robot, motion: TimeSeries, foot: NDArray[np.float64]
) -> NDArray[np.float64]:
    pitch = motion[PITCH]
    angles = np.stack([motion[f"hinge_{k}_rad"] for k in range(robot.increments)], axis=-1)
    angles[:, 0] += pitch
    points = curve(angles, robot.length)  # (n, N + 1, 2) from the root
    centre = (points[:, 1:] + points[:, :-1]).mean(axis=1) / 2
    root = robot.values["beam_root"] * np.column_stack([np.cos(pitch), -np.sin(pitch)])
    return foot + root + centre
