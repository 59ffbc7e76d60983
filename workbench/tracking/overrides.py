"""Overrides of a take by a sheet: unit, rate, exchanged bodies, limits of error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean
from workbench.tracking.exchanges import Exchange, exchanged_back
from workbench.tracking.length_unit import UNITS, in_unit, unit_name
from workbench.tracking.take import BodyTake, SampleStatus, Take

__all__ = ["Overrides", "with_overrides"]


@dataclass(frozen=True)
class Overrides:
    """Properties of a take that its file does not have, or has wrong.

    Args:
        unit: of length: m, cm, mm or in; None where the file's counts.
        rate_hz: of the samples; None where the file's counts.
        exchanged: bodies that the file has the wrong way round.
        limits: by body, the greatest error with which a sample counts [m].
    """

    unit: str | None = None
    rate_hz: float | None = None
    exchanged: tuple[Exchange, ...] = ()
    limits: Mapping[str, float] = field(default_factory=dict)


def with_overrides(take: Take, stated: Overrides) -> Take:
    """Return a take with overrides; a warning repeats what the file says otherwise.

    Raises:
        InputError: a unit, body or range of frames that is stated is not there.
    """
    if stated.unit is not None:
        take = _with_unit(take, stated.unit)
    if stated.rate_hz is not None:
        take = _with_rate(take, stated.rate_hz)
    if stated.exchanged:
        take = exchanged_back(take, stated.exchanged)
    for name, limit in stated.limits.items():
        take = _within(take, name, limit)
    return take


def _with_unit(take: Take, unit: str) -> Take:
    if unit not in UNITS:
        raise InputError(f"unit of length {unit!r} is unknown; there are {', '.join(UNITS)}")
    metres = UNITS[unit]
    if metres == take.unit_m:
        return replace(take, unit_stated=True)
    text = f"lengths are read in {unit}, as stated; the file was read in {unit_name(take.unit_m)}"
    read = in_unit(take, metres)
    return replace(read, unit_stated=True, warnings=(*take.warnings, text))


def _with_rate(take: Take, rate: float) -> Take:
    if abs(rate - take.rate_hz) <= 1e-9 * rate:
        return take
    start = take.times[0] if take.format == "row" else take.indices[0] / rate
    times = start + (take.indices - take.indices[0]) / rate
    text = (
        f"the rate is {rate:g} Hz, as stated; the file says {take.rate_hz:g} Hz. Times are frame "
        "index / rate"
    )
    return replace(take, rate_hz=rate, times=times, warnings=(*take.warnings, text))


def _within(take: Take, name: str, limit: float) -> Take:
    """Return a take in which samples of a body with a greater error do not count as seen."""
    if name not in take.bodies:
        raise InputError(
            f"{take.path}: limits: {name!r} is not in the take; there are "
            f"{', '.join(map(repr, take.bodies))}{did_you_mean(name, take.bodies)}"
        )
    body = take.bodies[name]
    error = _error(body)
    if error is None:
        text = f"the file gives no error of {name!r}; its limit of {1e3 * limit:g} mm does nothing"
        return replace(take, warnings=(*take.warnings, text))
    poor = body.seen & (error > limit)
    if not poor.any():
        return take
    text = (
        f"{name!r}: {np.count_nonzero(poor)} samples have an error above {1e3 * limit:g} mm, first "
        f"at frame {take.indices[np.argmax(poor)]}; they do not count as seen"
    )
    bodies = {**take.bodies, name: body.without(poor, SampleStatus.POOR)}
    return replace(take, bodies=bodies, warnings=(*take.warnings, text))


def _error(body: BodyTake) -> NDArray[np.float64] | None:
    """Return the error of each sample (n,) [m]: as the file reports it, else of solved markers."""
    if body.reported_error is not None and np.isfinite(body.reported_error).any():
        return body.reported_error
    return body.fit_error if np.isfinite(body.fit_error).any() else None
