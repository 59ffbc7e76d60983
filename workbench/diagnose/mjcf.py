"""Any MJCF model with measured channels as a rig: a lab's pendulum, a mass on a spring, a robot."""

from __future__ import annotations

import copy
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import mujoco
import numpy as np
import scipy
from mujoco.batch import Batch
from numpy.typing import NDArray

from workbench.diagnose.mjcf_causes import causes_of
from workbench.diagnose.mjcf_channels import channels_of, shown
from workbench.diagnose.mjcf_data import RigData, read_run
from workbench.diagnose.mjcf_extension import found_values, write_extended
from workbench.diagnose.mjcf_names import checked, index_of
from workbench.diagnose.mjcf_numbers import (
    FURTHEST,
    JOINT_EFFECTS,
    MASS,
    field_unit,
    read_field,
    set_field,
)
from workbench.diagnose.rig import Asked, Effects, Fault, Observed, Unknown
from workbench.errors import InputError
from workbench.protocol import Document, RigFile, RigInput, RigRun, load
from workbench.sim import keep_engine_quiet

__all__ = ["MjcfRig", "load_rig"]

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_MOST_AT_ONCE = 16  # simulations whose every step is kept
_MARGIN_S = 0.1  # simulated beyond the end, so that a delay may be negative
_STEP = 1e-4  # of a base number's share, or of a channel's range
_LEAST_SHARE, _MOST_SHARE = 1e-3, 1e3
_START_TOLERANCE = 0.1  # of a channel's range
_START_REACH = 10.0  # ranges
_FIRST = 9  # samples that tell a moving start
_REST_S = 1.0  # the last of it tells where a joint was held
_FAR = 1e6  # where a channel of a simulation that blew up is said to be

