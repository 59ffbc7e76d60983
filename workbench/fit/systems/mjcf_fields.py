"""The numbers of a mechanism that may be fitted, and how an MjSpec has them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from workbench.fit.parameters import Acts

__all__ = ["FIELDS", "Field", "Owner"]

Owner = Literal["body", "joint", "actuator", "gravity", "input", "channel"]
Read = Callable[[mujoco.MjSpec, str], float]
Write = Callable[[mujoco.MjSpec, str, float], None]

_LEAST_SHARE = -0.99
_DEFAULT_SOLREF = (0.02, 1.0)
_GEAR = " gear"  # after a joint's name: the joint that a gear adds
_GEAR_DAMPING = 0.05  # of critical, by the armature; metal gives back most of what bends it
_SHOWN = 0.5  # rad of the fastest motion in a step: coarse ones, twice as long, still follow
_DELAY_REACH = 5.0  # what is seen late is so to first order: what it moves in that time


@dataclass(frozen=True)
class Field:
    """A kind of number that may be fitted.

    Args:
        owner: kind of element that has it.
        unit: SI, with `F` for N m or N, `L` for rad or m, `I` for kg m^2 or kg, and `control`.
        read: its nominal value of a named element.
        write: sets it; None where it acts on the drive or on what is seen.
        acts: where it acts.
        low: least value allowed.
        reach: prior deviations around the nominal value within which it acts as it should.
        adds: whether it adds a joint; that is there then, at its least value at the least.
    """

    owner: Owner
    unit: str
    read: Read
    write: Write | None = None
    acts: Acts = Acts.MODEL
    low: float = -np.inf
    reach: float = np.inf
    adds: bool = False


def _nothing(spec: mujoco.MjSpec, owner: str) -> float:
    return 0.0


def _whole(spec: mujoco.MjSpec, owner: str) -> float:
    return 1.0


def _read_mass(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.body(owner).mass)


def _write_mass(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    body = spec.body(owner)
    body.inertia = body.inertia * (value / body.mass)
    body.mass = value


def _write_inertia(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    body = spec.body(owner)
    body.inertia = body.inertia * value


def _read_distance(spec: mujoco.MjSpec, owner: str) -> float:
    return float(np.linalg.norm(spec.body(owner).pos))


def _write_distance(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    body = spec.body(owner)
    body.pos = body.pos * (value / float(np.linalg.norm(body.pos)))


def _read_friction(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.joint(owner).frictionloss)


def _read_armature(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.joint(owner).armature)


def _write_armature(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    spec.joint(owner).armature = value


def _angle(spec: mujoco.MjSpec, owner: str) -> float:
    """Return the SI value of the unit in which a spec keeps a joint's angles or places."""
    hinge = spec.joint(owner).type == mujoco.mjtJoint.mjJNT_HINGE
    return np.pi / 180 if hinge and spec.compiler.degree else 1.0


def _read_springref(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.joint(owner).springref) * _angle(spec, owner)


