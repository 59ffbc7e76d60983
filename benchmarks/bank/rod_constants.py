"""Every number that the rod's compiled equations know, each of them zero where nothing acts."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["BRANCHES", "Constants"]

BRANCHES = 3
"""Maxwell branches of the viscoelastic strip, a decade apart: nearly a power law in time."""


class Constants(NamedTuple):
    """Numbers of one robot in one run, SI; a hinge stands for one listed increment of the strip.

    Base, one line each for foot, root, strip, top and rotor, ground, motor. What follows is one
    line for each effect.
    """

    foot_mass: float = 0.0
    foot_inertia: float = 0.0
    beam_root: float = 0.0
    root_angle: float = 0.0
    root_stiffness: float = 0.0
    root_damping: float = 0.0
    hinge_stiffness: float = 0.0
    hinge_damping: float = 0.0
    top_mass: float = 0.0
    top_inertia: float = 0.0
    rotor_mass: float = 0.0
    rotor_lever: float = 0.0  # of the centre of mass of arm and weight [m]
    rotor_inertia: float = 0.0  # about that centre
    gravity_x: float = 0.0
    gravity_z: float = 0.0
    ground_stiffness: float = 0.0  # of one corner
    ground_damping: float = 0.0
    friction_slide: float = 0.0
    friction_stick: float = 0.0
    motor_lag: float = 0.05  # [s]

    hinge_cubic: float = 0.0  # [N m/rad^3]
    hinge_coulomb: float = 0.0  # [N m]
    hinge_quadratic: float = 0.0  # [N m s^2/rad^2]
    root_play: float = 0.0  # [rad] either way
    air_drag: float = 0.0  # [N s^2/m^2] at T
    foot_cg: float = 0.0  # [m] forward
    speed_scale: float = 0.0
    speed_offset: float = 0.0  # [rad/s]
    speed_drift: float = 0.0  # [1/s]
    motor_droop: float = 0.0  # [rad/s per N m]
    ripple_cos_1: float = 0.0
    ripple_sin_1: float = 0.0
    ripple_cos_2: float = 0.0
    ripple_sin_2: float = 0.0
    hunt_crossley: float = 0.0  # [N s/m^2] at one corner
    anisotropy: float = 0.0
    adhesion: float = 0.0  # [N] at one corner
    tether_stiffness: float = 0.0  # [N/m] along the floor
    tether_pull: float = 0.0  # [N] forward
    tether_at_x: float = 0.0  # [m] T's place at rest, set when it is known

    maxwell: float = 0.0  # stiffness of each branch as a share of the hinge's
    maxwell_time: float = 0.1  # [s] of the middle branch
    hysteresis: float = 0.0  # [N m/rad] at the root
    hysteresis_yield: float = 1e-3  # [rad]
    loose_mass: float = 0.0  # [kg]
    loose_room: float = 0.0  # [m] radius of its cage
    warming: float = 0.0  # [1/s] share of the stiffness lost
    magnet: float = 0.0  # [N]
    magnet_at_x: float = 0.0  # [m]
    magnet_at_z: float = 0.0
    magnet_reach: float = 0.02  # [m]
    gear_error: float = 0.0  # [rad] of a wheel that turns `gear_turns` times a turn of the rotor
    gear_turns: float = 3.0
