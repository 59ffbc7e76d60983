"""What speaks against one straight line: curvature, drift, the way the voltage came, sense, mode.

Each check adds one term to the line and asks whether chance alone makes it as large as it is. A
check is found only where it is also large enough to matter: with speeds known to a millirad per
second, chance is ruled out long before anyone could set the difference at the supply.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.identify.speed_line import LEAST_ERROR, SpeedLine, SpeedPoint, fitted

__all__ = ["LEVEL", "MATTERS", "Check", "check_line", "voltage_groups"]

LEVEL = 0.01  # of each check: one straight line in a hundred is called bent
MATTERS = 0.03  # [rad/s]; 7 mV at the supply, which sets 10 mV
SAME_VOLTAGE = 0.02  # [V]; what a supply reads back differs by its last digit
_INDEPENDENT = 0.2  # share of a term that the line itself does not explain already


@dataclass(frozen=True)
class Check:
    """One thing that may be wrong with the line.

    Args:
        size: of the term.
        unit: of the size.
        moves: most that it changes a speed [rad/s].
        p_value: how often chance alone makes it so large.
        found: whether it is there and matters.
        text: one sentence.
        untested: why the runs cannot show it, where they cannot; the numbers are then NaN.
    """

    size: float
    unit: str
    moves: float
    p_value: float
    found: bool
    text: str
    untested: str | None = None


_Term = NDArray[np.float64] | str
"""Values (n,) of a term, or why there is none."""


def check_line(line: SpeedLine) -> dict[str, Check]:
    """Return every check by name; one that the runs cannot make says why.

    Args:
        line: as fitted.
    """
    return {
        "curvature": _added(line, _bend(line), "%", 100 / line.span, _bend_text),
        "drift": _added(line, _drift(line), "rad/s/h", 1.0, _drift_text),
        "direction": _added(line, _direction(line), "rad/s", 1.0, _direction_text),
        "sense": _added(line, _sense(line), "rad/s", 1.0, _sense_text),
        "mode": _added(line, _mode(line), "rad/s", 1.0, _mode_text),
        "lack_of_fit": _lack_of_fit(line),
    }


def voltage_groups(voltages: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return for each voltage the number of its group, (n,), from 0; equal ones share a group.

    Args:
        voltages: (n,) [V].
    """
    order = np.argsort(voltages)
    group = np.concatenate([[0], np.cumsum(np.diff(voltages[order]) > SAME_VOLTAGE)])
    out = np.empty(len(voltages), dtype=np.intp)
    out[order] = group
    return out


def _added(
    line: SpeedLine, term: _Term, unit: str, factor: float, text: Callable[[float, float], str]
) -> Check:
    """Return the check that one more term is."""
    if isinstance(term, str):
        return _untested(unit, term)
    if len(line.points) < 4:
        return _untested(unit, "three runs leave nothing to test with")
    volts = line.voltages - line.middle
    terms = np.column_stack([volts, np.ones_like(volts), term])
    speeds = np.array([point.speed for point in line.points])
    fit = fitted(terms, speeds, np.array([point.standard_error for point in line.points]))
    coefficient, p_value = float(fit.coefficients[2]), fit.p_value(2)
    moves = abs(coefficient) * float(np.ptp(term))
    found = p_value < LEVEL and moves > MATTERS
    size = coefficient * factor
    return Check(size, unit, moves, p_value, found, text(size, moves))


def _untested(unit: str, why: str) -> Check:
    nan = float("nan")
    return Check(nan, unit, nan, nan, False, why, why)


def _bend(line: SpeedLine) -> _Term:
    """Return a parabola that is zero at both ends and one in the middle of the voltages."""
    low, high = line.voltages.min(), line.voltages.max()
    return 4 * (line.voltages - low) * (high - line.voltages) / (high - low) ** 2


def _drift(line: SpeedLine) -> _Term:
    hours = np.array([point.hours for point in line.points])
    if not np.isfinite(hours).all():
        return "it is not known when every run was measured"
    if np.ptp(hours) == 0:
        return "all runs were measured at one time"
    return _parted(line, hours - hours.mean(), "the time of day")


def _direction(line: SpeedLine) -> _Term:
    hours = np.array([point.hours for point in line.points])
    if not np.isfinite(hours).all():
        return "it is not known in which order the runs were measured"
    order = np.argsort(hours, kind="stable")
    groups = voltage_groups(line.voltages)
    way = np.zeros(len(hours))
    way[order[1:]] = np.sign(np.diff(groups[order])) / 2
    if way.min() == 0 or way.max() == 0:
        return "the voltage was only changed one way"
    return _parted(line, way, "the way the voltage came")


