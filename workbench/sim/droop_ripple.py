"""Droop of the rotor's speed under load and its ripple with the angle, compiled.

The servo of `drive` follows an angle that grows by the command u. Here that angle grows by

    u (1 + c1 cos p + s1 sin p + c2 cos 2p + s2 sin 2p) - droop * torque

with p the rotor's angle in the world and the torque that of the servo itself: a dashpot of slope
`droop` in series with the servo's spring and damper. With all numbers at zero it is that servo; the
state is the same angle, only its rate differs. While the command is zero the motor is off and its
gearbox holds the rotor.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numba
import numpy as np
from numba import carray  # pyright: ignore[reportPrivateImportUsage]
from numba.core.ccallback import CFunc
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.sim.compiling import INSTALLING, callback
from workbench.sim.drive import SERVO_DAMPING, SERVO_STIFFNESS
from workbench.sim.struct_offsets import as_pointer, check_layout, data_offset, model_offset

__all__ = ["add_droop", "add_ripple", "ripple", "servo_rate"]

_PARAMETERS = 10  # of an actuator's dynprm and gainprm
_FIRST = 1  # index of the ripple in dynprm, after the droop, and in gainprm, after the gain
_RIPPLES = 4
# 8-byte words into mjModel and mjData
_DYNPRM, _GAINPRM = (model_offset(f"actuator_{name}") // 8 for name in ("dynprm", "gainprm"))
_ACTADR, _TARGET = (model_offset(f"actuator_{name}") // 8 for name in ("actadr", "trnid"))
_JOINT_BODY = model_offset("jnt_bodyid") // 8
_CTRL, _ACT, _XMAT = (data_offset(name) // 8 for name in ("ctrl", "act", "xmat"))
_LENGTH, _VELOCITY = (data_offset(f"actuator_{name}") // 8 for name in ("length", "velocity"))
_OF_MODEL = (_DYNPRM, _GAINPRM, _ACTADR, _TARGET, _JOINT_BODY)
_OF_DATA = (_CTRL, _ACT, _XMAT, _LENGTH, _VELOCITY)
_MODEL_SPAN, _DATA_SPAN = 1 + max(_OF_MODEL), 1 + max(_OF_DATA)
_OFFSETS = (*_OF_MODEL, *_OF_DATA)


def add_droop(spec: mujoco.MjSpec, slope: float) -> None:
    """Make the rotor's servo turn slower under load.

    Args:
        spec: with the drive `speed`; changed in place, as MjSpec's own methods do.
        slope: lost speed over torque [rad/s per N m].

    Raises:
        InputError: when another drive turns the rotor.
    """
    _modulate_servo(spec, "motor_droop")
    spec.actuator("rotor_angle").dynprm[0] += slope
    _weaken_servo(spec)


def add_ripple(spec: mujoco.MjSpec, shares: Sequence[float]) -> None:
    """Make the speed of the rotor's servo depend on the rotor's angle in the world.

    Args:
        spec: with the drive `speed`; changed in place, as MjSpec's own methods do.
        shares: of the speed, times cos p, sin p, cos 2p and sin 2p.

    Raises:
        InputError: when another drive turns the rotor.
    """
    _modulate_servo(spec, "speed_ripple")
    span = slice(_FIRST, _FIRST + _RIPPLES)
    spec.actuator("rotor_angle").dynprm[span] += shares
    spec.actuator("rotor_ripple").gainprm[span] += shares


def _modulate_servo(spec: mujoco.MjSpec, effect: str) -> None:
    """Compute the servo's rate by the compiled code, and add the damper's part of the ripple.

    That part is a separate actuator: a user gain would take the damper itself out of the implicit
    integration.
    """
    angle = spec.actuator("rotor_angle")
    if angle is None:
        raise InputError(
            f"effect {effect} changes how the drive 'speed' turns the rotor, and another drive is "
            "used; leave the effect out or drive by speed"
        )
    if spec.actuator("rotor_ripple") is not None:
        return
    _install()
    angle.dyntype, angle.dynprm = mujoco.mjtDyn.mjDYN_USER, np.zeros(_PARAMETERS)
    spec.add_actuator(
        name="rotor_ripple",
        target="rotor",
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        gaintype=mujoco.mjtGain.mjGAIN_USER,
        gainprm=[SERVO_DAMPING] + [0] * 9,
    )


def _weaken_servo(spec: mujoco.MjSpec) -> None:
    """Weaken spring and damper by the dashpot in series with them."""
    angle, speed = spec.actuator("rotor_angle"), spec.actuator("rotor_speed")
    given = 1 + angle.dynprm[0] * SERVO_DAMPING
    angle.gainprm[0], angle.biasprm[1] = SERVO_STIFFNESS / given, -SERVO_STIFFNESS / given
    speed.gainprm[0], speed.biasprm[2] = SERVO_DAMPING / given, -SERVO_DAMPING / given
    spec.actuator("rotor_ripple").gainprm[0] = SERVO_DAMPING / given


def _install() -> None:
    """Compile and install the callbacks for the whole process; other servos do not call them.

    Raises:
        RuntimeError: when this MuJoCo build lays its structs out otherwise.
    """
    with INSTALLING:
        if _kept:
            return
        check_layout()
        signature = "double(voidptr, voidptr, int32)"
        rate, gain = (callback(function, signature, _OFFSETS) for function in (_rate, _gain))
        mujoco.set_mjcb_act_dyn(rate.ctypes)
        mujoco.set_mjcb_act_gain(gain.ctypes)
        _kept.extend((rate, gain))


_kept: list[CFunc] = []
"""Machine code that MuJoCo calls; it must not be collected."""


@numba.njit
def ripple(shares: NDArray[np.float64], c: float, s: float) -> float:
    """Return the relative change of speed at an angle of the rotor [1].

    Args:
        shares: (4,) of the speed, times cos p, sin p, cos 2p and sin 2p [1].
        c: cosine of the rotor's angle in the world.
        s: its sine.
    """
    return shares[0] * c + shares[1] * s + shares[2] * (c * c - s * s) + shares[3] * 2 * c * s


@numba.njit
def servo_rate(
    p: NDArray[np.float64], command: float, error: float, speed: float, c: float, s: float
) -> float:
    """Return the rate of the angle that the servo follows [rad/s].

    Args:
        p: (5,) droop [rad/s per N m] and the ripple's shares [1].
        command: [rad/s].
        error: the angle followed less the rotor's [rad].
        speed: of the rotor against T [rad/s].
        c: cosine of the rotor's angle in the world.
        s: its sine.
    """
    if command == 0.0:
        return 0.0
    wanted = command * (1 + ripple(p[_FIRST:], c, s))
    # the torque is K error + D (rate - speed); rate = wanted - droop * torque
    spring = SERVO_STIFFNESS * error - SERVO_DAMPING * speed
    return (wanted - p[0] * spring) / (1 + p[0] * SERVO_DAMPING)


@numba.njit
def _direction(m: NDArray[np.int64], d: NDArray[np.int64], actuator: int) -> tuple[float, float]:
    """Return cosine and sine of the rotor's angle in the world, about +y from +x."""
    target = carray(as_pointer(m[_TARGET]), 2 * (actuator + 1), dtype=np.int32)
    joint = int(target[2 * actuator])
    body = int(carray(as_pointer(m[_JOINT_BODY]), joint + 1, dtype=np.int32)[joint])
    axes = carray(as_pointer(d[_XMAT]), 9 * (body + 1), dtype=np.float64)
    return axes[9 * body], -axes[9 * body + 6]


