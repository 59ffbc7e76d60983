"""Every effect in the rod's own terms: what it changes of the robot, or of what is seen.

Names and quantities are those of the workbench's list of effects; nothing else is common. What the
list does not have, in `OUTSIDE`, must not be named by anybody.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.bank.courses import RATE_HZ, Course, Quantities
from benchmarks.bank.rod import Motion, Rod, swing

__all__ = ["EFFECTS", "OUTSIDE", "RodEffect", "perform"]

Values = Mapping[str, float]


class RodEffect(NamedTuple):
    """What an effect does; a quantity that is not given is zero."""

    act: Callable[[Rod, Values], Rod] | None = None
    see: Callable[[Motion, Values], Motion] | None = None


def perform(rod: Rod, effects: Quantities, course: Course) -> Motion:
    """Return what is seen of a robot with effects, of either list, by name."""
    known = EFFECTS | OUTSIDE
    for name, values in effects.items():
        act = known[name].act
        rod = act(rod, values) if act is not None else rod
    motion = swing(rod, course)
    for name, values in effects.items():
        see = known[name].see
        motion = see(motion, values) if see is not None else motion
    return motion


def _shared(*names: str) -> RodEffect:
    """Return an effect that enlarges values of the model by `share`."""

    def act(rod: Rod, values: Values) -> Rod:
        larger = {name: rod.values[name] * (1 + values.get("share", 0.0)) for name in names}
        return replace(rod, values=dict(rod.values) | larger)

    return RodEffect(act)


def _added(name: str, quantity: str) -> RodEffect:
    """Return an effect that adds a quantity to a value of the model."""

    def act(rod: Rod, values: Values) -> Rod:
        more = {name: rod.values[name] + values.get(quantity, 0.0)}
        return replace(rod, values=dict(rod.values) | more)

    return RodEffect(act)


def _law(**constants: str) -> RodEffect:
    """Return an effect that sets constants of the equations, constant=quantity."""

    def act(rod: Rod, values: Values) -> Rod:
        given = {constant: values.get(quantity, 0.0) for constant, quantity in constants.items()}
        return replace(rod, laws=dict(rod.laws) | given)

    return RodEffect(act)


def _profile(rod: Rod, values: Values) -> Rod:
    return replace(rod, profile=dict(rod.profile) | dict(values))


def _slope(rod: Rod, values: Values) -> Rod:
    return replace(rod, slope=rod.slope + values["slope"])


def _rocker(rod: Rod, values: Values) -> Rod:
    return replace(rod, rocker=values["height"])


def _unbalance(rod: Rod, values: Values) -> Rod:
    """Let the mass sit farther out; what cameras see of the rotor stays where it is."""
    return replace(rod, farther=rod.farther + values["share"])


def _tilted(motion: Motion, values: Values) -> Motion:
    c, s = np.cos(values["tilt"]), np.sin(values["tilt"])
    turn = np.array([[c, s], [-s, c]])
    return motion._replace(
        foot=motion.foot @ turn.T,
        top=motion.top @ turn.T,
        rotor=motion.rotor @ turn.T,
        pitch=motion.pitch + values["tilt"],
        rotor_angle=motion.rotor_angle + values["tilt"],
    )


def _late(motion: Motion, values: Values) -> Motion:
    return motion._replace(times=motion.times - values["late"])


def _scaled(motion: Motion, values: Values) -> Motion:
    size = 1 + values["share"]
    return motion._replace(
        foot=size * motion.foot, top=size * motion.top, rotor=size * motion.rotor
    )


def _off_top(motion: Motion, values: Values) -> Motion:
    """Let the point taken for T sit off it on its body."""
    turn = motion.pitch + motion.tip - (motion.pitch + motion.tip)[0]
    c, s = np.cos(turn), np.sin(turn)
    forward, up = values.get("forward", 0.0), values.get("up", 0.0)
    top = motion.top + np.column_stack([forward * c + up * s, up * c - forward * s])
    arm = motion.rotor - top
    return motion._replace(top=top, rotor_angle=np.unwrap(np.arctan2(-arm[:, 1], arm[:, 0])))


def _dropped(motion: Motion, values: Values) -> Motion:
    """Lose pictures that nobody counts: what follows is stamped too early.

    Each of as many pictures as make one loss on average loses one at random. More losses move all
    of them to earlier pictures, so that the size grows smoothly from the run's end on.
    """
    seed, share, count = round(values["seed"]), values["share"], len(motion.times)
    losses = int(share * count) + 1
    at = (np.arange(losses) + np.random.default_rng(seed).random(losses)) / max(share, 1e-12)
    lost = (1 + at[at < count - 1]).astype(int)
    kept = np.setdiff1d(np.arange(count), lost)
    fields = {name: value[kept] for name, value in motion._asdict().items() if name != "steps"}
    return motion._replace(**fields | {"times": motion.times[0] + np.arange(len(kept)) / RATE_HZ})


EFFECTS: dict[str, RodEffect] = {
    "hinge_stiffness": _shared("hinge_stiffness"),
    "root_stiffness": _shared("root_stiffness"),
    "hinge_cubic_stiffness": _law(hinge_cubic="k3"),
    "root_play": _law(root_play="gap"),
    "local_stiffness_loss": RodEffect(_profile),
    "rest_shape_drift": RodEffect(_profile),
    "hinge_damping": _shared("hinge_damping"),
    "hinge_coulomb_friction": _law(hinge_coulomb="torque"),
    "hinge_quadratic_damping": _law(hinge_quadratic="c"),
    "air_drag": _law(air_drag="c"),
    "top_mass": _added("top_mass", "mass"),
    "foot_mass": _added("foot_mass", "mass"),
    "foot_cg": _law(foot_cg="forward"),
    "rotor_unbalance": RodEffect(_unbalance),
    "speed_scale": _law(speed_scale="share"),
    "speed_offset": _law(speed_offset="offset"),
    "speed_drift": _law(speed_drift="rate"),
    "motor_droop": _law(motor_droop="slope"),
    "speed_ripple": _law(
        ripple_cos_1="cos_1", ripple_sin_1="sin_1", ripple_cos_2="cos_2", ripple_sin_2="sin_2"
    ),
    "ground_slope": RodEffect(_slope),
    "ground_stiffness": _shared("ground_stiffness"),
    "ground_damping": _shared("ground_damping"),
    "ground_hunt_crossley": _law(hunt_crossley="depth_damping"),
    "friction_level": _shared("friction_slide", "friction_stick"),
    "friction_anisotropy": _law(anisotropy="share"),
    "sole_adhesion": _law(adhesion="pull"),
    "tether": _law(tether_stiffness="stiffness", tether_pull="pull"),
    "camera_tilt": RodEffect(see=_tilted),
    "time_offset": RodEffect(see=_late),
    "length_scale": RodEffect(see=_scaled),
    "marker_offset": RodEffect(see=_off_top),
}
"""Canonical name -> what it does to a rod."""

OUTSIDE: dict[str, RodEffect] = {
    "viscoelastic_strip": _law(maxwell="share", maxwell_time="time"),
    "root_hysteresis": _law(hysteresis="stiffness", hysteresis_yield="yields"),
    "loose_mass": _law(loose_mass="mass", loose_room="room"),
    "dropped_frames": RodEffect(see=_dropped),
    "warming_strip": _law(warming="rate"),
    "rounded_sole": RodEffect(_rocker),
    "magnet": _law(magnet="force", magnet_at_x="forward", magnet_at_z="up"),
    "eccentric_gear": _law(gear_error="angle"),
}
"""Causes that the workbench does not know."""