def _sense(line: SpeedLine) -> _Term:
    return _two(line, lambda point: point.sense > 0, "the rotor turned one way only")


def _mode(line: SpeedLine) -> _Term:
    return _two(line, lambda point: point.mode == "hop", "all runs have one mode")


def _two(line: SpeedLine, first: Callable[[SpeedPoint], bool], otherwise: str) -> _Term:
    term = np.array([0.5 if first(point) else -0.5 for point in line.points])
    return otherwise if np.ptp(term) == 0 else _parted(line, term, "the one kind of run")


def _parted(line: SpeedLine, term: NDArray[np.float64], what: str) -> _Term:
    """Return a term, or that the voltages themselves explain it."""
    volts = line.voltages - line.middle
    terms = np.column_stack([volts, np.ones_like(volts)])
    residual = term - terms @ np.linalg.lstsq(terms, term)[0]
    if np.linalg.norm(residual) < _INDEPENDENT * np.linalg.norm(term - term.mean()):
        return f"{what} goes with the voltage, so that the two cannot be distinguished"
    return term


def _lack_of_fit(line: SpeedLine) -> Check:
    """Return whether the runs lie farther from the line than repeats lie from one another."""
    groups = voltage_groups(line.voltages)
    repeated = len(groups) - groups.max() - 1
    if repeated == 0 or groups.max() < 2:
        return _untested("rad/s", "no voltage was repeated")
    speeds = np.array([point.speed for point in line.points])
    errors = np.array([point.standard_error for point in line.points])
    means = (groups[:, None] == np.arange(groups.max() + 1)).astype(float)
    apart = fitted(means, speeds, errors)
    weights = 1 / (np.maximum(errors, LEAST_ERROR) ** 2 + apart.scatter**2)
    volts = line.voltages - line.middle
    straight = np.column_stack([volts, np.ones_like(volts)])
    within = _weighted_square(means, speeds, weights)
    beyond = (_weighted_square(straight, speeds, weights) - within) / (groups.max() - 1)
    p_value = float(scipy.stats.f.sf(beyond / (within / repeated), groups.max() - 1, repeated))
    size = float(np.abs(apart.coefficients - line.at(_group_means(line, groups))).max())
    text = (
        f"the speeds lie up to {size:.3f} rad/s off the line, farther than repeats of a voltage "
        "lie from one another"
    )
    return Check(size, "rad/s", size, p_value, p_value < LEVEL and size > MATTERS, text)


def _group_means(line: SpeedLine, groups: NDArray[np.intp]) -> NDArray[np.float64]:
    return np.bincount(groups, line.voltages) / np.bincount(groups)


def _weighted_square(
    terms: NDArray[np.float64], y: NDArray[np.float64], weights: NDArray[np.float64]
) -> float:
    root = np.sqrt(weights)
    found = np.linalg.lstsq(root[:, None] * terms, root * y)[0]
    return float(np.sum(weights * (y - terms @ found) ** 2))


def _bend_text(size: float, moves: float) -> str:
    return (
        f"the line is bent: midway the speed lies {moves:.3f} rad/s, {abs(size):.1f} % of its span,"
        f" {'above' if size > 0 else 'below'} the chord; calibrate the range that is used"
    )


def _drift_text(size: float, moves: float) -> str:
    return (
        f"the speed drifts by {size:+.3f} rad/s an hour, {moves:.3f} rad/s over these runs; "
        "let the motor warm up, or calibrate again on the day"
    )


def _direction_text(size: float, moves: float) -> str:
    return (
        f"after a lower voltage the speed is {abs(size):.3f} rad/s "
        f"{'higher' if size > 0 else 'lower'} than after a higher one; rest longer between the runs"
    )


def _sense_text(size: float, moves: float) -> str:
    return (
        f"the rotor turns {abs(size):.3f} rad/s {'faster' if size > 0 else 'slower'} forwards than "
        "backwards; calibrate the two ways apart"
    )


def _mode_text(size: float, moves: float) -> str:
    return (
        f"the rotor turns {abs(size):.3f} rad/s {'faster' if size > 0 else 'slower'} when the robot"
        " hops than when it is clamped; calibrate the mode that is used"
    )
