"""From parameters and a shape to an MjSpec: foot, beam of hinged increments, T and rotor.

Every part is a body as in the thesis, section 3.3: x forward, y left, z up, hinges about +y, the
foot's centre of gravity at the origin. A hinge's position is the angle alpha at that hinge.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Literal, get_args

import mujoco
import numpy as np

from workbench.errors import InputError, did_you_mean, require_named
from workbench.schemas import UNITS, ShapeFile
from workbench.sim.beam import Hinge, hinges
from workbench.sim.chain import AHEAD, PlanarChain, read_chain
from workbench.sim.drive import Drive, add_drive
from workbench.sim.ground import Stick, add_ground
from workbench.sim.passive_forces import install_force_laws

__all__ = [
    "SAMPLE_RATE_HZ",
    "Edit",
    "Foot",
    "Robot",
    "build_spec",
    "chain_of",
    "compile_model",
    "hinge_name",
    "make_robot",
]

Foot = Literal["free", "fixed"]

Edit = Callable[[mujoco.MjSpec, "Robot"], None]
"""Changes the MjSpec of a robot in place."""

SAMPLE_RATE_HZ = 120

_KEPT = 128  # models, some 100 kB each: those of a Jacobian are asked for run by run
_THIN = 1e-6  # the x entry of I_Leg and I_T, Appendix B


@dataclass(frozen=True)
class Robot:
    """Parameters of a simulated robot.

    Args:
        values: model values by name, SI.
        angles: alpha_0 to alpha_15 [rad].
        length: beam length [m].
        state: whether the angles are those of the free strip or of the standing robot.
        increments: how many the simulated beam has; the physics stays that of the listed one.
        planar: whether the foot moves in the hopping plane only, which is a little faster.
        slope: of the floor, rising forward [rad]; axes stay along the floor.
        steps_per_sample: of the engine. 34 make 0.245 ms: the longest step whose halving changes a
            hop of 10 s at 17 rad/s by less than 2 %.
        stick: anchor of a locked corner of the foot.
        drift: (n,) by which the free strip's angles changed since the shape was listed [rad].
        stiffer: share by which all springs of the beam are stiffer than the values and effects say.
        effects: name -> quantities, of those not yet applied (`sim.effects`).
        edits: changes of the MjSpec by applied effects.
    """

    values: Mapping[str, float]
    angles: tuple[float, ...]
    length: float
    state: Literal["unloaded", "loaded"] = "unloaded"
    increments: int = 16
    planar: bool = False
    slope: float = 0.0
    steps_per_sample: int = 34
    stick: Stick = field(default_factory=Stick)
    drift: tuple[float, ...] = ()
    stiffer: float = 0.0
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    edits: tuple[Edit, ...] = ()

    def __post_init__(self) -> None:
        """Refuse an unknown state."""
        require_named("state of a beam", self.state, ("unloaded", "loaded"))

    def __hash__(self) -> int:
        """Return a hash that equal robots have in common."""
        return hash((frozenset(self.values.items()), self.edits, self.steps_per_sample))

    @cached_property
    def hinges(self) -> tuple[Hinge, ...]:
        """Return the beam's chain."""
        return hinges(self.angles, self.values, self.increments)

    @property
    def step(self) -> float:
        """Return the engine's time step [s]."""
        return 1 / (SAMPLE_RATE_HZ * self.steps_per_sample)


def make_robot(
    values: Mapping[str, float],
    shape: ShapeFile,
    increments: int = 16,
    effects: Mapping[str, Mapping[str, float]] | None = None,
) -> Robot:
    """Return the robot of a model's values and a shape file.

    Args:
        values: of the model, SI.
        shape: of the beam.
        increments: of the simulated beam.
        effects: name -> quantities, of those that the robot has.

    Raises:
        InputError: when a value is missing, or is none of a model's.
    """
    for name in values.keys() - UNITS.keys():
        raise InputError(f"value {name!r} is none of a model's{did_you_mean(name, UNITS)}")
    if missing := [name for name in UNITS if name not in values]:
        raise InputError(f"values of a robot: {', '.join(missing)} missing")
    return Robot(
        dict(values), shape.angles, shape.length, shape.state, increments, effects=effects or {}
    )


def hinge_name(k: int) -> str:
    """Return the name of the joint before increment k."""
    return f"hinge_{k}"


def build_spec(robot: Robot, foot: Foot, drive: Drive = "speed") -> mujoco.MjSpec:
    """Build the robot, its foot free on the ground or fixed to the world.

    Installs the force laws, so that no robot can be stepped without them.

    Raises:
        InputError: when foot or drive are none that exists.
    """
    require_named("way to hold the foot", foot, get_args(Foot))
    install_force_laws()
    spec = mujoco.MjSpec()
    spec.modelname = "curved-beam hopping robot"
    spec.compiler.degree = False
    spec.option.timestep = robot.step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    gravity, slope = robot.values["gravity"], robot.slope
    spec.option.gravity = [-gravity * np.sin(slope), 0, -gravity * np.cos(slope)]
    spec.option.disableflags = int(
        mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    )
    base = _add_foot(spec, robot.values)
    if foot == "free":
        _free(base, robot.planar)
        add_ground(spec, robot.values, planar=robot.planar, stick=robot.stick)
    top = _add_top(_add_beam(base, robot), robot)
    _add_rotor(top, robot.values)
    add_drive(spec, drive)
    for edit in robot.edits:
        edit(spec, robot)
    spec.add_numeric(name=AHEAD, data=[0.5])  # behind the force laws' fields, which come first
    return spec


