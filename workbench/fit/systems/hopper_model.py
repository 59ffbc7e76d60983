"""What the hopping robot as a system is built from: parameters that are freed, cheaper models."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean
from workbench.fit.parameters import LIMITS, Parameter
from workbench.schemas import UNITS, ModelFile
from workbench.sim import CORNER_FIELDS, CORNERS, SAMPLE_RATE_HZ, highest_mode

__all__ = [
    "FINER",
    "anchors",
    "coarsen",
    "free_parameters",
    "jacobian",
    "parameters_within_tolerance",
]

Array = NDArray[np.float64]

FINER = 32
"""Increments of the beam that is tried where runs may show that the model's own are too few."""

_COARSE_STEPS, _COARSE_ARMATURE, _COARSE_MARGIN = 6, 1e-5, 0.6
_GROUND_STEPS, _GROUND_ARMATURE = 17, 1e-6  # a softer stick grips and slips at other instants
_STEEP = 3.0  # a parameter stays within a third and three times its nominal value
_STEEP_WITHIN = 100.0  # one that has its tolerance as a prior is held by that
_UNCERTAIN_BEAM = (
    "hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping", "top_mass", "beam_mass",
    "rotor_mass", "rotor_radius",
)  # fmt: skip
_UNCERTAIN_FLOOR = (
    "foot_mass",
    "ground_stiffness",
    "ground_damping",
    "friction_slide",
    "friction_stick",
)
_ON_FLOOR = {"hop", "drop"}


def free_parameters(model: ModelFile, names: Sequence[str]) -> tuple[Parameter, ...]:
    """Return nominal parameters of a model file, freed from their tolerance.

    Raises:
        InputError: for one that is unknown, not positive or known exactly.
    """
    found = []
    for name in names:
        if name not in UNITS:
            hint = did_you_mean(name, UNITS)
            raise InputError(f"parameter {name!r} is unknown{hint}; there are {', '.join(UNITS)}")
        stated = getattr(model.parameters, name)
        if stated.value <= 0 or stated.tolerance == 0:
            raise InputError(
                f"parameter {name} is {stated.value:g} with tolerance {stated.tolerance:g} in "
                f"model {model.name!r}; to be fitted it needs a positive value and a tolerance"
            )
        found.append(
            Parameter(name, UNITS[name], stated.value, stated.tolerance, stated.value / _STEEP,
                      stated.value * _STEEP, positive=True, flat=True)
        )  # fmt: skip
    return tuple(found)


def parameters_within_tolerance(model: ModelFile, modes: Collection[str]) -> tuple[Parameter, ...]:
    """Return the numbers of the robot that runs of some modes feel, held by their tolerances."""
    names = _UNCERTAIN_BEAM + (_UNCERTAIN_FLOOR if set(modes) & _ON_FLOOR else ())
    stated = {name: getattr(model.parameters, name) for name in names}
    uncertain = [name for name, one in stated.items() if one.tolerance > 0 and one.value > 0]
    return tuple(
        replace(
            one,
            flat=False,
            deviation=one.deviation / LIMITS,
            low=one.nominal / _STEEP_WITHIN,
            high=one.nominal * _STEEP_WITHIN,
        )
        for one in free_parameters(model, uncertain)
    )


def jacobian(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> Array:
    """Return the derivative of a body's place by the degrees of freedom, (3, nv) [m/m, m/rad]."""
    found = np.empty((3, model.nv))
    mujoco.mj_jac(model, data, found, None, data.xpos[body], body)
    return found


def anchors(model: mujoco.MjModel) -> tuple[int, ...]:
    """Return where the corners' anchors are in userdata: they move with the foot's correction."""
    if not model.nuserdata:
        return ()
    width, place = len(CORNER_FIELDS), CORNER_FIELDS.index("anchor_m")
    return tuple(width * corner + place for corner in range(CORNERS))


def coarsen(model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> int:
    """Make a model cheap for derivatives and return its steps a sample.

    A little armature on the hinges slows the highest modes, so that longer steps are stable; what
    holds a sticking corner grows softer with the step.

    Args:
        model: changed.
        data: of it, used up.
        steps: of the model a sample.
    """
    hinges = model.jnt_stiffness.reshape(model.njnt, -1)[:, 0] > 0
    ground = bool(model.nuserdata)
    armature = _GROUND_ARMATURE if ground else _COARSE_ARMATURE
    least = _GROUND_STEPS if ground else _COARSE_STEPS
    model.dof_armature[model.jnt_dofadr[hinges]] += armature
    mujoco.mj_resetData(model, data)
    mujoco.mj_setConst(model, data)
    mujoco.mj_forward(model, data)
    longest = _COARSE_MARGIN * highest_mode(model, data).longest_step
    coarse = min(max(least, int(np.ceil(1 / (SAMPLE_RATE_HZ * longest)))), steps)
    share = steps / coarse
    model.opt.timestep *= share
    if ground:
        law = model.numeric("ground").data
        law[10] /= share**2
        law[11] /= share
        law[16] *= share
    return coarse
