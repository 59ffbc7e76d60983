"""The passive-force callback: the forces that MuJoCo has no field for, compiled.

The engine calls it from any of its threads. It is global to the process, and adds nothing to models
without the numeric fields of `ground` and `beam_laws`.
"""

from __future__ import annotations

import mujoco
import numba
import numpy as np
from numba import carray  # pyright: ignore[reportPrivateImportUsage]
from numba.core.ccallback import CFunc

from workbench.sim.beam_laws import LAWS_MAGIC, LAWS_PARAMETERS, play_torque, top_forces
from workbench.sim.compiling import INSTALLING, callback
from workbench.sim.ground import (
    GROUND_MAGIC,
    GROUND_PARAMETERS,
    GROUND_RECORD,
    foot_forces,
    planar_forces,
)
from workbench.sim.struct_offsets import as_pointer, check_layout, data_offset, model_offset

__all__ = ["install_force_laws"]

# 8-byte words into mjModel and mjData
_NV, _NBODY = model_offset("nv") // 8, model_offset("nbody") // 8
_NUMERIC, _NUMERIC_SIZE = model_offset("numeric_data") // 8, model_offset("nnumericdata") // 8
_STIFFNESS, _SPRING = model_offset("jnt_stiffness") // 8, model_offset("qpos_spring") // 8
_QPOS, _QVEL = data_offset("qpos") // 8, data_offset("qvel") // 8
_PASSIVE, _USER = data_offset("qfrc_passive") // 8, data_offset("userdata") // 8
_XPOS, _CENTRES = data_offset("xpos") // 8, data_offset("subtree_com") // 8
_AXES, _SPEEDS = data_offset("cdof") // 8, data_offset("cvel") // 8
_OF_MODEL = (_NV, _NBODY, _NUMERIC, _NUMERIC_SIZE, _STIFFNESS, _SPRING)
_OF_DATA = (_QPOS, _QVEL, _PASSIVE, _USER, _XPOS, _CENTRES, _AXES, _SPEEDS)
_MODEL_SPAN, _DATA_SPAN = 1 + max(_OF_MODEL), 1 + max(_OF_DATA)
_OFFSETS = (*_OF_MODEL, *_OF_DATA)


@numba.njit
def _add_ground_forces(p, d):
    """Add the forces of the foot's corners; `p` are the ground's numbers, `d` is mjData."""
    q = carray(as_pointer(d[_QPOS]), 7, dtype=np.float64)
    v = carray(as_pointer(d[_QVEL]), 6, dtype=np.float64)
    out = carray(as_pointer(d[_PASSIVE]), 6, dtype=np.float64)
    user = carray(as_pointer(d[_USER]), GROUND_RECORD, dtype=np.float64)
    if p[12]:
        planar_forces(p, q, v, user, out)
    else:
        foot_forces(p, q, v, user, out)


@numba.njit
def _add_beam_forces(p, m, d):
    """Add the forces on beam and T; `p` are the laws' numbers, `m` and `d` mjModel and mjData."""
    nv, nbody = m[_NV], m[_NBODY]
    out = carray(as_pointer(d[_PASSIVE]), nv, dtype=np.float64)
    if p[5] > 0.0:
        play_torque(
            p,
            carray(as_pointer(d[_QPOS]), nv + 1, dtype=np.float64),
            carray(as_pointer(m[_STIFFNESS]), nv, dtype=np.float64),
            carray(as_pointer(m[_SPRING]), nv + 1, dtype=np.float64),
            out,
        )
    top_forces(
        p,
        carray(as_pointer(d[_XPOS]), (nbody, 3), dtype=np.float64),
        carray(as_pointer(d[_CENTRES]), (nbody, 3), dtype=np.float64),
        carray(as_pointer(d[_AXES]), (nv, 6), dtype=np.float64),
        carray(as_pointer(d[_SPEEDS]), (nbody, 6), dtype=np.float64),
        out,
    )


def _passive(model, data):  # typed by the signature in install_force_laws
    m = carray(model, _MODEL_SPAN, dtype=np.int64)
    size = m[_NUMERIC_SIZE]
    if size < LAWS_PARAMETERS:
        return
    d = carray(data, _DATA_SPAN, dtype=np.int64)
    p = carray(as_pointer(m[_NUMERIC]), size, dtype=np.float64)
    used = 0
    if size >= GROUND_PARAMETERS and p[0] == GROUND_MAGIC:
        _add_ground_forces(p, d)
        used = GROUND_PARAMETERS
    if size >= used + LAWS_PARAMETERS and p[used] == LAWS_MAGIC:
        _add_beam_forces(p[used:], m, d)


def _no_time():
    return 0.0


def install_force_laws() -> None:
    """Compile and install the callback for the whole process; calling it again does no harm.

    The engine's timers are switched off: reading the clock ten times a step was a seventh of the
    step of so small a model.

    Raises:
        RuntimeError: when this MuJoCo build has another layout of its structs.
    """
    with INSTALLING:
        if _kept:
            return
        check_layout()
        passive = callback(_passive, "void(voidptr, voidptr)", _OFFSETS)
        no_time = callback(_no_time, "float64()")
        mujoco.set_mjcb_passive(passive.ctypes)
        mujoco.set_mjcb_time(no_time.ctypes)
        _kept.extend((passive, no_time))


_kept: list[CFunc] = []
"""Machine code that MuJoCo calls; it must not be collected."""