def compile_model(robot: Robot, foot: Foot, drive: Drive = "speed") -> mujoco.MjModel:
    """Build and compile the robot, or copy the model of one that was asked for not long ago.

    Raises:
        InputError: when MuJoCo refuses it, with the engine's own words.
    """
    model = copy.copy(_compiled(replace(robot, stiffer=0.0), foot, drive))
    if robot.stiffer:  # of one run only: a robot is not compiled anew for each
        model.jnt_stiffness *= 1 + robot.stiffer
        model.jnt_stiffnesspoly *= 1 + robot.stiffer
    return model


def chain_of(robot: Robot, foot: Foot, drive: Drive = "speed") -> PlanarChain | None:
    """Return what `read_chain` reads of the model of `compile_model`.

    Raises:
        InputError: when MuJoCo refuses the robot.
    """
    chain = _chain(replace(robot, stiffer=0.0), foot, drive)
    return chain and chain.stiffer(robot.stiffer)


@lru_cache(_KEPT)
def _chain(robot: Robot, foot: Foot, drive: Drive) -> PlanarChain | None:
    return read_chain(_compiled(robot, foot, drive))


@lru_cache(_KEPT)
def _compiled(robot: Robot, foot: Foot, drive: Drive) -> mujoco.MjModel:
    try:
        return build_spec(robot, foot, drive).compile()
    except ValueError as error:
        raise InputError(f"this robot cannot be simulated: {error}") from None


def _add_foot(spec: mujoco.MjSpec, values: Mapping[str, float]) -> mujoco.MjsBody:
    mass, length, width = (values[f"foot_{name}"] for name in ("mass", "length", "width"))
    foot = spec.worldbody.add_body(name="foot")
    about_x, about_y = mass / 12 * width**2, mass / 12 * length**2
    # a plate's third moment is the sum of the others to the last bit: the engine refuses a greater
    _set_inertia(foot, mass, np.array([about_x, about_y, about_x + about_y]))
    foot.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[length / 2, width / 2, 0.003], mass=0)
    return foot


def _add_beam(foot: mujoco.MjsBody, robot: Robot) -> mujoco.MjsBody:
    """Add the chain of increments and return the last one."""
    values, step = robot.values, robot.length / robot.increments
    mass = values["beam_mass"] / robot.increments
    inertia = mass / 12 * np.array([_THIN, step**2, step**2])
    parent, position = foot, [values["beam_root"], 0, 0]
    for k, hinge in enumerate(robot.hinges):
        body = parent.add_body(name=f"increment_{k}", pos=position)
        if hinge.stiffness is None:
            body.quat = [np.cos(hinge.angle / 2), 0, np.sin(hinge.angle / 2), 0]
        else:
            body.add_joint(
                name=hinge_name(k),
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=[0, 1, 0],
                stiffness=[hinge.stiffness, 0, 0],
                damping=[hinge.damping, 0, 0],
                springref=hinge.angle,
            )
        _set_inertia(body, mass, inertia, [step / 2, 0, 0])
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=[0.002, 0, 0],
            mass=0,
            fromto=[0, 0, 0, step, 0, 0],
        )
        parent, position = body, [step, 0, 0]
    return parent


def _add_top(last: mujoco.MjsBody, robot: Robot) -> mujoco.MjsBody:
    step, own = robot.length / robot.increments, robot.length / len(robot.angles)
    mass = robot.values["top_mass"]
    top = last.add_body(name="top", pos=[step, 0, 0])
    _set_inertia(top, mass, mass / 12 * np.array([_THIN, own**2, own**2]))
    top.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.012, 0.015, 0.012], mass=0)
    return top


def _add_rotor(top: mujoco.MjsBody, values: Mapping[str, float]) -> None:
    """Add arm and eccentric mass: a slender rod and a point, turning about +y through T."""
    radius, point, arm = values["rotor_radius"], values["rotor_mass"], values["rotor_arm_mass"]
    mass = point + arm
    centre = (point * radius + arm * radius / 2) / mass
    spread = point * (radius - centre) ** 2 + arm * (radius**2 / 12 + (radius / 2 - centre) ** 2)
    rotor = top.add_body(name="rotor")
    rotor.add_joint(name="rotor", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    thin = min(_THIN * mass / 12, spread)  # a body's greatest moment is at most the others' sum
    _set_inertia(rotor, mass, np.array([thin, spread, spread]), [centre, 0, 0])
    rotor.add_site(name="rotor", pos=[radius, 0, 0])
    rotor.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        size=[0.003, 0, 0],
        mass=0,
        fromto=[0, 0, 0, radius, 0, 0],
    )


def _set_inertia(
    body: mujoco.MjsBody, mass: float, inertia: np.ndarray, centre: list[float] | None = None
) -> None:
    body.mass = mass
    body.inertia = inertia
    body.ipos = centre or [0, 0, 0]
    body.explicitinertial = True


def _free(foot: mujoco.MjsBody, planar: bool) -> None:
    if not planar:
        foot.add_freejoint(name="foot")
        return
    slide, turn = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    foot.add_joint(name="foot_x", type=slide, axis=[1, 0, 0])
    foot.add_joint(name="foot_z", type=slide, axis=[0, 0, 1])
    foot.add_joint(name="foot_pitch", type=turn, axis=[0, 1, 0])
