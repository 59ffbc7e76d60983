"""Any MJCF with hinges and slides as a system: parameters are edits of its MjSpec.

A run starts at time zero from given or fitted places and speeds of its joints, is driven by its
recorded inputs and observed in joint positions, joint speeds and places. The observer corrects all
degrees of freedom of a small mechanism, the lowest modes of a larger one; they are those of the
linearisation, by finite differences of MuJoCo's accelerations, at the start of the run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import mujoco
import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean
from workbench.fit.gain import Modes
from workbench.fit.observation import Observation
from workbench.fit.observer import Start
from workbench.fit.parameters import Acts, Parameter, Scope
from workbench.fit.systems.mjcf_fields import FIELDS
from workbench.fit.systems.mjcf_model import (
    KINDS,
    is_hinge,
    linearised,
    names_of,
    observation_of,
    require_hinges_and_slides,
    units_of,
)
from workbench.fit.systems.mjcf_parameters import (
    Edit,
    Free,
    compiled,
    explicit_inertias,
    owner_of,
    parameter,
    total,
)
from workbench.fit.systems.mjcf_runs import (
    Channel,
    Input,
    MjcfRun,
    channel_noise,
    common_sample,
    held_control,
    sound_values,
)

__all__ = ["HINGES", "SLIDES", "MjcfSystem"]

Array = NDArray[np.float64]

HINGES, SLIDES = "hinges", "slides"
"""Groups of joints; process noise in N m sqrt(s) and N sqrt(s)."""

_MODES = 6
_FOLLOWED = 10.0  # [rad/s^2] or [m/s^2]
_AFTER = 1.5  # samples between a time zero that is fitted and the first that is observed
_SURE = 3.0  # deviations of a time zero after which samples are observed
_AT_ZERO = 1e-6  # of a sample
_COARSE = 2  # times the step, for derivatives
_FOLLOWING = (mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


@dataclass(frozen=True)
class _RunParameters:
    """What one run alone knows: a joint's place and speed at the start, and when that is."""

    places: Mapping[str, Parameter]
    speeds: Mapping[str, Parameter]
    late: Parameter | None


