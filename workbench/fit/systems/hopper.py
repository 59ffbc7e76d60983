"""The hopping robot as a system: planar, its rotor turned as it was seen to turn.

Every channel has its origin where it rested, in the measurement and in the model alike. A driven
run starts from the robot at rest, a ring-down from the equilibrium that holds T where it rested, a
drop from the shape that the strip has in the hand. The rotor's joint angle is an input.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import mujoco
import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.arm import arm_of
from workbench.fit.drive import Torque, fit_drive, motor_torque
from workbench.fit.gain import Modes
from workbench.fit.measured import MeasuredRun
from workbench.fit.noise import Coloured, coloured_noise
from workbench.fit.observation import Observation, Pose
from workbench.fit.observer import Start
from workbench.fit.parameters import Parameter
from workbench.fit.soundness import clock_words
from workbench.fit.systems.hopper_model import anchors, jacobian
from workbench.fit.systems.hopper_own import Own, own_of
from workbench.fit.systems.hopper_rest import held, rest_of
from workbench.fit.systems.hopper_seen import is_clamped, seen_run
from workbench.fit.systems.hopper_view import View
from workbench.motion import ROTOR_ANGLE, TOP
from workbench.sim import (
    EFFECTS,
    SAMPLE_RATE_HZ,
    Robot,
    Statics,
    applied,
    chain_of,
    mass_matrix,
    moving_dofs,
    parallel_map,
    settle,
    unloaded,
)

__all__ = ["BEAM", "FOOT", "HOPPING_BEAM", "Hopper"]

Array = NDArray[np.float64]

BEAM, HOPPING_BEAM, FOOT = "beam", "hopping beam", "foot"
"""Groups of joints; process noise in N m sqrt(s) at a hinge, in N sqrt(s) at the foot. What a model
misses grows with the motion: the independent engine's beam in 16 increments asks for 6e-4 near a
resonance, where it hops for 6e-5."""

OF_FLOOR = (
    "foot_mass", "ground_stiffness", "ground_damping", "friction_slide", "friction_stick",
    "friction_threshold", "ground_stiffness_y", "ground_damping_y",
)  # fmt: skip
"""Parameters that a clamped foot does not feel."""

_MODES = 3
_MOST_STEPS = 136
_SMOOTH = 1e-3
"""Share of a difference where no foot lands. Over whole ones the square of the step made a slope of
199 of one of 109: where causes do nearly the same, no step of such a Jacobian lowers the cost."""


class Hopper:
    """The robot and its runs.

    Args:
        robot: everything that is not fitted stays as it is here.
        runs: measured.
        free: parameters of the model that are fitted.
        candidates: parameter -> effect and quantity of an extension that are fitted as well.
        turned: (n,) angle of each run's rotor against T at every observed sample [rad], about T
            itself; None where nothing drives it.
        warmth: share by which the beam's stiffness may differ from run to run, a standard
            deviation: a strip warms, and a clamp sits anew.
        coloured: channel -> its noise, where that has a memory; None takes what the runs show.
    """

    groups = (BEAM, HOPPING_BEAM, FOOT)
    strong: Mapping[str, float] = MappingProxyType({BEAM: 2e-4, HOPPING_BEAM: 2e-4, FOOT: 5e-3})
    sample_s = 1 / SAMPLE_RATE_HZ
    difference = _SMOOTH

    def __init__(
        self,
        robot: Robot,
        runs: Sequence[MeasuredRun],
        free: Sequence[Parameter] = (),
        candidates: Mapping[Parameter, tuple[str, str]] = MappingProxyType({}),
        turned: Sequence[Array | None] = (),
        warmth: float = 0.0,
        coloured: Mapping[str, Coloured] | None = None,
    ) -> None:
        self.robot, self.runs, self.free = replace(robot, planar=True), tuple(runs), tuple(free)
        self.candidates, self.warmth = dict(candidates), warmth
        self.coloured = coloured_noise(runs) if coloured is None else coloured
        self._seen = [seen_run(run, self.coloured) for run in runs]
        self.turned = tuple(turned) or tuple(self._guessed(k) for k in range(len(runs)))
        self._stood = self._rest_of_top()
        self.own = tuple(self._own(k) for k in range(len(runs)))

    @property
    def names(self) -> list[str]:
        """Return the names of the runs."""
        return [run.name for run in self.runs]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return what is fitted: the model's parameters, candidates, then those of single runs."""
        return (*self.free, *self.candidates, *(p for own in self.own for p in own.every))

    def turning(self, turned: Sequence[Array | None]) -> Hopper:
        """Return the system with other rotor angles.

        Args:
            turned: (n,) of each run, against T [rad]; None where nothing drives it.
        """
        return Hopper(
            self.robot, self.runs, self.free, self.candidates, turned, self.warmth, self.coloured
        )

    def times(self, run: int) -> Array:
        """Return the times of a run's observed samples, (n,) [s]."""
        first = self._seen[run].first
        return self.runs[run].motion.times[first : first + len(self._seen[run].seen)]

    def first(self, run: int) -> int:
        """Return the number of a run's first observed sample."""
        return self._seen[run].first

    def world_angle(self, run: int) -> Array:
        """Return the rotor's angle in the world at the observed samples, (n,) [rad], NaN unseen."""
        motion, first = self.runs[run].motion, self._seen[run].first
        angle = np.where(motion.validity(ROTOR_ANGLE), motion[ROTOR_ANGLE], np.nan)
        return angle[first : first + len(self._seen[run].seen)]

    def seen(self, run: int) -> Array:
        """Return the measured channels of a run, (n, c) [m], pitch [rad], NaN where not seen."""
        return self._seen[run].seen

    def channels_of(self, run: int) -> tuple[str, ...]:
        """Return the names of the observed channels."""
        return self._seen[run].channels

    def feels(self, run: int, parameter: Parameter) -> bool:
        """Return whether a parameter can change a run: a clamped foot feels no floor."""
        if parameter in self.candidates:
            return self.runs[run].mode in EFFECTS[self.candidates[parameter][0]].excited_by
        return not (is_clamped(self.runs[run]) and parameter.name in OF_FLOOR)

    def lands(self, run: int) -> bool:
        """Return whether its foot is free: landings and slips make kinks in every parameter."""
        return not is_clamped(self.runs[run])

    def drive_words(self, run: int) -> list[str]:
        """Return by how much the rotor turned otherwise than commanded, where beyond doubt."""
        one, turned = self.runs[run], self.turned[run]
        if turned is None:
            return []
        return clock_words(one.name, self.times(run), turned, one.steps, float(one.noise()[-1]))

    def sigma(self, run: int) -> Array:
        """Return the standard deviation of their noise, (c,) [m], pitch [rad]."""
        return self._seen[run].sigma

    def memory(self, run: int) -> Array:
        """Return the correlation of their noise with that of the sample before, (c,) [1]."""
        return self._seen[run].memory

    def process(self, run: int, noise: Mapping[str, float]) -> Array:
        """Return the process noise, (nv,) [N sqrt(s), N m sqrt(s)]; that of the rotor is zero."""
        clamped, lever = is_clamped(self.runs[run]), self.robot.values["foot_length"] / 2
        beam = noise[BEAM if clamped else HOPPING_BEAM]
        hinges = [beam for hinge in self.robot.hinges if hinge.stiffness is not None]
        foot = [] if clamped else [noise[FOOT], noise[FOOT], noise[FOOT] * lever]
        return np.array([*foot, *hinges, 0.0])

    def modes(self, run: int) -> Modes:
        """Return the lowest modes of the nominal robot, the rotor locked to T.

        A free foot has no ground under it here, so that x, z and pitch move without a spring.
        """
        robot = unloaded(applied(self.robot))
        model, data = settle(robot, "fixed", self.runs[run].start_angle)
        dofs = moving_dofs(model, "fixed")
        stiffness = Statics(model, data, dofs, "top", chain_of(robot, "fixed")).balance().stiffness
        mujoco.mj_forward(model, data)
        if is_clamped(self.runs[run]):
            count = _MODES
        else:
            model, data = settle(robot, "free", self.runs[run].start_angle)
            foot = model.nv - 1 - len(dofs)
            dofs = np.concatenate([np.arange(foot), dofs + foot])
            stiffness = scipy.linalg.block_diag(np.zeros((foot, foot)), stiffness)
            count = foot + _MODES
        mass = mass_matrix(model, data)[np.ix_(dofs, dofs)]
        squares, shapes = scipy.linalg.eigh((stiffness + stiffness.T) / 2, mass)
        basis = np.zeros((model.nv, count))
        basis[dofs] = shapes[:, :count]
        observation = self._observation(run, model, data, View())
        slopes = np.vstack([jacobian(model, data, int(b)) for b in observation.bodies])
        return Modes(
            basis,
            np.diag(np.maximum(squares[:count], 0.0)),
            basis.T @ (model.dof_damping[:, None] * basis),
            observation.mix @ slopes @ basis + observation.pick @ basis,
        )

    def start(self, run: int, values: Mapping[Parameter, float], coarse: bool) -> Start:
        """Return the model of a run at its start.

        Raises:
            InputError: when the values cannot be simulated, in however short steps.
        """
        whole = self.robot_with(values)
        if (stiffer := self.own[run].stiffer) is not None:
            whole = replace(whole, stiffer=values.get(stiffer, 0.0))
        robot, view = applied(whole, turning=False), View.of(whole.effects)
        while True:
            try:
                return self._start(run, robot, view, values, coarse)
            except InputError:
                robot = replace(robot, steps_per_sample=2 * robot.steps_per_sample)
                if robot.steps_per_sample > _MOST_STEPS:
                    raise

    def _start(
        self, run: int, robot: Robot, view: View, values: Mapping[Parameter, float], coarse: bool
    ) -> Start:
        one, seen = self.runs[run], self._seen[run]
        radius, control, lead = robot.values["rotor_radius"], np.zeros(len(seen.seen)), 0.0
        start_angle = float(view.true_angle(np.array(one.start_angle), radius))
        own = self.own[run]
        if own.late is not None:
            late = values.get(own.late, 0.0)
            lead = float(one.motion.times[seen.first]) - late
        elif (turned := self.turned[run]) is not None:
            offset, slope = (values.get(p, 0.0) for p in own.phase)
            angle = turned + offset + slope * np.linspace(-1, 1, len(turned))
            angle = angle - view.tilt
            control[:-1], start_angle = np.diff(angle) / self.sample_s, float(angle[0])
        height = one.height
        if own.height is not None:
            height = max(values.get(own.height, height), 0.0)
        rest = rest_of(robot, one.mode, start_angle, height, coarse)
        model, state = rest.compiled.model, rest.state
        observation = self._observation(run, model, rest.pose, view)
        if own.place:
            offset = np.array([values.get(p, p.nominal) for p in own.place])
            foot = view.matrix @ rest.pose.xpos[model.body("foot").id, [0, 2]]
            stood = -foot if self._stood is None else self._stood - observation.of(rest.pose)
            bias = stood + offset
            point, (x, z) = observation.offsets[-1].tolist(), (seen.rest - bias).tolist()
            state = held(rest, view, int(observation.bodies[-1]), tuple(point), (x, z))
        else:
            bias = seen.rest - observation.of(rest.pose)
        return Start(
            model, state, np.repeat(control[:, None], model.nu, axis=1),
            replace(observation, bias=bias), rest.compiled.steps, lead, anchors(model), rest.chain,
        )  # fmt: skip

    def robot_with(self, values: Mapping[Parameter, float]) -> Robot:
        """Return the robot with the values of the parameters that are not nominal."""
        own, effects = dict(self.robot.values), {n: dict(v) for n, v in self.robot.effects.items()}
        for parameter in self.free:
            own[parameter.name] = values.get(parameter, parameter.nominal)
        for parameter, (effect, quantity) in self.candidates.items():
            effects.setdefault(effect, {})[quantity] = values.get(parameter, parameter.nominal)
        return replace(self.robot, values=own, effects=effects)

    def _observation(
        self, run: int, model: mujoco.MjModel, data: mujoco.MjData | Pose, view: View
    ) -> Observation:
        """Return what is seen of x and z of T, and before them of a free foot; pitch last.

        Args:
            run: its number.
            model: of the robot.
            data: of it at rest, where the point taken for T is known.
            view: of the cameras.
        """
        names = ["top"] if is_clamped(self.runs[run]) else ["foot", "top"]
        bodies = np.array([model.body(name).id for name in names], dtype=np.int64)
        count = len(self.sigma(run))
        mix, pick = np.zeros((count, 3 * len(bodies))), np.zeros((count, model.nq))
        for p in range(len(bodies)):
            mix[2 * p : 2 * p + 2, 3 * p : 3 * p + 3 : 2] = view.matrix
        if count > 2 * len(bodies):
            pick[-1, 2] = 1.0
        offsets = np.zeros((len(bodies), 3))
        offsets[-1] = data.xmat[bodies[-1]].reshape(3, 3).T @ view.point
        return Observation(bodies, offsets, mix, pick, np.zeros(count))

    def _own(self, run: int) -> Own:
        first, count = float(self.times(run)[0]), len(self._seen[run].seen)
        sigma, memory = self.rotor_noise(run)
        phase = sigma * float(np.sqrt((1 + memory) / (1 - memory) / count))
        return own_of(self.runs[run], run, first, phase, self.warmth, self._stood is not None)

    def _rest_of_top(self) -> Array | None:
        """Return where T rests without a pull, (2,) [m], as the clamped runs saw it.

        Hops do not show it: a free foot tips at rest, and T with it.
        """
        rests = [self._seen[k].rest for k, run in enumerate(self.runs) if run.mode == "clamped"]
        return np.median(rests, axis=0) if rests else None

    def _guessed(self, run: int) -> Array | None:
        """Return the rotor's angle against T as commanded, T's turn taken for noise."""
        one = self.runs[run]
        if not one.driven:
            return None
        times, seen, sigma = self.times(run), self.world_angle(run), float(one.noise()[-1])
        return fit_drive(times, seen, one.steps, sigma).angle

    def turn_of_top(self, run: int, qpos: Array) -> Array:
        """Return how far T has turned since the first sample in states, (n,) [rad].

        Args:
            run: its number.
            qpos: (n, nq) states [m, rad].
        """
        turn = qpos[:, 0 if is_clamped(self.runs[run]) else 2 : -1].sum(axis=1)
        return np.asarray(turn - turn[0])

    def angle_against_top(self, run: int, qpos: Array) -> Array | None:
        """Return a rotor's angle against T, (n,) [rad]; None where none is driven.

        It is the same for every hypothesis: about T, wherever the arm shows the point taken for it.

        Args:
            run: its number.
            qpos: (n, nq) states [m, rad].
        """
        one = self.runs[run]
        if not one.driven:
            return None
        angle, turn = self.world_angle(run), self.turn_of_top(run, qpos)
        arm = arm_of(self, [turn if k == run else None for k in range(len(self.runs))])
        sigma, memory = self.rotor_noise(run)
        if arm.off:  # else what is found of it is noise, that would shake T once a turn
            angle = arm.true_angle(angle - turn) + turn
        torque = self.motor_torque(run)
        return fit_drive(self.times(run), angle, one.steps, sigma, turn, memory, torque).angle

    def motor_torque(self, run: int) -> Torque:
        """Return the torque of a run's motor by the rotor's angle, from where T was seen."""
        places = self.channels_of(run)
        path = self.seen(run)[:, [places.index(TOP[0]), places.index(TOP[2])]]
        return motor_torque(self.robot.values, path, self.sample_s)

    def rotor_noise(self, run: int) -> Coloured:
        """Return the noise of the rotor's angle."""
        sigma = float(self.runs[run].noise()[-1])
        return self.coloured.get(ROTOR_ANGLE, Coloured(sigma, 0.0))

    def refined(self, qpos: Sequence[Array]) -> Hopper:
        """Return the system with rotor angles against T whose turn was estimated.

        Args:
            qpos: (n, nq) of each run, of an observer [m, rad].
        """
        runs = range(len(qpos))
        return self.turning(parallel_map(lambda k: self.angle_against_top(k, qpos[k]), runs))
