"""The hopping robot as a rig: its runs, what its model may lack, and the twin that predicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose.events import EventTest, compare_events, twins
from workbench.diagnose.extension import write_extension
from workbench.diagnose.following import Look
from workbench.diagnose.hopper_faults import hopper_faults
from workbench.diagnose.hopper_numbers import (
    LAG_S,
    ON_FLOOR,
    base_numbers,
    causes_of,
    felt,
    own_numbers,
    seen_only,
)
from workbench.diagnose.hopper_steps import Job, Stepping, coarsened
from workbench.diagnose.hopper_windows import HopWindows, Robots
from workbench.diagnose.imagined import imagined_run
from workbench.diagnose.noise import noise_of
from workbench.diagnose.rig import Asked, Effects, Fault, Observed, Trial, Unknown
from workbench.diagnose.windows import Windows
from workbench.fit import MeasuredRun, commanded_speed
from workbench.motion import ROTOR_ANGLE
from workbench.protocol import UNITS, Document, ModelFile, ShapeFile
from workbench.sim import (
    SAMPLE_RATE_HZ,
    Condition,
    Robot,
    make_robot,
    sample_times,
)
from workbench.sim.effects.apply import observed
from workbench.timeseries import TimeSeries

__all__ = ["HopperRig"]

_LEAD_S = 0.1  # the simulation begins this long before the run, so that a delay may be negative
_DISTURBED = 0.01  # of what is known of a start
_SPLIT = 5.0  # times its first size: a disturbance that has grown so much is chance
_LEAST_S, _MOST_S = 1.0, 2.0  # of a hop that are compared; derivatives are lost soon after
_SHIFT = "time_offset"  # a window has no clock but its own
_UNIT = {"m": 1.0, "rad": 10.0}
_TURN = 2 * np.pi
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
        self._windows = HopWindows({}, {})
        self.runs = tuple(_observed(run) for run in runs)
        self.runs = tuple(self._predictable(k) for k in range(len(runs)))
        modes = {run.mode for run in runs}
        self.base = base_numbers(model, modes, places or {})
        self.causes = causes_of(modes, self.robot.effects)

    @property
    def windows(self) -> Mapping[int, Windows]:
        """Return the windows that hops are compared in, by run."""
        return self._windows.windows

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
        shorter._windows = self._windows.without(ends)
        shorter.runs = tuple(run.until(ends.get(k, np.inf)) for k, run in enumerate(self.runs))
        return shorter

    def in_windows(self, values: Mapping[int, Mapping[str, float]]) -> HopperRig | None:
        """Return the rig with hops also compared in windows that begin while the foot stands.

        From rest they are compared for a second less, then: a slip more or less there outweighs
        all windows.

        Args:
            values: of the unknowns of each run that is, near what is true.

        Returns:
            None where no hop has a stance.
        """
        noise = noise_of(self.runs, list(values))
        hops = {k: (self.measured[k], noise[k]) for k in values if self.runs[k].mode == "hop"}
        found = HopWindows.found(hops, self._robots(), values, self.threads)
        if not found.windows:
            return None
        more = copy(self)
        more._windows = found
        more.runs = tuple(
            run.until(_LEAST_S).also(*found.windows[k].rows) if k in found.windows else run
            for k, run in enumerate(self.runs)
        )
        return more

    def _robots(self) -> Robots:
        lead = round(_LEAD_S * SAMPLE_RATE_HZ)
        return Robots(self._stands, self._looks, lambda name: felt(name, "hop"), lead)

    def own(self, run: int) -> Sequence[Unknown]:
        """Return what a run keeps to itself: delay, stiffness, motor, release and places."""
        return own_numbers(self.measured[run])

    def faults(self) -> Sequence[Fault]:
        """Return the runs that are not what they are said to be, as drive and bodies show."""
        return hopper_faults(self, self.measured)

    def predict(
        self, asked: Sequence[Asked], until: float = np.inf, coarse: bool = False
    ) -> list[NDArray[np.float64]]:
        """Simulate each run and return what the cameras should have seen.

        What a run's mode does not feel, and what only moves what is seen, is not simulated again.
        """
        told = self._from_start(asked, until, coarse)
        at = [i for i, (k, _) in enumerate(asked) if k in self.windows]
        if not at or until < _LEAST_S:
            return told
        rest = self._windows.predicted([asked[i] for i in at], self._robots(), until, coarse)
        for i, later in zip(at, rest, strict=True):
            rows = int((self.runs[asked[i][0]].times <= until).sum()) - len(told[i])
            if later is None:
                later = np.full((rows, told[i].shape[1]), _FAR_M)
            told[i] = np.concatenate([told[i], later[:rows]])
        return told

    def _from_start(
        self, asked: Sequence[Asked], until: float, coarse: bool
    ) -> list[NDArray[np.float64]]:
        """Return what is seen of each run from its start on."""
        jobs: dict[tuple[object, ...], Job] = {}
        keys = []
        for k, values in asked:
            own = {name: v for name, v in values.items() if felt(name, self.runs[k].mode)}
            key = (k, *sorted(own.items()))
            if key not in jobs:
                robot = self._robot(own)
                effects = {n: v for n, v in robot.effects.items() if not seen_only(n)}
                robot = replace(robot, effects=effects)
                robot = coarsened(robot, self.measured[k].mode) if coarse else robot
                end = min(self._end(k), until)
                jobs[key] = robot, self._condition(k, own, end)
            keys.append(key)
        motions = dict(zip(jobs, self._stepping.motions(list(jobs.values())), strict=True))
        return [
            self._seen(k, values, motions[key], min(self._end(k), until))
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
        told = [motion.shifted(-_LEAD_S) for motion in motions if motion is not None]
        return compare_events(measured, told, compared)

    def _predictable(self, k: int) -> Observed:
        """Return what was observed of a run for as long as its start foretells it.

        A hop forgets its start: two that begin a little apart part more and more, and what comes
        after tells of chance. Runs with a clamped foot foretell themselves to their end.
        """
        run = self.runs[k]
        if run.mode not in ON_FLOOR:
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

    def _end(self, k: int) -> float:
        """Return how long a run is compared from its start on [s]."""
        return _LEAST_S if k in self.windows else float(self.runs[k].times[-1])

    def _stands(
        self, k: int, values: Mapping[str, float], coarse: bool
    ) -> tuple[Robot, Condition] | None:
        """Return the robot of a hop as it is simulated, and what it is put through to its end."""
        robot = self._robot(values)
        robot = coarsened(robot, "hop") if coarse else robot
        condition = self._condition(k, values, float(self.measured[k].motion.times[-1]))
        return self._stepping.stepped(robot, condition)

    def _looks(self, k: int, values: Mapping[str, float]) -> Look:
        """Return what turns a motion of a run into what is seen of it, (n, c)."""
        channels = self.runs[k].channels
        rotor = channels.index(ROTOR_ANGLE)
        cameras = self._cameras(values)
        cameras = replace(
            cameras, effects={n: v for n, v in cameras.effects.items() if n != _SHIFT}
        )
        places = np.array([self._place(name, values) for name in channels])

        def look(motion: TimeSeries) -> NDArray[np.float64]:
            seen = observed(motion, cameras).select(channels).values + places
            turned = seen[0, rotor] - motion.select((ROTOR_ANGLE,)).values[0, 0]
            seen[:, rotor] -= _TURN * np.round(turned / _TURN)  # cameras count none
            return seen

        return look

    def _cameras(self, values: Mapping[str, float]) -> Robot:
        """Return the robot with only what acts on the cameras."""
        robot = self._robot(values)
        return replace(robot, effects={n: v for n, v in robot.effects.items() if seen_only(n)})

    def _place(self, name: str, values: Mapping[str, float]) -> float:
        """Return how far a channel's marker is from where the shape file has it."""
        stated = self.places.get(f"{name} place", 0.0)
        return values.get(f"place {name}", 0.0) + values.get(f"{name} place", stated)

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
        times = sample_times(end + 2 * _LEAD_S) - _LEAD_S
        if not run.driven:
            pull = run.pull * (1 + values.get("pull", 0.0))
            height = max(run.height + values.get("height", 0.0), 0.0)
            still = np.zeros(len(times))
            return Condition(run.mode, still, run.start_angle, pull=pull, height=height)
        lag, gain = values.get("lag", LAG_S), 1 + values.get("gain", 0.0)
        start = run.start_angle + values.get("start angle", 0.0)
        return Condition(run.mode, commanded_speed(times, run.steps, gain, lag), start)

    def _seen(
        self, k: int, values: Mapping[str, float], motion: TimeSeries | None, until: float
    ) -> NDArray[np.float64]:
        run, seen = self.measured[k], self.runs[k]
        times = seen.times[seen.times <= until]
        if motion is None or len(motion) < 2:
            return np.full((len(times), len(seen.channels)), _FAR_M)
        motion = observed(motion, self._cameras(values))
        lead = _LEAD_S if run.driven else 0.0  # what is let go begins with the simulation
        at = np.clip(times - values.get("delay", 0.0) + lead, 0.0, motion.times[-1])
        curve = scipy.interpolate.CubicSpline(motion.times, motion.select(seen.channels).values)(at)
        for axis, name in enumerate(seen.channels):
            curve[:, axis] += self._place(name, values)
        return np.asarray(curve)


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
        forgets=run.mode in ON_FLOOR,
    )