def _write_springref(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    spec.joint(owner).springref = value / _angle(spec, owner)


def _joint_term(name: str, power: int) -> tuple[Read, Write]:
    """Return access to a coefficient of MuJoCo's polynomials.

    A spring resists with k x + k2 x^2 + k3 x^3, a damper with d v + d2 v |v| + d3 v^3.
    """

    def read(spec: mujoco.MjSpec, owner: str) -> float:
        return float(getattr(spec.joint(owner), name)[power - 1])

    def write(spec: mujoco.MjSpec, owner: str, value: float) -> None:
        getattr(spec.joint(owner), name)[power - 1] = value

    return read, write


def _write_friction(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    """Set dry friction; where the model had none, as sharp as its step allows.

    With MuJoCo's default of 20 ms a slow joint creeps as if in oil. Settings that the file states
    stay, and so do those of a joint that has friction already.
    """
    joint = spec.joint(owner)
    if joint.frictionloss == 0 and tuple(joint.solref_friction) == _DEFAULT_SOLREF:
        joint.solref_friction = [2 * spec.option.timestep, 1.0]
    joint.frictionloss = value


def _read_compliance(spec: mujoco.MjSpec, owner: str) -> float:
    gear = spec.joint(f"{owner}{_GEAR}")
    return 0.0 if gear is None else float(1 / gear.stiffness[0])


def _write_compliance(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    """Set how much a gear gives between a joint, that of its motor, and what the joint moves.

    A second joint about the same axis bends by it; the armature stays with the first, and with it
    actuators, friction and sensors. It gives at least as much as shows in a step.
    """
    joint, gear = spec.joint(owner), spec.joint(f"{owner}{_GEAR}")
    inertia = float(joint.armature)
    if gear is None:
        gear = joint.parent.add_joint(
            name=f"{owner}{_GEAR}", type=joint.type, axis=joint.axis, pos=joint.pos
        )
        value = max(value, (spec.option.timestep / _SHOWN) ** 2 / inertia)
    gear.stiffness[0] = 1 / value
    gear.damping[0] = 2 * _GEAR_DAMPING * np.sqrt(inertia / value)


def _read_gain(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.actuator(owner).gainprm[0])


def _write_gain(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    """Set an actuator's gain, and the feedback of a position servo, which is its opposite."""
    actuator = spec.actuator(owner)
    servo = actuator.biastype == mujoco.mjtBias.mjBIAS_AFFINE
    if servo and actuator.biasprm[1] == -actuator.gainprm[0]:
        actuator.biasprm[1] = -value
    actuator.gainprm[0] = value


def _read_bias(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.actuator(owner).biasprm[0])


def _write_bias(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    actuator = spec.actuator(owner)
    if actuator.biastype == mujoco.mjtBias.mjBIAS_NONE:
        actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    actuator.biasprm[0] = value


def _read_gear(spec: mujoco.MjSpec, owner: str) -> float:
    return float(spec.actuator(owner).gear[0])


def _write_gear(spec: mujoco.MjSpec, owner: str, value: float) -> None:
    spec.actuator(owner).gear[0] = value


def _tilt(axis: int) -> Write:
    def write(spec: mujoco.MjSpec, owner: str, value: float) -> None:
        one, other = (axis + 1) % 3, (axis + 2) % 3
        gravity = spec.option.gravity.copy()
        cos, sin = np.cos(value), np.sin(value)
        turned = gravity.copy()
        turned[one] = cos * gravity[one] - sin * gravity[other]
        turned[other] = sin * gravity[one] + cos * gravity[other]
        spec.option.gravity = turned

    return write


def _drive(unit: str, low: float = -np.inf) -> Field:
    return Field("input", unit, _nothing, None, Acts.DRIVE, low)


def _sensor(unit: str, low: float = -np.inf) -> Field:
    return Field("channel", unit, _nothing, None, Acts.OBSERVATION, low)


FIELDS: dict[str, Field] = {
    "mass": Field("body", "kg", _read_mass, _write_mass, low=0.0),
    "inertia": Field("body", "1", _whole, _write_inertia, low=0.0),
    "distance": Field("body", "m", _read_distance, _write_distance, low=0.0),
    "stiffness": Field("joint", "F/L", *_joint_term("stiffness", 1), low=0.0),
    "even_stiffness": Field("joint", "F/L^2", *_joint_term("stiffness", 2)),
    "cubic_stiffness": Field("joint", "F/L^3", *_joint_term("stiffness", 3)),
    "springref": Field("joint", "L", _read_springref, _write_springref),
    "damping": Field("joint", "F s/L", *_joint_term("damping", 1), low=0.0),
    "quadratic_damping": Field("joint", "F s^2/L^2", *_joint_term("damping", 2), low=0.0),
    "cubic_damping": Field("joint", "F s^3/L^3", *_joint_term("damping", 3), low=0.0),
    "frictionloss": Field("joint", "F", _read_friction, _write_friction, low=0.0),
    "compliance": Field("joint", "L/F", _read_compliance, _write_compliance, low=0.0, adds=True),
    "armature": Field("joint", "I", _read_armature, _write_armature, low=0.0),
    "gain": Field("actuator", "F/control", _read_gain, _write_gain),
    "bias": Field("actuator", "F", _read_bias, _write_bias),
    "gear": Field("actuator", "1", _read_gear, _write_gear),
    "tilt_x": Field("gravity", "rad", _nothing, _tilt(0)),
    "tilt_y": Field("gravity", "rad", _nothing, _tilt(1)),
    "input_scale": _drive("1", _LEAST_SHARE),
    "input_offset": _drive("control"),
    "input_delay": _drive("s"),
    "input_lag": _drive("s", 0.0),
    "scale": _sensor("1", _LEAST_SHARE),
    "offset": _sensor("L"),
    "delay": Field("channel", "s", _nothing, None, Acts.OBSERVATION, reach=_DELAY_REACH),
}
"""What may be fitted. A mass carries its inertia with it; `inertia` is a factor on top of that.
Scales are shares beyond 1. An input's delay and lag act on the control, before the actuator."""
