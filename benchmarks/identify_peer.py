"""The peer: mujoco.sysid, given what it needs and more than our own fit is given.

It takes an initial state for each run, not a rest that depends on the parameters; here each
candidate starts where its own weight lets it rest. It gets the true lag of the motor, the true
starts and the true pulls. Its optimiser is its own, with the scaling that it recommends. It is run
twice: as documented, and led by hand, with windows that grow and with residuals of the hopping
plane over the noise, its two defaults put right that cost it most: it divides each coordinate by
its size, so that y, which is noise alone, outweighs all others and widens every interval; and it
stamps what its sensors saw before a step with the time after it. Those 0.245 ms alone shift the
damping of robot 0 by 14 % at a misfit of 1.03.
"""

from __future__ import annotations

import io
import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from identify_methods import BOUND, Row, true_condition
from identify_truth import NAMES, NOISE_M, Take, robot_with, thesis_files
from mujoco import sysid
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult

from workbench.errors import InputError
from workbench.sim import Robot, build_spec, make_robot, settle

__all__ = ["installed", "peer"]

ALPHA = 0.10  # for intervals of 90 %
PLANE = [0, 2, 3, 5]  # x and z of T, x and z of the rotor
ResidualFn = Callable[..., Any]


def installed() -> bool:
    """Tell whether mujoco.sysid found all packages that it needs."""
    return hasattr(sysid, "optimize")


def peer(takes: Sequence[Take], windows_s: Sequence[float], by_hand: bool) -> Row:
    """Fit with mujoco.sysid, window after window, each from where the last one ended.

    Args:
        takes: all of them.
        windows_s: how much of each run is compared, in order [s].
        by_hand: whether residuals are those of the hopping plane over the noise.
    """
    model, shape = thesis_files()
    base = make_robot(model.values(), shape)
    parameters = _parameters(model.values())
    runs = [_Run(base, take, by_hand) for take in takes]
    with _listening() as (logged, printed):
        begin = time.perf_counter()
        for window in windows_s[:-1]:
            parameters, _, _ = _fitted(runs, parameters, window)
        parameters, result, residuals = _fitted(runs, parameters, windows_s[-1])
        _, half = sysid.calculate_intervals(residuals, result.jac, alpha=ALPHA)
        seconds = time.perf_counter() - begin
    value = dict(zip(NAMES, map(float, result.x), strict=True))
    return Row(
        method="mujoco.sysid, " + ("led by hand" if by_hand else "as documented"),
        value=value,
        interval90={
            name: (value[name] - float(h), value[name] + float(h))
            for name, h in zip(NAMES, half, strict=True)
        },
        seconds=seconds,
        simulations=sum(run.simulations for run in runs),
        reports="no unit, no misfit in noise, nothing on what is open; "
        f"{len(logged.lines)} warnings",
        words=(
            *logged.lines,
            *(line for line in printed.getvalue().splitlines() if line.startswith("Terminated")),
            *(
                f"{name} {v:.5g} +- {h:.2g}"
                for (name, v), h in zip(value.items(), half, strict=True)
            ),
            *_insights(parameters),
        ),
    )


@dataclass
class _Run:
    """One take as the peer wants it, and how often it was simulated."""

    base: Robot
    take: Take
    by_hand: bool
    simulations: int = 0

    def residual_fn(self, window: float) -> ResidualFn:
        """Return the peer's own residual function over the first seconds of the run."""
        spec = _observed(self.base)
        model = spec.compile()
        steps = self.base.steps_per_sample
        command = np.repeat(true_condition(self.take).command, steps)
        count = min(len(command), round(window / model.opt.timestep) + 1)
        times = np.arange(count) * model.opt.timestep
        control = sysid.TimeSeries(times, np.repeat(command[:count, None], model.nu, axis=1))
        true = self.take.times + self.take.late
        seen = (true > 0) & (true < times[-1])
        places = np.hstack([self.take.top, self.take.rotor])[seen]
        measured = sysid.TimeSeries.from_names(true[seen], places, model)
        group = sysid.ModelSequences(
            "hopper", spec, self.take.name, self._at_rest(model, self.base), control, measured
        )
        return sysid.build_residual_fn(
            models_sequences=[group],
            custom_rollout=self._rollout,
            modify_residual=_in_the_plane if self.by_hand else None,
        )

    def _rollout(
        self,
        *,
        models: Sequence[mujoco.MjModel],
        initial_states: Sequence[NDArray[np.float64]],
        param_dicts: Sequence[sysid.ParameterDict],
        **others: object,
    ) -> Sequence[sysid.SystemTrajectory]:
        """Start each candidate at its own rest, then roll out as the peer does."""
        self.simulations += len(models)
        starts = []
        for model, given, parameters in zip(models, initial_states, param_dicts, strict=True):
            named = dict(zip(NAMES, map(float, parameters.as_vector()), strict=True))
            try:
                starts.append(self._at_rest(model, robot_with(self.base, named)))
            except InputError:  # it does not stand: the stated robot's rest
                starts.append(given)
        return sysid.sysid_rollout(models=models, initial_states=starts, **others)

    def _at_rest(self, model: mujoco.MjModel, robot: Robot) -> NDArray[np.float64]:
        _, data = settle(robot, "fixed", np.pi / 2, (self.take.true_pull, 0.0))
        return sysid.create_initial_state(model, data.qpos, data.qvel, data.act)