def _rate(model, data, actuator):  # typed by the signature in _install
    """Return the rate of the angle that the servo follows [rad/s]."""
    m = carray(model, _MODEL_SPAN, dtype=np.int64)
    d = carray(data, _DATA_SPAN, dtype=np.int64)
    command = carray(as_pointer(d[_CTRL]), actuator + 1, dtype=np.float64)[actuator]
    table = carray(as_pointer(m[_DYNPRM]), _PARAMETERS * (actuator + 1), dtype=np.float64)
    p = table[_PARAMETERS * actuator :]
    address = int(carray(as_pointer(m[_ACTADR]), actuator + 1, dtype=np.int32)[actuator])
    followed = carray(as_pointer(d[_ACT]), address + 1, dtype=np.float64)[address]
    angle = carray(as_pointer(d[_LENGTH]), actuator + 1, dtype=np.float64)[actuator]
    speed = carray(as_pointer(d[_VELOCITY]), actuator + 1, dtype=np.float64)[actuator]
    c, s = _direction(m, d, actuator)
    return servo_rate(p, float(command), followed - angle, float(speed), c, s)


def _gain(model, data, actuator):  # typed by the signature in _install
    """Return the ripple's part of the damper's torque per command [N m s/rad]."""
    m = carray(model, _MODEL_SPAN, dtype=np.int64)
    d = carray(data, _DATA_SPAN, dtype=np.int64)
    table = carray(as_pointer(m[_GAINPRM]), _PARAMETERS * (actuator + 1), dtype=np.float64)
    p = table[_PARAMETERS * actuator :]
    c, s = _direction(m, d, actuator)
    return p[0] * ripple(p[_FIRST:], c, s)
