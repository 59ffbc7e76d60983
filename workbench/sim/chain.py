"""Planar chains: models that compiled code steps as the engine does, in a tenth of its time.

The robot in its hopping plane is one: a foot that is fixed or free, hinges about +y in a row, their
springs, dampers and dry friction, the rotor with its servo, and the force laws of `ground`,
`beam_laws` and `droop_ripple`. `read_chain` takes every number from the compiled MjModel, so that
effects and edits of the MjSpec are in it, and returns None for a model with anything else: the
engine steps that. `chain_step` has the equations; both agree to rounding
(`tests/sim/test_sim_chain.py`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.sim.beam_laws import LAWS_MAGIC, LAWS_PARAMETERS
from workbench.sim.ground import GROUND_MAGIC, GROUND_PARAMETERS

__all__ = ["AHEAD", "ActuatorColumn", "LinkColumn", "PlanarChain", "read_chain"]

Array = NDArray[np.float64]

AHEAD = "centrifugal_ahead"
"""Numeric field of a model: `PlanarChain.ahead` in steps. Files of others have none."""

_JOINT, _DYN, _BIT = mujoco.mjtJoint, mujoco.mjtDyn, mujoco.mjtDisableBit
_FREE, _SLIDE, _HINGE = map(int, (_JOINT.mjJNT_FREE, _JOINT.mjJNT_SLIDE, _JOINT.mjJNT_HINGE))
_PASSIVE, _INTEGRATOR, _USER = map(int, (_DYN.mjDYN_NONE, _DYN.mjDYN_INTEGRATOR, _DYN.mjDYN_USER))
_CONTACT, _CONSTRAINT = int(_BIT.mjDSBL_CONTACT), int(_BIT.mjDSBL_CONSTRAINT)
_ENERGY = int(mujoco.mjtEnableBit.mjENBL_ENERGY)
_FIXED, _RIPPLE = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_USER)
_UNBIASED, _AFFINE = int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE)
_ON_JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
_RIPPLES = 5
_IMPEDANCES = (mujoco.mjMINIMP, mujoco.mjMAXIMP)
_ROUNDING = 1e-9  # [kg m^2] greatest product of inertia out of the plane that counts as rounding


class LinkColumn(IntEnum):
    """Columns of `PlanarChain.links`, all in the frame of the link, whose origin is its hinge.

    Mass, centre of mass, inertia about the hinge; where the hinge is in the link before, and by
    what angle this link is turned against that one at qpos zero. Of the hinge: its spring, torque
    -x (k0 + k1 x + k2 x^2) from a rest angle, its damper, -v (d0 + d1 |v| + d2 v^2), its armature,
    and its dry friction: -GRIP (a + CREEP v) by acceleration and speed, at most FRICTION.
    """

    MASS, X, Z, INERTIA, AT_X, AT_Z, TURN, K0, K1, K2, REST, D0, D1, D2, ARMATURE = range(15)
    FRICTION, GRIP, CREEP = range(15, 18)


class ActuatorColumn(IntEnum):
    """Columns of `PlanarChain.actuators`: torque = gain u + offset + k angle + d speed.

    u is the control, or where `ADDRESS` is not negative the activation there, which grows by the
    control, or where `MODULATED` is 1 by the rate of `droop_ripple`, whose numbers begin at
    `DROOP`; where `RIPPLED` is 1 its ripple is the gain.
    """

    LINK, GAIN, OFFSET, STIFFNESS, DAMPING, ADDRESS, MODULATED, RIPPLED, DROOP = range(9)


@dataclass(frozen=True, eq=False)
class PlanarChain:
    """The numbers of a planar chain.

    Args:
        links: (n + 1, 18) as in `LinkColumn` [SI]; the first is the foot, or the world.
        actuators: (nu, 13) as in `ActuatorColumn` [SI].
        ground: (18,) numeric field of `ground`, zeros where no ground is [SI].
        laws: (10,) numeric field of `beam_laws`, zeros where there is none [SI].
        bodies: (nbody, 4) of each body its link, its position there, forward and up [m], and its
            angle against the link [rad].
        top: (4,) the same of T [m, rad]; for `beam_laws`.
        gravity: forward and up [m/s^2].
        step: [s].
        ahead: by how much speeds are ahead of the last step's where centrifugal forces are taken
            [s]; zero as the engine has it.
        root: degrees of freedom of the root: 0 fixed, 3 planar joints, 6 a free joint.
    """

    links: Array
    actuators: Array
    ground: Array
    laws: Array
    bodies: Array
    top: Array
    gravity: tuple[float, float]
    step: float
    ahead: float
    root: int

    @property
    def dofs(self) -> NDArray[np.int_]:
        """Return the engine's degree of freedom of each coordinate, (n + 3,); -1 of a fixed root.

        Coordinates are forward, up and pitch of the root, and the angles of the hinges.
        """
        root = {6: [0, 2, 4], 3: [0, 1, 2], 0: [-1, -1, -1]}[self.root]
        return np.array([*root, *range(self.root, self.root + len(self.links) - 1)])

    def stiffer(self, share: float) -> PlanarChain:
        """Return the chain with all springs of its hinges stiffer by a share."""
        if not share:
            return self
        links = self.links.copy()
        links[:, LinkColumn.K0 : LinkColumn.K2 + 1] *= 1 + share
        return replace(self, links=links)


def read_chain(model: mujoco.MjModel) -> PlanarChain | None:
    """Return a model's planar chain, None where it has anything that a chain has not."""
    root = _root(model)
    if root is None or not (_is_plain(model) and _is_serial(model, root) and _is_flat(model, root)):
        return None
    actuators = _actuators(model, root)
    if actuators is None:
        return None
    ground, laws = _fields(model)
    links, bodies = _links(model, root)
    top = bodies[int(laws[4])]
    forward, _, up = model.opt.gravity
    step = model.opt.timestep
    field = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, AHEAD)
    ahead = step * model.numeric(field).data[0] if field >= 0 else 0.0
    gravity = forward, up
    return PlanarChain(links, actuators, ground, laws, bodies, top, gravity, step, ahead, root)


