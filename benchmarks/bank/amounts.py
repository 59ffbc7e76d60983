"""How each effect is drawn: its direction, which runs show it, and how far it may go.

A direction is the amount whose size is about 1, within a factor of two, at the stated parameters
in the runs of S+D or in three hops; it starts the search for a case's own amount and sets clutter.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

__all__ = ["ABSORBED", "AMOUNTS", "OUTSIDE_AMOUNTS", "Amount", "direction", "scaled"]

Shown = Literal["clamped", "hop"]


class Amount(NamedTuple):
    """How one effect is drawn.

    Args:
        shown: the runs that its size is taken on.
        directions: quantity -> value at size 1, one mapping for each way that it may come.
        most: times these that are still physical.
        both_signs: whether the opposite is physical as well.
    """

    shown: Shown
    directions: tuple[dict[str, float], ...]
    most: float
    both_signs: bool = True


AMOUNTS: dict[str, Amount] = {
    "hinge_cubic_stiffness": Amount("clamped", ({"k3": 30.0},), 60),
    "root_play": Amount("clamped", ({"gap": 3e-4},), 60, False),
    "local_stiffness_loss": Amount(
        "clamped", ({"near_foot": 0.01}, {"middle": 0.03}, {"near_top": 0.04}), 12
    ),
    "rest_shape_drift": Amount(
        "clamped", ({"root": 0.02}, {"bend": 0.012}, {"root": 0.004, "bend": 0.008}), 20
    ),
    "hinge_coulomb_friction": Amount("clamped", ({"torque": 3e-4},), 50, False),
    "hinge_quadratic_damping": Amount("clamped", ({"c": 0.005},), 100, False),
    "air_drag": Amount("clamped", ({"c": 0.01},), 100, False),
    "foot_cg": Amount("hop", ({"forward": 0.008},), 4),
    "rotor_unbalance": Amount("clamped", ({"share": 0.2},), 4),
    "speed_drift": Amount("clamped", ({"rate": 1e-3},), 100),
    "motor_droop": Amount("clamped", ({"slope": 7.0},), 60, False),
    "speed_ripple": Amount(
        "clamped", ({"cos_1": 0.02}, {"sin_1": 0.02}, {"cos_2": 0.04}, {"sin_2": 0.04}), 30
    ),
    "ground_slope": Amount("clamped", ({"slope": 0.04},), 4),
    "ground_hunt_crossley": Amount("hop", ({"depth_damping": 1200.0},), 33, False),
    "friction_anisotropy": Amount("hop", ({"share": 0.3},), 1.4),
    "sole_adhesion": Amount("hop", ({"pull": 0.025},), 40, False),
    "tether": Amount("clamped", ({"stiffness": 0.5}, {"stiffness": 0.3, "pull": 0.03}), 100, False),
    "camera_tilt": Amount("clamped", ({"tilt": 0.03},), 6),
    "length_scale": Amount("clamped", ({"share": 0.015},), 6),
    "marker_offset": Amount("clamped", ({"forward": 0.005}, {"up": 0.005}), 15),
}
"""Effects that something of is left when the base parameters were refitted."""

ABSORBED = (
    "hinge_stiffness", "root_stiffness", "hinge_damping", "speed_scale", "speed_offset",
    "time_offset", "top_mass", "foot_mass", "ground_stiffness", "ground_damping", "friction_level",
)  # fmt: skip
"""Effects that the base refit takes up whole: it has the same parameters, or a speed and an instant
for each run. They have no size and cannot be single cases; traps use them."""

OUTSIDE_AMOUNTS: dict[str, Amount] = {
    "viscoelastic_strip": Amount("clamped", ({"share": 0.005, "time": 0.1},), 100, False),
    "root_hysteresis": Amount("clamped", ({"stiffness": 2.0, "yields": 2e-3},), 50, False),
    "loose_mass": Amount("clamped", ({"mass": 0.003, "room": 0.002},), 8, False),
    "dropped_frames": Amount("clamped", ({"share": 0.005},), 50, False),
    "warming_strip": Amount("clamped", ({"rate": 0.002},), 60, False),
    "rounded_sole": Amount("hop", ({"height": 5e-5},), 20, False),
    "magnet": Amount("clamped", ({"force": 0.01, "forward": 0.03, "up": 0.0},), 40, False),
    "eccentric_gear": Amount("clamped", ({"angle": 0.01},), 10, False),
}
_KEPT = ("time", "yields", "room", "forward", "up")
"""Quantities of causes outside the library that stay as they are when the cause grows."""


def direction(name: str, rng: np.random.Generator, *, first: bool = False) -> dict[str, float]:
    """Draw one way in which an effect comes, at about size 1; or take the first, of any sign."""
    amount = (AMOUNTS | OUTSIDE_AMOUNTS)[name]
    chosen = amount.directions[0 if first else rng.integers(len(amount.directions))]
    sign = float(rng.choice([-1.0, 1.0])) if amount.both_signs else 1.0
    drawn = {quantity: sign * value for quantity, value in chosen.items()}
    return drawn | {"seed": float(rng.integers(1000))} if name == "dropped_frames" else drawn


def scaled(name: str, values: dict[str, float], factor: float) -> dict[str, float]:
    """Return an effect grown by a factor."""
    kept = (*_KEPT, "seed") if name in OUTSIDE_AMOUNTS else ()
    return {key: value if key in kept else factor * value for key, value in values.items()}
