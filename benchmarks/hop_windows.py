"""What hops tell of a cause: from rest, and in windows that begin while the foot stands.

    python benchmarks/hop_windows.py [--quick]

Three hops. What the cause changes is set against what numbers of the model within their tolerances
make of it, and what is free in each piece: from rest its gain, start angle, instant and the places
of its markers; in a window the foot's place and pitch, places and rates of the beam's three lowest
modes, and the rotor's angle. Straight lines, by differences; other modes and the foot's rest are as
they were. `left` is the root mean square over T and rotor, `evidence` the least cost, tolerances
paid for. `alike` is the cosine between a number's derivatives by steps of 0.02 and of 0.1
tolerances that a tenth of the numbers do not reach: where it is low, a straight line tells nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from workbench.fit import commanded_speed
from workbench.protocol import load_model, load_shape
from workbench.sim import SAMPLE_RATE_HZ, Robot, applied, make_robot, sample_times, settle, unloaded
from workbench.sim.ground import CORNER_FIELDS, corner_records

Array = NDArray[np.float64]

CAUSES = {
    "foot_cg": {"forward": 0.0165},
    "sole_adhesion": {"pull": 0.0225},
    "ground_slope": {"slope": 0.02},
    "friction_anisotropy": {"share": 0.22},
}
"""About as much of each as a size of 3 is."""
NUMBERS = (
    "hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping", "top_mass", "beam_mass",
    "rotor_mass", "rotor_radius", "beam_root", "foot_mass", "ground_stiffness", "ground_damping",
    "friction_slide", "friction_stick",
)  # fmt: skip
SPEEDS = (17.0, 18.0, 19.0)
FROM_REST_S = (1.5, 2.0, 4.0)
WINDOWS_S = (0.36, 0.72, 1.1, 1.5)
TOTAL_S = 10.0
SETTLED_S = 2.0  # of a hop before its first window

NOISE_M = 3e-4
LAG_S = 0.05
PART = 0.2  # of a cause that is simulated
STEPS = (0.02, 0.1)  # of a tolerance
GAIN, ANGLE_RAD = 1e-4, 1e-3
ASIDE_M, BENT_RAD, TURNED_RAD = 1e-4, 2e-4, 1e-3
RINGING = 20.0  # of a mode's rate to its place [1/s]
MODES = 3
STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


@dataclass(frozen=True, eq=False)
class Twin:
    """A robot at rest, ready to be stepped."""

    model: mujoco.MjModel
    data: mujoco.MjData
    steps: int

    @classmethod
    def of(cls, robot: Robot, start_angle: float = np.pi / 2) -> Twin:
        """Return a robot with its effects, at rest."""
        changed = applied(robot)
        model, data = settle(unloaded(changed), "free", start_angle)
        return cls(model, data, robot.steps_per_sample)

    @property
    def rest(self) -> Array:
        """Return the state at rest."""
        return self.state(self.data)

    def state(self, data: mujoco.MjData) -> Array:
        """Return all that the engine goes on from."""
        kept = np.empty(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(self.model, data, kept, STATE)
        return kept

    def changed(self, state: Array, change: Callable[[mujoco.MjData], None]) -> Array:
        """Return a state that something was changed of."""
        data = mujoco.MjData(self.model)
        mujoco.mj_setState(self.model, data, state, STATE)
        change(data)
        return self.state(data)

    def run(self, state: Array, command: Array) -> tuple[Array, Array]:
        """Return foot, T and rotor, x and z, (n, 6) in noise deviations, and the states (n, s)."""
        data = mujoco.MjData(self.model)
        mujoco.mj_setState(self.model, data, state, STATE)
        mujoco.mj_forward(self.model, data)
        seen, states = [], []
        for k in range(len(command)):
            places = data.body("foot").xpos, data.body("top").xpos, data.site("rotor").xpos
            seen.append(np.concatenate([place[[0, 2]] for place in places]))
            states.append(self.state(data))
            data.ctrl[0] = command[k]
            mujoco.mj_step(self.model, data, self.steps)
        return np.array(seen) / NOISE_M, np.array(states)


@dataclass(frozen=True)
class Piece:
    """A piece of a hop: what a cause changes (m,), and what may be taken for it.

    Args:
        change: by the whole cause.
        numbers: (m, p) by a tolerance of each number of the model, for each step of `STEPS`.
        own: (m, o) by what the piece has to itself.
    """

    change: Array
    numbers: tuple[Array, Array]
    own: Array


def main() -> None:
    """Print one table for each cause."""
    quick = "--quick" in sys.argv
    model, shape = load_model("thesis", Path()).content, load_shape("thesis-initial", Path())
    robot = replace(make_robot(model.values(), shape.content), planar=True)
    tolerances = {name: getattr(model.parameters, name).tolerance for name in NUMBERS}
    robots = [_with(robot, name, part * tolerances[name]) for part in STEPS for name in NUMBERS]
    others = [Twin.of(one) for one in robots]
    speeds, causes = (SPEEDS[:1], list(CAUSES)[:1]) if quick else (SPEEDS, list(CAUSES))
    for name in causes:
        part = {key: PART * value for key, value in CAUSES[name].items()}
        twins = [Twin.of(robot), Twin.of(replace(robot, effects={name: part})), *others]
        print(f"{name} {_said(CAUSES[name])}, {len(speeds)} hops")
        print(f"{'':24}{'pieces':>8}{'left':>8}{'evidence':>10}{'alike':>8}")
        for end in FROM_REST_S[1:2] if quick else FROM_REST_S:
            pieces = [from_rest(robot, twins, speed, end) for speed in speeds]
            print(f"{f'from rest, {end:g} s':24}{_row(pieces)}", flush=True)
        for length in WINDOWS_S[1:2] if quick else WINDOWS_S:
            pieces = [one for speed in speeds for one in windows(twins, speed, length)]
            print(f"{f'windows of {length:g} s':24}{_row(pieces)}", flush=True)


def from_rest(robot: Robot, twins: Sequence[Twin], speed: float, end: float) -> Piece:
    """Return the first seconds of a hop."""
    command = commanded(end, speed)
    base, other, *numbers = (twin.run(twin.rest, command)[0] for twin in twins)
    turned = Twin.of(robot, np.pi / 2 + ANGLE_RAD)
    faster = twins[0].run(twins[0].rest, commanded(end, speed * (1 + GAIN)))[0]
    own = [
        faster - base,
        turned.run(turned.rest, command)[0] - base,
        np.gradient(base, axis=0),
        *(np.broadcast_to(axis, base.shape) for axis in np.eye(base.shape[1])),
    ]
    return _piece(base, other, numbers, own)


def windows(twins: Sequence[Twin], speed: float, length: float) -> Iterator[Piece]:
    """Yield pieces of a hop of the robot with the cause, one after the other, each from a stance.

    All twins begin in the state that the robot has there.
    """
    base, other = twins[:2]
    command, count = commanded(TOTAL_S, speed), round(length * SAMPLE_RATE_HZ) + 1
    _, states = other.run(other.rest, command)
    changes = list(starts(base))
    for begin in stances(other, states, count):
        part, state = command[begin : begin + count], states[begin]
        told, there, *numbers = (twin.run(state, part)[0] for twin in twins)
        own = [base.run(base.changed(state, change), part)[0] - told for change in changes]
        yield _piece(told, there, numbers, own)


def stances(twin: Twin, states: Array, count: int) -> Iterator[int]:
    """Yield samples in the middle of a time that all corners hold the ground, `count` apart."""
    at = round(SETTLED_S * SAMPLE_RATE_HZ)
    stuck = np.array([_stuck(twin, state) for state in states])
    while True:
        begins = at + np.flatnonzero(stuck[at:])
        if not len(begins):
            return
        free = np.flatnonzero(~stuck[begins[0] :])
        ends = begins[0] + (free[0] if len(free) else len(stuck))
        begin = int(begins[0] + ends) // 2
        if begin + count > len(states):
            return
        yield begin
        at = begin + count


def starts(twin: Twin) -> Iterator[Callable[[mujoco.MjData], None]]:
    """Yield what may be otherwise where a window begins."""

    def aside(data: mujoco.MjData) -> None:
        data.qpos[0] += ASIDE_M
        corner_records(data.userdata)[:, CORNER_FIELDS.index("anchor_m")] += ASIDE_M

    def add(places: Array, rates: Array) -> Callable[[mujoco.MjData], None]:
        def change(data: mujoco.MjData) -> None:
            data.qpos[:] += places
            data.qvel[:] += rates

        return change

    yield aside
    still, axes = np.zeros(twin.model.nv), np.eye(twin.model.nv)
    yield add(ASIDE_M * axes[1], still)
    yield add(TURNED_RAD * axes[2], still)
    for mode in beam_modes(twin):
        yield add(BENT_RAD * mode, still)
        yield add(still, RINGING * BENT_RAD * mode)
    yield add(TURNED_RAD * axes[-1], still)


def beam_modes(twin: Twin) -> Array:
    """Return the lowest modes of the beam on its foot, (m, nv), each turning it by 1 rad at most.

    Gravity is left out: they only span what may be otherwise.
    """
    model = twin.model
    mass = np.zeros((model.nv, model.nv))
    for row, axis in zip(mass, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, twin.data, row, axis)
    hinges = slice(3, model.nv - 1)
    stiffness = np.diag([float(np.ravel(one)[0]) for one in model.jnt_stiffness[hinges]])
    shapes = eigh(stiffness, mass[hinges, hinges])[1][:, :MODES].T
    modes = np.zeros((MODES, model.nv))
    modes[:, hinges] = shapes / np.abs(np.cumsum(shapes, axis=1)).max(axis=1, keepdims=True)
    return modes


def commanded(end: float, speed: float) -> Array:
    """Return the speeds of the rotor from sample to sample, (n,) [rad/s]."""
    return commanded_speed(sample_times(end), [(0.0, speed)], 1.0, LAG_S)


def refitted(pieces: Sequence[Piece]) -> tuple[float, float]:
    """Return what is left over T and rotor, root mean square, and the least cost."""
    count = len(NUMBERS)
    widths = [one.own.shape[1] for one in pieces]
    rows = []
    for k, one in enumerate(pieces):
        beside = [np.zeros((len(one.own), width)) for width in widths]
        beside[k] = one.own
        rows.append(np.hstack([one.numbers[-1], *beside]))
    columns = np.vstack([*rows, np.eye(count, count + sum(widths))])
    wanted = np.concatenate([*(one.change for one in pieces), np.zeros(count)])
    scale = np.linalg.norm(columns, axis=0)
    amounts = np.linalg.lstsq(columns / scale, wanted, rcond=1e-12)[0]
    left = wanted - (columns / scale) @ amounts
    shown = left[:-count].reshape(-1, 6)[:, 2:]
    return float(np.sqrt(np.mean(shown**2))), float(left @ left) / 2


def alike(pieces: Sequence[Piece]) -> float:
    """Return the cosine between derivatives by either step that a tenth of them do not reach."""
    short, long = (np.vstack([one.numbers[k] for one in pieces]) for k in (0, 1))
    both = np.linalg.norm(short, axis=0) * np.linalg.norm(long, axis=0)
    return float(np.quantile(np.sum(short * long, axis=0) / both, 0.1))


def _piece(base: Array, other: Array, numbers: Sequence[Array], own: Sequence[Array]) -> Piece:
    changes = np.array([(one - base).ravel() for one in numbers])
    short, long = (by.T / part for by, part in zip(np.split(changes, 2), STEPS, strict=True))
    columns = np.column_stack([one.ravel() for one in own])
    return Piece((other - base).ravel() / PART, (short, long), columns)


def _with(robot: Robot, name: str, more: float) -> Robot:
    return replace(robot, values=dict(robot.values) | {name: robot.values[name] + more})


def _stuck(twin: Twin, state: Array) -> bool:
    data = mujoco.MjData(twin.model)
    mujoco.mj_setState(twin.model, data, state, STATE)
    corners = corner_records(data.userdata)
    fields = (CORNER_FIELDS.index("state"), CORNER_FIELDS.index("touching"))
    return bool((corners[:, fields] == 1).all())


def _said(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in values.items())


def _row(pieces: Sequence[Piece]) -> str:
    left, evidence = refitted(pieces)
    return f"{len(pieces):8d}{left:8.2f}{evidence:10.0f}{alike(pieces):8.3f}"


if __name__ == "__main__":
    main()