def _root(model: mujoco.MjModel) -> int | None:
    """Return the degrees of freedom of the root, None for other joints."""
    types = model.jnt_type
    if model.njnt and types[0] == _FREE:
        return 6
    if model.njnt < 3 or types[0] != _SLIDE:
        return 0
    axes = np.array([[1, 0, 0], [0, 0, 1], [0, 1, 0]])
    planar = list(types[:3]) == [_SLIDE, _SLIDE, _HINGE] and (model.jnt_axis[:3] == axes).all()
    alone = not model.jnt_pos[:3].any() and not model.qpos0[:3].any() and model.body_jntnum[1] == 3
    return 3 if planar and alone and not model.body_pos[1].any() else None


def _is_plain(model: mujoco.MjModel) -> bool:
    """Return whether the engine steps it by `implicitfast`, with no constraint but dry friction."""
    opt, other = model.opt, model.neq + model.ntendon + model.nflex + model.nplugin + model.nmocap
    off = opt.disableflags
    touching = model.geom_contype.any() and model.geom_conaffinity.any() and not off & _CONTACT
    free = off & _CONSTRAINT or not (model.jnt_limited.any() or touching)
    return bool(
        opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        and not (opt.density or opt.viscosity or opt.wind.any() or other)
        and not off & ~(_CONTACT | _CONSTRAINT)
        and not opt.enableflags & ~_ENERGY
        and not (opt.noslip_iterations or model.body_gravcomp.any())
        and free
    )


