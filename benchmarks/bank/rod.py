"""An independent engine for the clamped and hopping robot: a planar inextensible rod.

It shares no code with the twin: exact kinematics of a continuous strip instead of hinged links,
own equations (`rod_equations`), an integrator with error control and located events (`rod_steps`),
another ground law (`rod_contact`). Only the parameters' names, units and conventions are common.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.bank.courses import RATE_HZ, Course
from benchmarks.bank.rod_constants import BRANCHES, Constants
from benchmarks.bank.rod_contact import (
    ANCHOR,
    ATTACHED,
    CORNERS,
    POINT_X,
    POINT_Z,
    SOLE_STIFFNESS,
    STATES,
    ground_forces,
)
from benchmarks.bank.rod_equations import conserved, static_forces
from benchmarks.bank.rod_laws import PITCH, Work, work
from benchmarks.bank.rod_mesh import MODES, Mesh, make_mesh
from benchmarks.bank.rod_steps import integrate

__all__ = ["Motion", "Rod", "energies", "linear_frequencies", "swing"]

Array = NDArray[np.float64]

TOLERANCE = 1e-7
"""Of a step [m, rad]: a hundred times less moves T by less than 1 um in 8 s of clamped motion."""
_ROUNDS = 80
_NUDGE = 1e-6
_BALANCED = 1e-10  # [N, N m]


@dataclass(frozen=True)
class Rod:
    """A robot.

    Args:
        values: of the model, by its names, SI.
        angles: the listed ones of the free strip, the first at the foot [rad].
        length: of the strip [m].
        laws: constants of `rod_constants.Constants` beyond the base, by name.
        profile: of the strip, as `rod_mesh.make_mesh` takes it.
        slope: of the floor, rising forward [rad].
        farther: share by which the rotor's mass sits farther out than what is seen of it.
        rocker: how far the sole's ends are raised above its middle [m]; zero for a flat sole.
        modes: how many shapes the strip bends in.
    """

    values: Mapping[str, float]
    angles: tuple[float, ...]
    length: float
    laws: Mapping[str, float] = field(default_factory=dict)
    profile: Mapping[str, float] = field(default_factory=dict)
    slope: float = 0.0
    farther: float = 0.0
    rocker: float = 0.0
    modes: int = MODES


class Motion(NamedTuple):
    """What the robot did, n samples at 120 Hz from time zero; it ends early where it fell.

    Args:
        times: (n,) [s].
        foot: (n, 2) x and z of the foot's middle from its place at rest [m].
        pitch: (n,) [rad].
        top: (n, 2) [m].
        rotor: (n, 2) the rotating mass [m].
        rotor_angle: (n,) in the world, unwrapped [rad].
        tip: (n,) angle of the strip's end against its rest, without the foot's pitch [rad].
        states: (n, s) of the engine.
        steps: that the integrator took.
    """

    times: Array
    foot: Array
    pitch: Array
    top: Array
    rotor: Array
    rotor_angle: Array
    tip: Array
    states: Array
    steps: int


class _Engine(NamedTuple):
    mesh: Mesh
    constants: Constants
    work: Work
    points: Array
    first: int


def swing(rod: Rod, course: Course, tolerance: float = TOLERANCE) -> Motion:
    """Return what a robot does from rest.

    Raises:
        ValueError: when it finds no rest or the integration does not reach its end.
    """
    engine = _engine(rod, "free" if course.mode in ("hop", "drop") else "fixed")
    engine = engine._replace(constants=engine.constants._replace(motor_lag=course.lag))
    engine, state = _start(rod, engine, course)
    samples = np.arange(round(course.duration * RATE_HZ) + 1) / RATE_HZ
    changes = np.array(course.steps).reshape(-1, 2)
    rest = _places(engine, state[None], rod)
    kept, done, steps = integrate(
        engine.mesh, engine.constants, engine.work, engine.points, state.copy(), samples,
        np.ascontiguousarray(changes[:, 0]), np.ascontiguousarray(changes[:, 1]), engine.first,
        tolerance,
    )  # fmt: skip
    motion = _places(engine, kept[:done], rod)
    if done < len(samples) and motion.top[-1, 1] + rest.foot[0, 1] > 0.1:
        raise ValueError(f"the integration ended at {samples[done - 1]:.3f} s of {samples[-1]:g} s")
    base = np.array([0.0, 0.0 if course.mode == "drop" else rest.foot[0, 1]])
    return motion._replace(
        times=samples[:done],
        steps=steps,
        foot=motion.foot - base,
        top=motion.top - base,
        rotor=motion.rotor - base,
    )


def energies(rod: Rod, motion: Motion) -> tuple[Array, Array]:
    """Return potential and kinetic energy of a clamped motion without effects, (n,) each [J]."""
    engine = _engine(rod, "fixed")
    found = [conserved(engine.mesh, engine.constants, y, engine.work, 3) for y in motion.states]
    potential, kinetic = np.array(found).T
    return potential, kinetic


def linear_frequencies(rod: Rod, rotor_angle: float, count: int = 3) -> Array:
    """Return the clamped robot's lowest natural frequencies, its rotor locked [Hz]."""
    engine = _engine(rod, "fixed")
    engine, state = _start(rod, engine, Course("clamped", 0.0, start_angle=rotor_angle))
    free = slice(3, engine.work.force.size - 1)
    stiffness = -_slope(engine, state, free, 0.0, None)
    conserved(engine.mesh, engine.constants, state, engine.work, 3)
    upper = np.triu(engine.work.mass)[free, free]
    mass = upper + np.triu(upper, 1).T
    squares = np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real
    return np.sqrt(np.sort(squares)[:count]) / (2 * np.pi)