class MjcfSystem:
    """A mechanism and its runs.

    Args:
        spec: of the MJCF file; it is not changed.
        channels: in the order of the runs' values.
        runs: measured.
        inputs: in the order of the runs' inputs; an actuator without one gets no control.
        free: what is fitted of the model, its drive and its sensors.
        per_joint: whether each joint has a process noise of its own; else hinges share one, and
            slides another.
        modes: that are corrected, at most.
        given: field and owner -> value, where it is other than the file's or, of inputs and
            channels, other than zero; what is fitted begins there.

    Raises:
        InputError: for a model with ball or free joints, for a name that it does not have, and for
            data that cannot be used.
    """

    difference = 1.0  # over a short one a gear that does not give yet shows nothing

    def __init__(
        self,
        spec: mujoco.MjSpec,
        channels: Sequence[Channel],
        runs: Sequence[MjcfRun],
        inputs: Sequence[Input] = (),
        free: Sequence[Free] = (),
        per_joint: bool = False,
        modes: int = _MODES,
        given: Mapping[Edit, float] = MappingProxyType({}),
    ) -> None:
        self.spec, self.model = explicit_inertias(spec)
        self.given = dict(given)
        require_hinges_and_slides(self.model)
        self.channels, self.inputs, self.runs = tuple(channels), tuple(inputs), tuple(runs)
        self.free, self.per_joint, self.most_modes = tuple(free), per_joint, modes
        self.sample_s = common_sample(self.runs)
        self._check_names()
        adding = {one.edit: 0.0 for one in self.free if FIELDS[one.field].adds}
        made = adding | self.given
        for edit in sorted(made, key=lambda one: one.shared):
            edit.apply(self.spec, made[edit])
        self.model = compiled(self.spec) if made else self.model
        self.edits: dict[Parameter, Edit] = dict(
            parameter(
                self.spec,
                one,
                units_of(self.model, self.channels, self.inputs, owner_of(one), one.owner),
                self.given.get(one.edit, 0.0),
            )
            for one in self.free
        )
        self._of_run = tuple(self._run_parameters(k) for k in range(len(self.runs)))
        self._first = tuple(self._first_sample(k) for k in range(len(self.runs)))
        self._sigma = channel_noise(self.channels, self.runs)
        self._seen = [sound_values(run, tuple(self._sigma)) for run in self.runs]

    @property
    def names(self) -> list[str]:
        """Return the names of the runs."""
        return [run.name for run in self.runs]

    @property
    def groups(self) -> tuple[str, ...]:
        """Return the groups of joints that have a process noise of their own."""
        return tuple(dict.fromkeys(self._group(j) for j in range(self.model.njnt)))

    @property
    def strong(self) -> dict[str, float]:
        """Return each group's process noise that lets the observer follow a far model.

        An acceleration of 10 rad/s^2 or m/s^2 over one sample, times the joint's own inertia.
        """
        data = self._data(self.model, 0, {})
        mass, _, _ = linearised(self.model, data)
        found: dict[str, float] = {}
        for joint, inertia in zip(self.model.dof_jntid, np.diag(mass), strict=True):
            group = self._group(int(joint))
            noise = _FOLLOWED * float(inertia) * np.sqrt(self.sample_s)
            found[group] = max(noise, found.get(group, 0.0))
        return found

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return what is fitted: that of the model, its drive and sensors, then that of runs."""
        own = [
            one
            for run in self._of_run
            for one in (*run.places.values(), *run.speeds.values(), run.late)
            if one is not None
        ]
        return (*self.edits, *own)

    def times(self, run: int) -> Array:
        """Return the times of a run's observed samples, (n,) [s]."""
        one = self.runs[run]
        return one.times[0] + self.sample_s * np.arange(self._first[run], len(one.times))

    def seen(self, run: int) -> Array:
        """Return the measured channels of a run, (n, c) [SI], NaN where not seen or a glitch."""
        return self._seen[run][self._first[run] :]

    def channels_of(self, run: int) -> tuple[str, ...]:
        """Return the names of the observed channels."""
        return tuple(one.name for one in self.channels)

    def feels(self, run: int, parameter: Parameter) -> bool:
        """Return True: what a mechanism does not feel is not known beforehand."""
        return True

    def lands(self, run: int) -> bool:
        """Return whether landings make its residuals kinked: never, runs of rigs are short."""
        return False

    def drive_words(self, run: int) -> list[str]:
        """Return nothing: the inputs are what was measured."""
        return []

    def sigma(self, run: int) -> Array:
        """Return the standard deviation of their noise, (c,) [SI], the same in all runs."""
        return self._sigma

    def memory(self, run: int) -> Array:
        """Return how each channel's noise remembers that of the sample before, (c,) [1]."""
        return np.array([one.memory for one in self.channels])

    def process(self, run: int, noise: Mapping[str, float]) -> Array:
        """Return the process noise of each degree of freedom, (nv,) [N sqrt(s)]."""
        return np.array([noise[self._group(j)] for j in self.model.dof_jntid])

    def modes(self, run: int) -> Modes:
        """Return the modes of the nominal mechanism about the start of a run."""
        model, data = self.model, self._data(self.model, run, {})
        data.qvel[:] = 0.0
        data.ctrl[:] = self._control(run, self._edges(run), {})[0]
        mass, stiffness, damping = linearised(model, data)
        _, shapes = scipy.linalg.eigh((stiffness + stiffness.T) / 2, mass)
        basis = shapes[:, : self.most_modes]
        observation = self._observation(model, {})
        blocks = [np.zeros((0, model.nv))]
        for body, offset in zip(observation.bodies, observation.offsets, strict=True):
            point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ offset
            jacobian = np.empty((3, model.nv))
            mujoco.mj_jac(model, data, jacobian, None, point, int(body))
            blocks.append(jacobian)
        slopes = (observation.mix @ np.vstack(blocks) + observation.pick) @ basis
        return Modes(
            basis,
            basis.T @ stiffness @ basis,
            basis.T @ damping @ basis,
            slopes,
            observation.rates @ basis - observation.delays[:, None] * slopes,
        )

    def refined(self, qpos: Sequence[Array]) -> MjcfSystem:
        """Return the system itself: its inputs are measured.

        Args:
            qpos: (n, nq) of each run, not used [m, rad].
        """
        return self

    def start(self, run: int, values: Mapping[Parameter, float], coarse: bool) -> Start:
        """Return the model of a run at its start.

        Raises:
            InputError: when MuJoCo refuses the values.
        """
        spec = self.spec.copy()
        steps = max(1, int(np.ceil(self.sample_s / spec.option.timestep - 1e-9)))
        steps = -(-steps // _COARSE) if coarse else steps
        spec.option.timestep = self.sample_s / steps
        for one in sorted(self.edits, key=lambda p: self.edits[p].shared):
            if values.get(one, one.nominal) != one.nominal:
                self.edits[one].apply(spec, values[one])
        try:
            model = spec.compile()
        except ValueError as error:
            raise InputError(f"{self.names[run]}: MuJoCo refuses the values: {error}") from None
        data = self._data(model, run, values)
        control = self._control(run, self._edges(run), values)
        self._until_first(run, model, data, values)
        state = np.empty(mujoco.mj_stateSize(model, _STATE))
        mujoco.mj_getState(model, data, state, _STATE)
        return Start(model, state, control, self._observation(model, values), steps)

    def _edges(self, run: int) -> Array:
        """Return the times between which the controls act, (n + 1,) [s]."""
        times = self.times(run)
        return np.append(times, times[-1] + self.sample_s)

    def _data(
        self, model: mujoco.MjModel, run: int, values: Mapping[Parameter, float]
    ) -> mujoco.MjData:
        """Return the state at time zero."""
        data, own = mujoco.MjData(model), self._of_run[run]
        for joint, start in self.runs[run].start.items():
            place, speed = own.places.get(joint), own.speeds.get(joint)
            here = start.position if place is None else values.get(place, place.nominal)
            rate = start.speed if speed is None else values.get(speed, speed.nominal)
            data.joint(joint).qpos[:], data.joint(joint).qvel[:] = here, rate
        mujoco.mj_forward(model, data)
        return data

    def _until_first(
        self,
        run: int,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        values: Mapping[Parameter, float],
    ) -> None:
        """Simulate from time zero, which may be fitted, to the first observed sample.

        The number of steps is that of the nominal time, so that what comes out is smooth in it.
        """
        first, late = float(self.times(run)[0]), self._of_run[run].late
        begin = 0.0 if late is None else values.get(late, late.nominal)
        count, step = int(np.ceil(first / model.opt.timestep - 1e-9)), model.opt.timestep
        if count <= 0:
            begin, count = first, 0
        edges = np.linspace(begin, first, count + 1) if count else np.array([first, first + step])
        control = self._control(run, edges, values)
        follows = np.isin(model.actuator_dyntype, _FOLLOWING) & (model.actuator_actnum == 1)
        data.act[model.actuator_actadr[follows]] = control[0, follows]
        model.opt.timestep = (first - begin) / count if count else step
        for k in range(count):
            data.ctrl[:] = control[k]
            mujoco.mj_step(model, data)
        model.opt.timestep, data.time = step, 0.0
        data.ctrl[:] = control[-1]

    def _control(self, run: int, edges: Array, values: Mapping[Parameter, float]) -> Array:
        """Return the controls between edges, (n - 1, nu)."""
        control, one = np.zeros((len(edges) - 1, self.model.nu)), self.runs[run]
        for column, given in enumerate(self.inputs):
            scale, offset, delay, lag = (
                self._number(key, given.name, values)
                for key in ("input_scale", "input_offset", "input_delay", "input_lag")
            )
            held = held_control(
                one.input_times, one.inputs[:, column], given.hold, edges, delay, lag
            )
            control[:, self.model.actuator(given.actuator).id] = (1 + scale) * held + offset
        return control

    def _number(self, key: str, owner: str, values: Mapping[Parameter, float]) -> float:
        """Return the value of a field that is no part of the spec."""
        now = {edit: values.get(p, p.nominal) for p, edit in self.edits.items()}
        return total(self.given | now, key, owner)

    def _observation(self, model: mujoco.MjModel, values: Mapping[Parameter, float]) -> Observation:
        return observation_of(
            model, self.channels, lambda key, name: self._number(key, name, values)
        )

    def _run_parameters(self, run: int) -> _RunParameters:
        one = self.runs[run]
        places, speeds, late = {}, {}, None
        for joint, start in one.start.items():
            unit = "rad" if is_hinge(self.model, self.model.joint(joint).id) else "m"
            if start.position_deviation > 0:
                places[joint] = Parameter(
                    f"{joint} at the start of {one.name}", unit, start.position,
                    start.position_deviation, scope=Scope.RUN, acts=Acts.START, run=run,
                )  # fmt: skip
            if start.speed_deviation > 0:
                speeds[joint] = Parameter(
                    f"speed of {joint} at the start of {one.name}", f"{unit}/s", start.speed,
                    start.speed_deviation, scope=Scope.RUN, acts=Acts.START, run=run,
                )  # fmt: skip
        if one.late_deviation > 0:
            latest = float(one.times[0] + self.sample_s * self._first_sample(run)) - self.sample_s
            late = Parameter(f"time zero of {one.name}", "s", 0.0, one.late_deviation, -latest,
                             latest, Scope.RUN, Acts.START, run)  # fmt: skip
        return _RunParameters(places, speeds, late)

    def _first_sample(self, run: int) -> int:
        """Return the number of the first observed sample: after time zero, however late that is."""
        one = self.runs[run]
        wait = _SURE * one.late_deviation
        wait = max(wait, _AFTER * self.sample_s) if wait else -_AT_ZERO * self.sample_s
        return max(0, int(np.ceil((wait - one.times[0]) / self.sample_s)))

    def _group(self, joint: int) -> str:
        if self.per_joint:
            return self.model.joint(joint).name or f"joint {joint}"
        return HINGES if self.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE else SLIDES

    def _check_names(self) -> None:
        """Refuse names that the model does not have, and runs of another width."""
        have: dict[str, list[str]] = {kind: names_of(self.model, kind) for kind in KINDS}
        have |= {"channel": [c.name for c in self.channels], "gravity": [""]}
        have |= {"input": [i.name for i in self.inputs]}
        wanted = [(c.of if c.of in have else "joint", c.owner) for c in self.channels]
        wanted += [("actuator", i.actuator) for i in self.inputs]
        wanted += [("joint", joint) for run in self.runs for joint in run.start]
        asked = [*self.free, *(Free(one.key, one.owner, 0.0) for one in self.given)]
        wanted += [(owner_of(one), name) for one in asked for name in one.edit.owners]
        for kind, name in wanted:
            if name not in have[kind]:
                there = ", ".join(have[kind]) or "none with a name"
                hint = did_you_mean(name, have[kind])
                raise InputError(f"there is no {kind} {name!r}{hint}; there are {there}")
        late = {name for one in asked if one.field == "delay" for name in one.edit.owners}
        for channel in self.channels:
            if channel.name in late and channel.of == "speed":
                raise InputError(
                    f"channel {channel.name}: only that of a place can have a fitted delay, not "
                    "that of a speed; one that all channels share is the opposite of an input_delay"
                )
        for run in self.runs:
            shapes = run.values.shape, run.inputs.shape
            wide = (len(run.times), len(self.channels)), (len(run.input_times), len(self.inputs))
            if shapes != wide:
                raise InputError(
                    f"{run.name}: values and inputs have shapes {shapes[0]} and {shapes[1]}; their "
                    f"stamps, channels and inputs ask for {wide[0]} and {wide[1]}"
                )