def _is_serial(model: mujoco.MjModel, root: int) -> bool:
    """Return whether the bodies behind the root are in series, each with at most one y hinge."""
    first = 3 if root == 3 else int(root == 6)
    hinged = model.body_jntnum[2 if root else 1 :]
    dofs = slice(root, None)
    of_dofs = (model.dof_damping, model.dof_armature, model.dof_frictionloss)
    return bool(
        (model.body_parentid[1:] == np.arange(model.nbody - 1)).all()
        and (hinged <= 1).all()
        and (model.jnt_type[first:] == _HINGE).all()
        and (model.jnt_axis[first:] == [0, 1, 0]).all()
        and not model.jnt_pos[first:].any()
        and not model.jnt_actfrclimited.any()
        and not model.jnt_actgravcomp.any()
        and not any(each[:root].any() for each in of_dofs)
        and (model.dof_solref > 0).all()
        and not model.jnt_stiffness[:first].any()
        and len(model.dof_damping[dofs]) == model.njnt - first
    )


def _is_flat(model: mujoco.MjModel, root: int) -> bool:
    """Return whether gravity, frames and inertias keep it in the plane."""
    turned = model.body_quat[2 if root else 1 :, [1, 3]]
    if model.opt.gravity[1] or turned.any():
        return False
    if root != 6:
        return True
    across = np.abs(_inertias(model)[1:, [0, 2]]).max()
    return not (model.body_ipos[:, 1].any() or model.body_pos[2:, 1].any() or across >= _ROUNDING)


def _inertias(model: mujoco.MjModel) -> Array:
    """Return the row about +y of each body's inertia about its centre, (nbody, 3) [kg m^2]."""
    w, x, y, z = model.body_iquat.T
    along = np.array([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)])
    across = np.array([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)])
    above = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    weighted = across.T * model.body_inertia
    return np.stack([(weighted * axis.T).sum(axis=1) for axis in (along, across, above)], axis=1)


def _fields(model: mujoco.MjModel) -> tuple[Array, Array]:
    """Return the numbers of `ground` and `beam_laws` as the callback finds them."""
    data = model.numeric_data
    ground, laws, used = np.zeros(GROUND_PARAMETERS), np.zeros(LAWS_PARAMETERS), 0
    if len(data) >= GROUND_PARAMETERS and data[0] == GROUND_MAGIC:
        ground, used = data[:GROUND_PARAMETERS].copy(), GROUND_PARAMETERS
    if len(data) >= used + LAWS_PARAMETERS and data[used] == LAWS_MAGIC:
        laws = data[used : used + LAWS_PARAMETERS].copy()
    return ground, laws


def _actuators(model: mujoco.MjModel, root: int) -> Array | None:
    """Return the actuators, None where one is of another kind."""
    rows = np.zeros((model.nu, len(ActuatorColumn) + _RIPPLES - 1))
    limited = (model.actuator_ctrllimited, model.actuator_forcelimited, model.actuator_actlimited)
    inner = (model.actuator_damping, model.actuator_armature, model.actuator_actearly)
    late = model.actuator_delay
    if any(each.any() for each in (*limited, *inner, late)) or (model.actuator_ctrlnum != 1).any():
        return None
    for k, row in enumerate(rows):
        dynamics, gain = int(model.actuator_dyntype[k]), int(model.actuator_gaintype[k])
        bias, joint = int(model.actuator_biastype[k]), int(model.actuator_trnid[k, 0])
        known = (
            dynamics in (_PASSIVE, _INTEGRATOR, _USER)
            and gain in (_FIXED, _RIPPLE)
            and bias in (_UNBIASED, _AFFINE)
            and model.actuator_trntype[k] == _ON_JOINT
            and model.actuator_gear[k, 0] == 1
        )
        dof = int(model.jnt_dofadr[joint]) if known else -1
        if dof < root:
            return None
        modulated, rippled = dynamics == _USER, gain == _RIPPLE
        row[: ActuatorColumn.DROOP] = [
            dof - root + 1, model.actuator_gainprm[k, 0],
            *(model.actuator_biasprm[k, :3] * (bias == _AFFINE)),
            -1 if dynamics == _PASSIVE else model.actuator_actadr[k], modulated, rippled,
        ]  # fmt: skip
        numbers = model.actuator_dynprm if modulated else model.actuator_gainprm
        row[ActuatorColumn.DROOP :] = numbers[k, :_RIPPLES] if modulated or rippled else 0.0
    return rows


