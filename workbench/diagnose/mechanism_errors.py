"""How far the runs of a mechanism are from what its model predicts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.validate import Errors
from workbench.fit import Estimator, MjcfSystem, ParameterVector, Scope, minimised, units_of
from workbench.timeseries import TimeSeries

__all__ = ["errors_in", "unit_of_errors"]


def errors_in(system: MjcfSystem, values: Mapping[str, float], threads: int = 0) -> Errors:
    """Return the errors of free simulations, from the starts and time zeros that fit each run best.

    Args:
        system: the runs.
        values: of parameters by name, where they are not nominal.
        threads: 0 takes all cores.
    """
    vector = ParameterVector(system.parameters)
    x = np.array([p.number(values.get(p.name, p.nominal)) for p in vector.parameters])
    own = np.array([p.scope is Scope.RUN for p in vector.parameters], dtype=np.bool_)
    free = Estimator.of(system, vector, system.strong, threads=threads).uncorrected()
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
