"""How far the runs of a mechanism are from what its model predicts."""

from __future__ import annotations

import copy
from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.diagnose import Errors
from workbench.fit import Estimator, MjcfSystem, ParameterVector, minimised, units_of
from workbench.timeseries import TimeSeries

__all__ = ["errors_in", "unit_of_errors"]

_GROWN = 30.0  # times that a small error of place has grown
_STEP = 1e-6  # of a difference [rad], [m], and per second


def errors_in(
    system: MjcfSystem, plain: MjcfSystem, values: Mapping[str, float], threads: int = 0
) -> Errors:
    """Return the errors of free simulations, from the starts and time zeros that fit each run best.

    A run is compared as long as its motion can be foreseen: a double pendulum doubles the smallest
    error several times a second, so that beyond that the best model is as far off as any.

    Args:
        system: the runs.
        plain: the same with the model of the MJCF file alone, which says how far each can be
            foreseen: base and extension are compared over the same time.
        values: of parameters by name, where they are not nominal.
        threads: 0 takes all cores.
    """
    vector = ParameterVector(system.parameters)
    x, own = vector.named(values), vector.own
    masks = [np.zeros(system.seen(k).shape, dtype=np.bool_) for k in range(len(system.names))]
    for mask, count in zip(masks, _foreseen(plain, threads), strict=True):
        mask[count:] = True
    free = Estimator.of(system, vector, system.strong, threads, masks).uncorrected()
    if own.any():
        x = minimised(free, x, own).x
    unit, scale, chosen = unit_of_errors(system)
    found = free.innovations(x)
    over_time = {
        name: TimeSeries.of(
            system.times(k), {system.channels[c].name: scale * one.error[:, c] for c in chosen}
        )
        for k, (name, one) in enumerate(zip(system.names, found, strict=True))
    }
    floor = scale * float(np.sqrt(np.mean(system.sigma(0)[chosen] ** 2)))
    return Errors(over_time, dict.fromkeys(system.names, floor), unit)


def _foreseen(plain: MjcfSystem, threads: int) -> list[int]:
    """Return how many samples of each run can be foreseen.

    Along the states that a strongly corrected observer has, the engine's own linearisation of a
    step is multiplied up; where that of places by places comes to `_GROWN`, foresight ends.
    """
    vector = ParameterVector(plain.parameters)
    followed = Estimator.of(plain, vector, plain.strong, threads=threads)
    counts = []
    for k, one in enumerate(followed.innovations(np.zeros(len(vector)), keep=True)):
        start = followed.job(k, np.zeros(len(vector)))
        model = copy.copy(start.model)
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST  # RK4 has no derivative
        data, width = mujoco.MjData(model), 2 * model.nv + model.na
        step, grown, count = np.empty((width, width)), np.eye(width), 0
        while count < one.sane and float(np.abs(grown[: model.nv, : model.nv]).max()) < _GROWN:
            data.qpos[:], data.qvel[:] = one.qpos[count], one.qvel[count]
            data.ctrl[:] = start.control[count]
            mujoco.mj_forward(model, data)
            mujoco.mjd_transitionFD(model, data, _STEP, True, step, None, None, None)
            grown = np.linalg.matrix_power(step, start.steps) @ grown
            count += 1
        counts.append(count)
    return counts


def unit_of_errors(system: MjcfSystem) -> tuple[str, float, NDArray[np.int64]]:
    """Return the unit that errors are reported in, it over SI, and the channels that have it, (c,).

    Lengths count where there are some, else angles, else what the first channel measures: a mean
    over numbers of several units would be that of the greatest number.
    """
    channels = system.channels
    units = [
        "m"
        if one.of in ("site", "body")
        else units_of(system.model, channels, system.inputs, "channel", one.name)["L"]
        for one in channels
    ]
    unit = next((one for one in ("m", "rad") if one in units), units[0])
    chosen = np.array([c for c, one in enumerate(units) if one == unit], dtype=np.int64)
    return ("mm", 1000.0, chosen) if unit == "m" else (unit, 1.0, chosen)
