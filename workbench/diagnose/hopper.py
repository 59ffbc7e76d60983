"""The hopping robot as a rig: its runs, what its model may lack, and the twin that predicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from workbench.diagnose.extension import write_extension
from workbench.diagnose.hopper_faults import hopper_faults
from workbench.diagnose.hopper_steps import Job, Stepping, coarsened
from workbench.diagnose.imagined import imagined_run
from workbench.diagnose.rig import Asked, Cause, Effects, Fault, Observed, Trial, Unknown
from workbench.identify import MeasuredRun
from workbench.identify.drive import lagged_command
from workbench.identify.events import EventTest, compare_events, twins
from workbench.identify.problem import LEAD_S
from workbench.motion import ROTOR_ANGLE
from workbench.protocol import UNITS, Document, ModelFile, ShapeFile
from workbench.sim import (
    EFFECTS,
    Condition,
    Effect,
    Robot,
    make_robot,
    sample_times,
)
from workbench.sim.effects.apply import observed
from workbench.timeseries import TimeSeries

__all__ = ["HopperRig"]

_BEAM = (
    "hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping", "top_mass", "beam_mass",
    "rotor_mass", "rotor_radius",
)  # fmt: skip
_FLOOR = ("foot_mass", "ground_stiffness", "ground_damping", "friction_slide", "friction_stick")
_ON_FLOOR = ("hop", "drop")
_RELEASES = {
    "hinge_stiffness": ("hinge_stiffness",),
    "root_stiffness": ("root_stiffness",),
    "hinge_damping": ("hinge_damping",),
    "root_damping": ("root_damping",),
    "top_mass": ("top_mass",),
    "foot_mass": ("foot_mass",),
    "rotor_unbalance": ("rotor_radius",),
    "ground_stiffness": ("ground_stiffness",),
    "ground_damping": ("ground_damping",),
    "friction_level": ("friction_slide", "friction_stick"),
}
"""Effect -> the base numbers whose tolerance it leaves."""

_OWN_STEPS = ("time_step", "motor_droop")  # what changes or upsets the simulation's steps
_STEP = 1e-4  # of a base number, as a share
_LAG_S = 0.05
_DELAY_S = 0.01
_LEAST_N = 0.05
_WEAK_N = 0.25  # a release from a weaker pull is found less well, as the pull is weaker
_GAIN = 1e-3  # how well a supply repeats a speed, as a share
_ANGLE_RAD = 5e-3
_PULL, _HEIGHT_M = 0.03, 1e-3
_PLACE_M = 3e-3  # how well a technician places T's marker, and the shape file the strip
_RUN_PLACE_M = 2e-4  # how well the origin is found again in each run
_WARMTH = 1e-3  # share of the stiffness: aluminium's falls by about 5e-4 a degree
_DISTURBED = 0.01  # of what is known of a start
_SPLIT = 5.0  # times its first size: a disturbance that has grown so much is chance
_LEAST_S, _MOST_S = 1.0, 2.0  # of a hop that are compared; derivatives are lost soon after
_UNIT = {"m": 1.0, "rad": 10.0}
_FAR_M = 10.0  # what a robot that cannot be simulated is said to do


class HopperRig:
    """The robot of one model and shape with some runs of it.

    Args:
        runs: measured, of one robot.
        document: the model file: the base, with tolerances; its effects stay as they are.
        shape: of the beam.
        places: where T's marker was found to sit, by base number [m].
        threads: of the simulation; 0 takes all cores.
    """

    def __init__(
        self,
        runs: Sequence[MeasuredRun],
        document: Document[ModelFile],
        shape: ShapeFile,
        places: Mapping[str, float] | None = None,
        threads: int = 0,
    ) -> None:
        self.name = "hopping robot"
        self.document, self.shape, self.threads = document, shape, threads
        model = document.content
        values = model.values()
        self.robot = replace(
            make_robot(values, shape, model.increments, model.quantities()), planar=True
        )
        self._stepping = Stepping(threads)
        self.measured, self.places = tuple(runs), dict(places or {})
        self._ends: dict[int, float] = {}
        self.runs = tuple(_observed(run) for run in runs)
        self.runs = tuple(self._predictable(k) for k in range(len(runs)))
        modes = {run.mode for run in runs}
        names = _BEAM + (("beam_root", *_FLOOR) if modes & set(_ON_FLOOR) else ())
        self.base = tuple(
            _parameter(name, values[name], getattr(model.parameters, name).tolerance)
            for name in names
            if getattr(model.parameters, name).tolerance > 0
        ) + tuple(_place(f"top_{axis}_m place", places or {}) for axis in "xz")
        self.causes = tuple(
            _cause(effect)
            for effect in EFFECTS.values()
            if modes & set(effect.excited_by) and effect.name not in self.robot.effects
        )

    @property
    def source(self) -> Path:
        """Return the model file."""
        return self.document.path

    def extend(
        self, path: Path, values: Mapping[str, float], effects: Effects, diagnosis: str
    ) -> HopperRig:
        """Write the extended model file and return the rig of what is read back from it."""
        own = {name: value for name, value in values.items() if name in UNITS}
        places = {name: value for name, value in values.items() if name not in UNITS}
        written = write_extension(
            path.with_name(f"{path.name}.yaml"), self.document, own, effects, diagnosis
        )
        extended = HopperRig(self.measured, written, self.shape, places, self.threads)
        return extended.shortened(self._ends)

    def with_trials(self, trials: Sequence[Trial]) -> HopperRig:
        """Return the rig with runs that nobody has made yet after its own."""
        imagined = [imagined_run(trial, self.measured[0].start_angle) for trial in trials]
        runs = (*self.measured, *imagined)
        more = HopperRig(runs, self.document, self.shape, self.places, self.threads)
        return more.shortened(self._ends)

    def shortened(self, ends: Mapping[int, float]) -> HopperRig:
        """Return the rig with some runs compared for a shorter time, also once it is extended."""
        shorter = copy(self)
        shorter._ends = {**self._ends, **ends}
        shorter.runs = tuple(run.until(ends.get(k, np.inf)) for k, run in enumerate(self.runs))
        return shorter

    def own(self, run: int) -> Sequence[Unknown]:
        """Return what a run keeps to itself: delay, stiffness, motor, release and places.

        A strip is not equally stiff from run to run: it warms, and its clamp sits anew.
        """
        measured = self.measured[run]
        weak = _WEAK_N / max(measured.pull, _LEAST_N) if measured.mode == "decay" else 1.0
        unknowns = [
            Unknown("delay", "s", 0.0, _DELAY_S * max(weak, 1.0), -0.1, 0.1, 1e-4),
            Unknown("stiffness", "1", 0.0, _WARMTH, -0.1, 0.1, 1e-5),
        ]
        if measured.driven:
            unknowns += [
                Unknown("lag", "s", _LAG_S, _LAG_S, 1e-3, 1.0, 1e-3),
                Unknown("gain", "1", 0.0, _GAIN, -0.1, 0.1, 1e-5),
                Unknown("start angle", "rad", 0.0, _ANGLE_RAD, -0.1, 0.1, 1e-4),
            ]
        elif measured.mode == "decay":
            unknowns.append(Unknown("pull", "1", 0.0, _PULL, -0.5, 0.5, 1e-4))
        else:
            unknowns.append(Unknown("height", "m", 0.0, _HEIGHT_M, -0.05, 0.05, 1e-5))
        return [
            *unknowns,
            *(Unknown(f"place {name}", "m", 0.0, _RUN_PLACE_M, -0.01, 0.01, 1e-5)
              for name in measured.places),
        ]  # fmt: skip

    def faults(self) -> Sequence[Fault]:
        """Return the runs that are not what they are said to be, as drive and bodies show."""
        return hopper_faults(self, self.measured)

    def predict(
        self, asked: Sequence[Asked], until: float = np.inf, coarse: bool = False
    ) -> list[NDArray[np.float64]]:
        """Simulate each run and return what the cameras should have seen.

        What a run's mode does not feel, and what only moves what is seen, is not simulated again.
        """
        jobs: dict[tuple[object, ...], Job] = {}
        keys = []
        for k, values in asked:
            felt = {name: v for name, v in values.items() if _felt(name, self.runs[k].mode)}
            key = (k, *sorted(felt.items()))
            if key not in jobs:
                robot = self._robot(felt)
                effects = {n: own for n, own in robot.effects.items() if not _seen_only(n)}
                robot = replace(robot, effects=effects)
                robot = coarsened(robot, self.measured[k].mode) if coarse else robot
                end = min(float(self.runs[k].times[-1]), until)
                jobs[key] = robot, self._condition(k, felt, end)
            keys.append(key)
        motions = dict(zip(jobs, self._stepping.motions(list(jobs.values())), strict=True))
        return [
            self._seen(k, values, motions[key], until)
            for (k, values), key in zip(asked, keys, strict=True)
        ]

    def events(self, run: int, values: Mapping[str, float]) -> tuple[EventTest, ...]:
        """Compare the hops of a run after the seconds that are compared, as distributions.

        Args:
            run: its index.
            values: of its unknowns by name, as for `predict`.

        Returns:
            One test for each property of a hop; none where the run or its twins hop too little.
        """
        measured, compared = self.measured[run], float(self.runs[run].times[-1])
        if measured.mode != "hop":
            return ()
        robot = self._robot(values)
        condition = self._condition(run, values, float(measured.motion.times[-1]))
        motions = self._stepping.motions([(robot, one) for one in twins(condition)])
        told = [motion.shifted(-LEAD_S) for motion in motions if motion is not None]
        return compare_events(measured, told, compared)

    def _predictable(self, k: int) -> Observed:
        """Return what was observed of a run for as long as its start foretells it.

        A hop forgets its start: two that begin a little apart part more and more, and what comes
        after tells of chance. Runs with a clamped foot foretell themselves to their end.
        """
        run = self.runs[k]
        if run.mode not in _ON_FLOOR:
            return run
        start = self.own(k)[-1 - len(self.measured[k].places)]
        asked = [(k, {}), (k, {start.name: _DISTURBED * start.tolerance})]
        told, beside = self.predict(asked)
        apart = np.abs(beside - told) / np.array([_UNIT[unit] for unit in run.units])
        grown = np.maximum.accumulate(apart.max(axis=1))
        first = grown[run.times <= _LEAST_S][-1]
        lost = np.flatnonzero(grown > _SPLIT * first)
        end = run.times[lost[0]] if len(lost) and first > 0 else run.times[-1]
        return run.until(float(np.clip(end, _LEAST_S, _MOST_S)))

    def _robot(self, values: Mapping[str, float]) -> Robot:
        changed = {name: value for name, value in values.items() if name in UNITS}
        for name in ("hinge_stiffness", "root_stiffness"):
            stated = changed.get(name, self.robot.values[name])
            changed[name] = stated * (1 + values.get("stiffness", 0.0))
        effects = {name: dict(given) for name, given in self.robot.effects.items()}
        for name, value in values.items():
            effect, dot, quantity = name.partition(".")
            if dot:
                effects.setdefault(effect, {})[quantity] = value
        return replace(self.robot, values=dict(self.robot.values) | changed, effects=effects)

    def _condition(self, k: int, values: Mapping[str, float], end: float) -> Condition:
        run = self.measured[k]
        times = sample_times(end + 2 * LEAD_S) - LEAD_S
        if not run.driven:
            pull = run.pull * (1 + values.get("pull", 0.0))
            height = max(run.height + values.get("height", 0.0), 0.0)
            still = np.zeros(len(times))
            return Condition(run.mode, still, run.start_angle, pull=pull, height=height)
        lag, gain = values.get("lag", _LAG_S), 1 + values.get("gain", 0.0)
        start = run.start_angle + values.get("start angle", 0.0)
        return Condition(run.mode, lagged_command(times, run.steps, lag, gain), start)

    def _seen(
        self, k: int, values: Mapping[str, float], motion: TimeSeries | None, until: float
    ) -> NDArray[np.float64]:
        run, seen = self.measured[k], self.runs[k]
        times = seen.times[seen.times <= until]
        if motion is None or len(motion) < 2:
            return np.full((len(times), len(seen.channels)), _FAR_M)
        robot = self._robot(values)
        cameras = {n: own for n, own in robot.effects.items() if _seen_only(n)}
        motion = observed(motion, replace(robot, effects=cameras))
        lead = LEAD_S if run.driven else 0.0  # what is let go begins with the simulation
        at = np.clip(times - values.get("delay", 0.0) + lead, 0.0, motion.times[-1])
        curve = CubicSpline(motion.times, motion.select(seen.channels).values)(at)
        for axis, name in enumerate(seen.channels):
            curve[:, axis] += values.get(f"place {name}", 0.0) + values.get(
                f"{name} place", self.places.get(f"{name} place", 0.0)
            )
        return np.asarray(curve)


def _felt(name: str, mode: str) -> bool:
    """Tell whether the motion of a run of this mode depends on an unknown."""
    effect, dot, _ = name.partition(".")
    if dot:
        return mode in EFFECTS[effect].excited_by and not _seen_only(effect)
    if name in _FLOOR:
        return mode in _ON_FLOOR
    return name != "delay" and not name.startswith("place ") and not name.endswith(" place")


def _seen_only(effect: str) -> bool:
    """Tell whether an effect acts on the cameras alone."""
    one = EFFECTS[effect]
    return one.alter is None and one.build is None and one.drive is None


def _observed(run: MeasuredRun) -> Observed:
    part = run.during(np.inf)
    rest = run.motion.between(-np.inf, 0.0).select(run.channels)
    channels = run.channels
    return Observed(
        name=run.name,
        mode=run.mode,
        role="held_out" if run.role == "held_out" else "train",
        times=part.times,
        values=np.nan_to_num(part.values),
        valid=part.valid & np.isfinite(part.values),
        channels=channels,
        units=tuple("rad" if name == ROTOR_ANGLE else "m" for name in channels),
        rest=np.where(rest.valid, rest.values, np.nan),
        forgets=run.mode in _ON_FLOOR,
    )


def _parameter(name: str, value: float, tolerance: float) -> Unknown:
    step = _STEP * abs(value)
    return Unknown(name, UNITS[name], value, tolerance, 1e-3 * value, 1e3 * value, step)


def _place(name: str, places: Mapping[str, float]) -> Unknown:
    return Unknown(name, "m", places.get(name, 0.0), _PLACE_M, -0.1, 0.1, 1e-5)


def _cause(effect: Effect) -> Cause:
    return Cause(
        name=effect.name,
        group=effect.group,
        sentence=effect.sentence,
        unknowns=tuple(
            Unknown(
                f"{effect.name}.{q.name}",
                q.unit,
                0.0,
                q.tolerance,
                q.low,
                q.high,
                q.step,
                exact=effect.name in _OWN_STEPS,
            )
            for q in effect.quantities
        ),
        shows_in=tuple(effect.excited_by),
        confused_with=effect.confused_with,
        separated_by=effect.separated_by,
        replaces=_RELEASES.get(effect.name, ()),
    )