Simulated = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Times (m,) [s] and channels (m, c)."""


class MjcfRig:
    """A model, its channels and what was measured; see `docs/reference/files.md`.

    Args:
        file: the rig file as read.
        threads: of the simulation; 0 takes all cores. Results do not depend on it.

    Raises:
        FileFaults: with line and column, for names that the model or the data do not have.
        InputError: for a model that cannot be compiled or data that cannot be used.
    """

    def __init__(self, file: Document[RigFile], threads: int = 0) -> None:
        content = file.content
        self.name, self.file = content.name, file
        self.threads = threads or os.cpu_count() or 1
        self.model = _compiled(file)
        checked(file, self.model)
        self._sources = tuple(channels_of(content, self.model))
        units = tuple(source.unit for source in self._sources)
        self.data: tuple[RigData, ...] = tuple(
            read_run(file, k, units) for k in range(len(content.runs))
        )
        self.runs: tuple[Observed, ...] = tuple(data.seen for data in self.data)
        self._owners = {
            f"{p.owner}_{p.field}": (p, index_of(self.model, "body" if p.joint is None else "joint",
                                                 p.owner))
            for p in content.parameters
        }  # fmt: skip
        for parameter, owner in self._owners.values():
            if parameter.value is not None:
                set_field(self.model, parameter.field, owner, parameter.value)
        mujoco.mj_setConst(self.model, mujoco.MjData(self.model))
        self.base = tuple(
            _parameter(name, read_field(self.model, p.field, owner), p.tolerance,
                       field_unit(self.model, p.field, owner))
            for name, (p, owner) in self._owners.items()
        )  # fmt: skip
        every = tuple(causes_of(content, self.model, set(self._owners), units))
        self._found = found_values(file, every)
        has = {found.cause for found in content.found}
        self.causes = tuple(cause for cause in every if cause.name not in has)
        self._sensed = {
            u.name for cause in every if cause.group == "sensor" for u in cause.unknowns
        }
        self._starts = tuple(
            tuple(self._start_unknowns(k, run)) for k, run in enumerate(content.runs)
        )

    @property
    def source(self) -> Path:
        """Return the rig file."""
        return self.file.path

    @property
    def files(self) -> dict[str, Path]:
        """Return what the rig file names: the MJCF file and the data of each run."""
        folder, content = self.file.path.parent, self.file.content
        named = {"MJCF": content.model}
        named |= {seen.name: run.data for seen, run in zip(self.runs, content.runs, strict=True)}
        return {what: folder / path for what, path in named.items()}

    def extend(
        self, path: Path, values: Mapping[str, float], effects: Effects, diagnosis: str
    ) -> MjcfRig:
        """Write the rig with refitted numbers and found causes, and return it as read back.

        Args:
            path: of the new file, without its ending.
            values: of the base as refitted beside the effects.
            effects: cause -> quantity -> value and standard error.
            diagnosis: name of what it came from.

        Raises:
            InputError: when the file exists.
        """
        named = [values.get(name) for name in self._owners]
        target = path.with_name(f"{path.name}.yaml")
        write_extended(target, self.file, named, effects, diagnosis)
        return load_rig(target, self.threads)

    def own(self, run: int) -> Sequence[Unknown]:
        """Return where the joints of a run stood, and how fast they were, that data must tell."""
        return self._starts[run]

    def faults(self) -> Sequence[Fault]:
        """Return nothing: of a machine that it does not know, the engine's own checks tell."""
        return ()

    def predict(
        self, asked: Sequence[Asked], until: float = np.inf, coarse: bool = False
    ) -> list[NDArray[np.float64]]:
        """Simulate each run and return what its channels should have shown, (n, c).

        Args:
            asked: run and values by name; those that are not named are as stated.
            until: only samples up to this time are needed [s].
            coarse: takes half as many steps.
        """
        jobs: dict[tuple[object, ...], tuple[int, dict[str, float]]] = {}
        keys = []
        asked = [(k, {**self._found, **values}) for k, values in asked]
        for k, values in asked:
            moving = {n: v for n, v in values.items() if not self._only_seen(n)}
            key = (k, *sorted(moving.items()))
            jobs.setdefault(key, (k, moving))
            keys.append(key)
        done = dict(zip(jobs, self._simulated(list(jobs.values()), until, coarse), strict=True))
        return [
            self._seen(k, values, done[key], until)
            for (k, values), key in zip(asked, keys, strict=True)
        ]

    def _only_seen(self, name: str) -> bool:
        """Tell whether an unknown only changes what is seen of a motion."""
        return name in self._sensed

    def _simulated(
        self, jobs: Sequence[tuple[int, dict[str, float]]], until: float, coarse: bool
    ) -> list[Simulated]:
        """Simulate; jobs of one run go together, as they have the same times."""
        done: dict[int, Simulated] = {}
        for k in range(len(self.runs)):
            members = [i for i, (run, _) in enumerate(jobs) if run == k]
            for begin in range(0, len(members), _MOST_AT_ONCE):
                part = members[begin : begin + _MOST_AT_ONCE]
                results = self._rolled_out(k, [jobs[i][1] for i in part], until, coarse)
                done |= dict(zip(part, results, strict=True))
        return [done[i] for i in range(len(jobs))]

    def _rolled_out(
        self, k: int, values: Sequence[Mapping[str, float]], until: float, coarse: bool
    ) -> list[Simulated]:
        """Simulate one run with several sets of values."""
        seen = self.runs[k].times
        sample = float(np.mean(np.diff(seen)))
        steps = max(1, int(np.ceil(sample / self.model.opt.timestep - 1e-9)))
        steps = -(-steps // 2) if coarse else steps
        count = int(np.ceil((min(until, float(seen[-1])) + _MARGIN_S) / sample)) + 1
        models = [self._model(given, sample / steps) for given in values]
        keep_engine_quiet()
        batch = Batch(self.model, nsim=len(models), nthread=min(self.threads, len(models)))
        batch.set_models(models)
        for row, (model, given) in enumerate(zip(models, values, strict=True)):
            mujoco.mj_getState(model, self._start(k, model, given), batch.state[row], _STATE)
        middles = (np.arange(count * steps) + 0.5) * sample / steps
        control = np.stack([self._control(k, middles, given) for given in values])
        records = batch.rollout(
            count * steps, control if self.model.nu else None, record=("qpos", "qvel")
        )
        times = np.arange(count, dtype=np.float64) * sample
        results = []
        for row, (model, given) in enumerate(zip(models, values, strict=True)):
            start = self._start(k, model, given)
            qpos, qvel = (
                np.vstack([first, records[name][row, steps - 1 : -1 : steps]])
                for name, first in (("qpos", start.qpos), ("qvel", start.qvel))
            )
            found = shown(self._sources, model, qpos, qvel)
            results.append((times, np.where(np.isfinite(found), found, _FAR)))
        return results

    def _model(self, values: Mapping[str, float], step: float) -> mujoco.MjModel:
        """Return the model with other numbers and what its causes add."""
        model = copy.copy(self.model)
        model.opt.timestep = step
        for name, value in values.items():
            if name in self._owners:
                parameter, owner = self._owners[name]
                set_field(model, parameter.field, owner, value)
        effects = self.file.content.effects
        for joint, given in effects.joints.items():
            owner = index_of(model, "joint", joint)
            for effect in given:
                generic = JOINT_EFFECTS[effect]
                value = values.get(f"{joint}_{effect}.{generic.quantity}", 0.0)
                if value and generic.add is not None:
                    generic.add(model, owner, value)
        for body in effects.bodies:
            value = values.get(f"{body}_mass.{MASS.quantity}", 0.0)
            if value and MASS.add is not None:
                MASS.add(model, index_of(model, "body", body), value)
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return model

    def _start(self, k: int, model: mujoco.MjModel, values: Mapping[str, float]) -> mujoco.MjData:
        """Return the state in which a run begins."""
        data = mujoco.MjData(model)
        unknowns = {unknown.name: unknown.stated for unknown in self._starts[k]}
        for joint, start in self.file.content.runs[k].start.items():
            place, speed = f"start {joint}", f"start speed {joint}"
            here = values.get(place, unknowns[place]) if isinstance(start, str) else start
            data.joint(joint).qpos[:] = here
            data.joint(joint).qvel[:] = values.get(speed, unknowns.get(speed, 0.0))
        mujoco.mj_forward(model, data)
        return data

    def _control(
        self, k: int, times: NDArray[np.float64], values: Mapping[str, float]
    ) -> NDArray[np.float64]:
        """Return the controls at some times, (m, nu), the inputs between their samples by lines."""
        control = np.zeros((len(times), self.model.nu))
        data = self.data[k]
        for column, (name, given) in enumerate(self.file.content.inputs.items()):
            delay, gain, offset = (
                values.get(f"{name}_{effect}.{quantity}", 0.0)
                for effect, quantity in (("delay", "delay"), ("gain", "share"), ("offset",) * 2)
            )
            acted = _replayed(given, data.input_times, data.inputs[:, column], times - delay)
            control[:, index_of(self.model, "actuator", given.actuator)] = (
                1 + gain
            ) * acted + offset
        return control

    def _seen(
        self, k: int, values: Mapping[str, float], simulated: Simulated, until: float
    ) -> NDArray[np.float64]:
        """Return what the channels show of a simulated run."""
        times, channels = simulated
        asked = self.runs[k].times[self.runs[k].times <= until]
        moving = "free" in self.file.content.runs[k].start.values()
        columns = []
        for column, name in enumerate(self.runs[k].channels):
            delay, gain, offset = (
                values.get(f"{name}_{effect}.{quantity}", 0.0)
                for effect, quantity in (("delay", "delay"), ("gain", "share"), ("offset",) * 2)
            )
            # what was held did not move before; what moved already is drawn on
            at = np.minimum(asked - delay if moving else np.maximum(asked - delay, 0.0), times[-1])
            columns.append(
                (1 + gain) * scipy.interpolate.CubicSpline(times, channels[:, column])(at) + offset
            )
        return np.column_stack(columns)

    def _start_unknowns(self, k: int, run: RigRun) -> Iterator[Unknown]:
        """Yield place and speed of the joints that begin where the data say."""
        seen = self.runs[k]
        for joint, start in run.start.items():
            if not isinstance(start, str):
                continue
            column = _channel_of(self.file.content, joint)
            values = np.where(seen.valid, seen.values, np.nan)[:, column]
            size = max(float(np.nanmax(values) - np.nanmin(values)), 1e-9)
            place, speed = _first_place(seen, column, start)
            yield _free(f"start {joint}", seen.units[column], place, size)
            if start == "free":
                rate = size / float(seen.times[_FIRST] - seen.times[0])
                yield _free(f"start speed {joint}", f"{seen.units[column]}/s", speed, rate)


def load_rig(path: Path, threads: int = 0) -> MjcfRig:
    """Read a rig file, its model and its data.

    Raises:
        InputError: when one of them cannot be read or used.
        FileFaults: with all faults of the rig file.
    """
    return MjcfRig(load(path, RigFile), threads)


def _compiled(file: Document[RigFile]) -> mujoco.MjModel:
    path = file.path.parent / file.content.model
    if not path.is_file():
        raise InputError(str(file.fault(("model",), f"model: {path} is no file")))
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise InputError(f"{path}: MuJoCo refuses it: {error}") from None


def _replayed(
    given: RigInput,
    stamps: NDArray[np.float64],
    values: NDArray[np.float64],
    at: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return an input at other times, (n,); beyond its ends it stays as it was."""
    at = np.clip(at, stamps[0], stamps[-1])
    if given.between == "curve":
        return np.asarray(scipy.interpolate.CubicSpline(stamps, values)(at))
    if given.between == "held":
        return values[np.searchsorted(stamps, at, side="right") - 1]
    return np.interp(at, stamps, values)


def _parameter(name: str, stated: float, tolerance: float, unit: str) -> Unknown:
    if name.endswith("_springref"):
        low, high = stated - FURTHEST * tolerance, stated + FURTHEST * tolerance
        return Unknown(name, unit, stated, tolerance, low, high, _STEP * tolerance)
    high = _MOST_SHARE * max(stated, tolerance)
    return Unknown(
        name, unit, stated, tolerance, _LEAST_SHARE * stated, high,
        _STEP * (stated or tolerance),
    )  # fmt: skip


def _free(name: str, unit: str, stated: float, size: float) -> Unknown:
    reach, tolerance = _START_REACH * size, _START_TOLERANCE * size
    return Unknown(name, unit, stated, tolerance, stated - reach, stated + reach, _STEP * size)


def _channel_of(content: RigFile, joint: str) -> int:
    """Return the column of the channel that measures where a joint stands."""
    return next(
        column
        for column, channel in enumerate(content.channels.values())
        if channel.joint == joint and channel.quantity == "position"
    )


def _first_place(seen: Observed, column: int, start: str) -> tuple[float, float]:
    """Return where a joint stood when its run began, and how fast it was."""
    if start == "held":
        sample = float(np.mean(np.diff(seen.times)))
        rest = seen.rest[-round(_REST_S / sample) :, column]
        rest = rest[np.isfinite(rest)]
        if len(rest):
            return float(np.median(rest)), 0.0
    known = np.flatnonzero(seen.valid[:, column])[:_FIRST]
    if start == "held":
        return float(seen.values[known[0], column]), 0.0
    speed, place = np.polyfit(seen.times[known], seen.values[known, column], 2)[1:]
    return float(place), float(speed)