def _engine(rod: Rod, foot: Literal["free", "fixed"]) -> _Engine:
    v = rod.values
    joint = any(rod.laws.get(law, 0.0) > 0.0 for law in ("root_play", "hysteresis"))
    mesh = make_mesh(rod.angles, rod.length, v, rod.modes, rod.profile, joint)
    increment = rod.length / len(rod.angles)
    arm, point, radius = v["rotor_arm_mass"], v["rotor_mass"], v["rotor_radius"]
    radius *= 1 + rod.farther
    lever = (point * radius + arm * radius / 2) / (arm + point)
    about_top = point * radius**2 + arm * radius**2 / 3
    same = {name: v[name] for name in Constants._fields if name in v}
    constants = Constants(**(same | {
        "foot_inertia": v["foot_mass"] / 12 * v["foot_length"] ** 2,
        "root_angle": rod.angles[0] + rod.profile.get("root", 0.0),
        "top_inertia": v["top_mass"] / 12 * increment**2,
        "rotor_mass": arm + point,
        "rotor_lever": lever,
        "rotor_inertia": about_top - (arm + point) * lever**2,
        "gravity_x": -v["gravity"] * np.sin(rod.slope),
        "gravity_z": -v["gravity"] * np.cos(rod.slope),
    } | dict(rod.laws)))  # fmt: skip
    first = 0 if foot == "free" else 3
    return _Engine(mesh, constants, work(mesh), _sole(rod), first)


def _sole(rod: Rod) -> Array:
    half = rod.values["foot_length"] / 2
    places = [(half, rod.rocker, 2.0), (-half, rod.rocker, 2.0)]
    if rod.rocker > 0:
        places += [(half / 2, 0.0, 2.0), (-half / 2, 0.0, 2.0)]
    points = np.zeros((len(places), STATES))
    points[:, [POINT_X, POINT_Z, CORNERS]] = places
    return points


def _start(rod: Rod, engine: _Engine, course: Course) -> tuple[_Engine, Array]:
    """Return the engine, its effects stated where the rest is, and the state at time zero."""
    mesh, n = engine.mesh, engine.mesh.turn.shape[1]
    size = PITCH + 1 + n + 1
    state = np.zeros(2 * size + 1 + len(mesh.mass) + BRANCHES * n + 1 + 4)
    held = engine._replace(first=3) if course.mode == "drop" else engine
    if course.mode == "hop":
        weight = -engine.constants.gravity_z * _weight(rod)
        state[1] = -weight / (engine.constants.ground_stiffness * engine.points[:, CORNERS].sum())
        engine.points[:, ATTACHED] = 1.0
    state = _rest(held, state, course.start_angle, 0.0)
    k = engine.constants
    x, z = _top(held, state)
    k = k._replace(tether_at_x=x, magnet_at_x=x + k.magnet_at_x, magnet_at_z=z + k.magnet_at_z)
    if course.mode in ("decay", "drop"):
        k = k._replace(motor_droop=0.0)
    held, engine = held._replace(constants=k), engine._replace(constants=k)
    if course.pull or k.magnet or k.loose_mass or k.tether_pull:
        state = _rest(held, state, course.start_angle, course.pull)
    state[1] += course.height if course.mode == "drop" else 0.0
    begin = 2 * size + 1 + len(mesh.mass)
    state[begin : begin + BRANCHES * n] = np.tile(state[3 : 3 + n], BRANCHES)
    if course.mode == "hop":
        _hold(engine, state)
    return engine, state


def _weight(rod: Rod) -> float:
    names = ("foot_mass", "beam_mass", "top_mass", "rotor_mass", "rotor_arm_mass")
    return sum(rod.values[name] for name in names)