def _links(model: mujoco.MjModel, root: int) -> tuple[Array, Array]:
    """Return the links, and of each body its link, position and angle there.

    Bodies without a hinge are part of the link before them.
    """
    first, hinged = 2 if root else 1, model.body_jntnum.tolist()
    quats, positions, centres = (
        each.tolist() for each in (model.body_quat, model.body_pos, model.body_ipos)
    )
    masses, inertias = model.body_mass.tolist(), _inertias(model)[:, 1].tolist()
    links, bodies = [[0.0] * len(LinkColumn)], [[0.0] * 4 for _ in hinged]
    turns = [0.0]
    x = z = turned = 0.0
    for body in range(1, model.nbody):
        if body >= first:
            dx, dz = _turned(positions[body][0], positions[body][2], turned)
            x, z = x + dx, z + dz
            turned += 2 * math.atan2(quats[body][2], quats[body][0])
            if hinged[body]:
                links.append([0.0] * len(LinkColumn))
                links[-1][LinkColumn.AT_X], links[-1][LinkColumn.AT_Z] = x, z
                turns.append(turned)
                x = z = turned = 0.0
            bodies[body] = [len(links) - 1, x, z, turned]
        dx, dz = _turned(centres[body][0], centres[body][2], turned)
        link, mass, along, above = links[-1], masses[body], x + dx, z + dz
        link[LinkColumn.MASS] += mass
        link[LinkColumn.X] += mass * along
        link[LinkColumn.Z] += mass * above
        link[LinkColumn.INERTIA] += inertias[body] + mass * (along * along + above * above)
    found = np.array(links)
    massive = found[:, LinkColumn.MASS] > 0
    found[massive, LinkColumn.X : LinkColumn.Z + 1] /= found[massive, LinkColumn.MASS, None]
    joints = slice(3 if root == 3 else int(root == 6), None)
    own, dofs = found[1:], slice(root, None)
    own[:, LinkColumn.TURN] = np.array(turns[1:]) - model.qpos0[model.jnt_qposadr[joints]]
    own[:, LinkColumn.K0] = model.jnt_stiffness[joints]
    own[:, LinkColumn.K1 : LinkColumn.K2 + 1] = model.jnt_stiffnesspoly[joints]
    own[:, LinkColumn.REST] = model.qpos_spring[model.jnt_qposadr[joints]]
    own[:, LinkColumn.D0] = model.dof_damping[dofs]
    own[:, LinkColumn.D1 : LinkColumn.D2 + 1] = model.dof_dampingpoly[dofs]
    own[:, LinkColumn.ARMATURE] = model.dof_armature[dofs]
    own[:, LinkColumn.FRICTION : LinkColumn.CREEP + 1] = _frictions(model)[dofs]
    return found, np.array(bodies)


def _frictions(model: mujoco.MjModel) -> Array:
    """Return friction, grip and creep of each degree of freedom, (nv, 3), as `LinkColumn` has them.

    The engine's friction loss is a soft constraint (its documentation, "Solver parameters"): with
    impedance d and time constant t, a force -d / (1 - d) / w (a + 2 v / (d t)), w the inverse
    inertia at qpos zero, within the bounds of the loss.
    """
    rows = np.zeros((model.nv, 3))
    if model.opt.disableflags & _CONSTRAINT or not model.dof_frictionloss.any():
        return rows
    rubs = model.dof_frictionloss > 0
    impedance = np.clip(model.dof_solimp[rubs, :2], *_IMPEDANCES).T
    settling = np.maximum(model.dof_solref[rubs, 0], 2 * model.opt.timestep)
    rows[rubs, 0] = model.dof_frictionloss[rubs]
    rows[rubs, 1] = impedance[0] / (1 - impedance[0]) / model.dof_invweight0[rubs]
    rows[rubs, 2] = 2 / (impedance[1] * settling)
    return rows


def _turned(x: float, z: float, angle: float) -> tuple[float, float]:
    """Return a position (forward, up) turned about +y."""
    c, s = math.cos(angle), math.sin(angle)
    return c * x + s * z, c * z - s * x