@contextmanager
def _listening() -> Iterator[tuple[_Logged, io.StringIO]]:
    """Keep what the peer warns of and prints."""
    logged, printed, log = _Logged(), io.StringIO(), logging.getLogger("absl")
    log.addHandler(logged)
    try:
        with redirect_stdout(printed):
            yield logged, printed
    finally:
        log.removeHandler(logged)


class _Logged(logging.Handler):
    """Keeps the peer's warnings."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


def _fitted(
    runs: Sequence[_Run], parameters: sysid.ParameterDict, window: float
) -> tuple[sysid.ParameterDict, OptimizeResult, list[NDArray[np.float64]]]:
    """Return the peer's parameters, its result and its residuals there."""
    residual_fn = _joined([run.residual_fn(window) for run in runs])
    parameters, result = sysid.optimize(
        parameters,
        residual_fn,
        optimizer="mujoco",
        verbose=False,
        x_scale="jac",
        check_conditioning=True,
    )
    return parameters, result, residual_fn(result.x, parameters)[0]


def _in_the_plane(
    _parameters: sysid.ParameterDict,
    predicted: sysid.TimeSeries,
    measured: sysid.TimeSeries,
    *_others: object,
    **_named: object,
) -> tuple[NDArray[np.float64], sysid.TimeSeries, sysid.TimeSeries]:
    """Return measured less predicted over the noise, x and z of T and of the rotor."""
    times = predicted.times - (predicted.times[1] - predicted.times[0])
    series = sysid.TimeSeries(times, predicted.data, predicted.signal_mapping)
    inside = sysid.signal_modifier.apply_delayed_ts_window(measured, series, 0.0, 0.0)
    should = series.resample(inside.times)
    # the peer wants the very same mapping, not an equal one
    named = sysid.TimeSeries(should.times, should.data, inside.signal_mapping)
    return (inside.data - should.data)[:, PLANE] / NOISE_M, named, inside


def _observed(robot: Robot) -> mujoco.MjSpec:
    """Return the clamped robot with sensors for the places of T and the rotor."""
    spec = build_spec(robot, "fixed")
    place = mujoco.mjtSensor.mjSENS_FRAMEPOS
    body, site = mujoco.mjtObj.mjOBJ_XBODY, mujoco.mjtObj.mjOBJ_SITE
    spec.add_sensor(name="top", type=place, objtype=body, objname="top")
    spec.add_sensor(name="rotor", type=place, objtype=site, objname="rotor")
    return spec


def _parameters(stated: dict[str, float]) -> sysid.ParameterDict:
    """Return the four parameters; one value for all hinges but the root."""
    parameters = sysid.ParameterDict()
    for name in NAMES:
        part, quantity = name.split("_")
        parameters.add(
            sysid.Parameter(
                name,
                stated[name],
                stated[name] / BOUND,
                stated[name] * BOUND,
                modifier=lambda spec, own, part=part, quantity=quantity: _set(
                    spec, part, quantity, float(own.value[0])
                ),
            )
        )
    return parameters


def _set(spec: mujoco.MjSpec, part: str, quantity: str, value: float) -> None:
    for joint in spec.joints:
        if joint.name.startswith("hinge_") and (joint.name == "hinge_0") == (part == "root"):
            setattr(joint, quantity, [value, 0, 0])


def _joined(parts: Sequence[ResidualFn]) -> ResidualFn:
    """Return one residual function of all runs."""

    def residual_fn(x: NDArray[np.float64], parameters: Any, **others: Any) -> tuple[Any, Any, Any]:
        residuals, predicted, measured = [], [], []
        for part in parts:
            found = part(x, parameters, **others)
            residuals += found[0]
            predicted += found[1]
            measured += found[2]
        return residuals, predicted, measured

    return residual_fn


def _insights(parameters: sysid.ParameterDict) -> list[str]:
    """Return what the peer's report says by itself about a result."""
    from mujoco.sysid.report.sections.insights import AutomatedInsights

    insights = AutomatedInsights("insights", parameters).get_context()["insights"]
    return [f"{one['title']}: {one['message']}" for one in insights]