def _rest(engine: _Engine, state: Array, angle: float, pull: float) -> Array:
    """Return the state at rest by Newton's method, the rotor held at an angle in the world."""
    state = state.copy()
    free = slice(max(engine.first, 1), engine.work.force.size - 1)  # x finds no rest of its own
    force = np.full(1, np.inf)
    for _ in range(_ROUNDS):
        force = _balance(engine, state, pull, angle)[free]
        if np.abs(force).max() < _BALANCED:
            return state
        change = _towards_rest(engine, _slope(engine, state, free, pull, angle), force)
        state[free] += change * min(1.0, 0.1 / max(np.abs(change).max(), 1e-12))
    raise ValueError(f"no rest: {np.abs(force).max():.2g} N(m) are left unbalanced")


def _towards_rest(engine: _Engine, slope: Array, force: Array) -> Array:
    """Return Newton's step; reversed where a joint with play would topple, which is no rest."""
    if engine.constants.root_play > 0.0:
        values, directions = np.linalg.eigh(-(slope + slope.T) / 2)
        if values[0] < 0:
            step = directions @ ((directions.T @ force) / np.abs(values))
            return np.asarray(step, dtype=np.float64)
    return np.asarray(np.linalg.solve(slope, -force), dtype=np.float64)


def _slope(engine: _Engine, state: Array, free: slice, pull: float, angle: float | None) -> Array:
    """Return the derivatives of the static forces, by central differences."""
    columns = []
    for a in range(free.start, free.stop):
        moved = np.zeros_like(state)
        moved[a] = _NUDGE
        up = _balance(engine, state + moved, pull, angle)[free]
        columns.append((up - _balance(engine, state - moved, pull, angle)[free]) / (2 * _NUDGE))
    return np.column_stack(columns)


def _balance(engine: _Engine, state: Array, pull: float, angle: float | None) -> Array:
    """Return the static forces; an angle, where given, is the rotor's in the world."""
    size, ground = engine.work.force.size, np.zeros(3)
    if angle is not None:
        state[size - 1] = angle - _tip_angle(engine, state[None])[0]
    points = engine.points.copy()
    points[:, ANCHOR] = state[0] + points[:, POINT_X]
    if engine.first == 0:
        ground_forces(points, engine.constants, state[:3], np.zeros(3), ground)
    _cage(engine, state)
    static_forces(engine.mesh, engine.constants, state, np.zeros_like(state), engine.work, ground,
                  pull, engine.first)  # fmt: skip
    return engine.work.force.copy()


def _cage(engine: _Engine, state: Array) -> None:
    """Let a loose mass lie at the bottom of its cage."""
    k = engine.constants
    if k.loose_mass <= 0:
        return
    top = _top(engine, state)
    sag = -k.gravity_z / 600.0**2
    state[-4:] = [top[0], top[1] - k.loose_room - sag, 0.0, 0.0]


def _hold(engine: _Engine, state: Array) -> None:
    """Let the points hold the foot against what a slope pulls it down with."""
    ground = np.zeros(3)
    engine.points[:, ANCHOR] = state[0] + engine.points[:, POINT_X]
    static_forces(engine.mesh, engine.constants, state, np.zeros_like(state), engine.work, ground,
                  0.0, engine.first)  # fmt: skip
    per_corner = engine.work.force[0] / engine.points[:, CORNERS].sum()
    engine.points[:, ANCHOR] -= per_corner / SOLE_STIFFNESS


def _tip_angle(engine: _Engine, states: Array) -> Array:
    n = engine.mesh.turn.shape[1]
    base = engine.constants.root_angle + engine.mesh.angle[-1]
    return base + states[:, PITCH] + states[:, 3 : 3 + n] @ engine.mesh.turn[-1]


def _top(engine: _Engine, state: Array) -> Array:
    """Return x and z of T, (2,)."""
    conserved(engine.mesh, engine.constants, state, engine.work, engine.first)
    top = len(engine.mesh.mass)
    return np.array([engine.work.place_x[top], engine.work.place_z[top]])


def _places(engine: _Engine, states: Array, rod: Rod) -> Motion:
    """Return the places of states, (n, s); times are left empty."""
    foot = states[:, :2].copy()
    pitch = states[:, PITCH]
    top = np.array([_top(engine, state) for state in states])
    tip = _tip_angle(engine, states)
    spoke = tip + states[:, engine.work.force.size - 1]
    radius = rod.values["rotor_radius"]
    rotor = top + radius * np.column_stack([np.cos(spoke), -np.sin(spoke)])
    return Motion(np.empty(0), foot, pitch, top, rotor, spoke, tip - pitch, states, 0)
