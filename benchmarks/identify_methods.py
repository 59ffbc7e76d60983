"""The methods that are compared: ours, a plain least-squares fit, and the thesis' criterion."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from identify_repeats import as_measured
from identify_truth import NAMES, NOISE_M, Take, driven_by, robot_with, thesis_files
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.stats import norm
from thesis_objective import (
    FMINCON_HIGH,
    FMINCON_LOW,
    FMINCON_ORDER,
    FMINCON_START,
    fmincon_criterion,
    fmincon_fit,
)

from workbench.errors import InputError
from workbench.identify import identify
from workbench.motion import TOP, position
from workbench.sim import Condition, Robot, make_robot, sample_times, simulate_all

__all__ = ["BOUND", "NOT_INSTALLED", "Row", "ours", "plain", "thesis"]

BOUND = 3.0  # every method stays within a third and three times the stated values
NOT_INSTALLED = "not installed: pip install hopping-workbench[sysid]"
Z90 = float(norm.ppf(0.95))
_STEP = 1e-4  # of the logarithm of a parameter, for the plain fit's differences
_OF_THE_NOISE = 1e3  # residual where a robot cannot be simulated


@dataclass(frozen=True)
class Row:
    """What one method came to.

    Args:
        method: its name.
        value: of each parameter, SI; empty when it did not run.
        interval90: of the same, empty when it gives none.
        seconds: on the clock.
        simulations: of one run each.
        reports: in one line, what its user learns beside the numbers.
        words: what it printed or warned of.
    """

    method: str
    value: Mapping[str, float]
    interval90: Mapping[str, tuple[float, float]]
    seconds: float
    simulations: int
    reports: str
    words: tuple[str, ...] = ()


def ours(takes: Sequence[Take]) -> Row:
    """Fit with workbench.identify: the robot is observed, its rotor turns as it was seen to."""
    runs = [as_measured(take) for take in takes]
    begin = time.perf_counter()
    found = identify(runs, *thesis_files(), NAMES)
    seconds = time.perf_counter() - begin
    estimates = found.estimates
    lines = [f"{n} {e.low:.5g} to {e.high:.5g} {e.unit}" for n, e in estimates.items()]
    return Row(
        method="workbench identify",
        value={name: one.value for name, one in estimates.items()},
        interval90={name: (one.low, one.high) for name, one in estimates.items()},
        seconds=seconds,
        simulations=found.fit.evaluations * len(takes),
        reports=f"units, misfit {found.misfit:.2f} of the noise, "
        f"{len(found.not_determined)} combinations open, {len(found.warnings)} warnings",
        words=(*lines, *found.warnings),
    )


def plain(takes: Sequence[Take]) -> Row:
    """Fit whole traces by least squares from the stated values; lag, starts and pulls are given."""
    model, shape = thesis_files()
    base, count = make_robot(model.values(), shape), 0
    stated = np.array([model.values()[name] for name in NAMES])

    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        nonlocal count
        count += len(takes)
        return missed(robot_with(base, dict(zip(NAMES, stated * np.exp(x), strict=True))), takes)

    def slopes(x: NDArray[np.float64]) -> NDArray[np.float64]:
        at = residual(x)
        moved = [residual(x + _STEP * one) for one in np.eye(len(x))]
        return np.column_stack([(one - at) / _STEP for one in moved])

    begin = time.perf_counter()
    found = least_squares(
        residual,
        np.zeros(len(NAMES)),
        jac=slopes,  # pyright: ignore[reportArgumentType]  # the stub omits functions
        bounds=(-np.log(BOUND), np.log(BOUND)),
    )
    seconds = time.perf_counter() - begin
    spread = float(2 * found.cost / (len(found.fun) - len(NAMES)))
    deviation = np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)) * spread)
    value = stated * np.exp(found.x)
    low, high = (
        stated * np.exp(found.x - Z90 * deviation),
        stated * np.exp(found.x + Z90 * deviation),
    )
    return Row(
        method="scipy least_squares, whole runs",
        value=dict(zip(NAMES, map(float, value), strict=True)),
        interval90={n: (float(a), float(b)) for n, a, b in zip(NAMES, low, high, strict=True)},
        seconds=seconds,
        simulations=count,
        reports=f"its status, {found.message.rstrip('.')}; misfit {np.sqrt(spread):.1f} "
        "of the noise if one asks",
    )


def thesis(iterations: int) -> Row:
    """Minimise Appendix D; it takes no data, so that its answer is the same for every robot.

    Args:
        iterations: at most so many.
    """
    model, shape = thesis_files()
    robot = make_robot(model.values(), shape)
    begin = time.perf_counter()
    found = fmincon_fit(robot, iterations=iterations)
    seconds = time.perf_counter() - begin
    return Row(
        method="thesis' criterion, Appendix D",
        value=found.values,
        interval90={},
        seconds=seconds,
        simulations=found.evaluations,
        reports="a number; it looks at no data",
        words=(
            f"from {_listed(FMINCON_START)} within {_listed(FMINCON_LOW)} and "
            f"{_listed(FMINCON_HIGH)} to {_listed([found.values[n] for n in FMINCON_ORDER])}",
            f"F {found.criterion_at_start:.2f} at its start, {found.criterion:.2f} at its end, "
            f"{fmincon_criterion(robot):.2f} at the thesis' own values of Appendix B",
            f"in the order {', '.join(FMINCON_ORDER)}; {found.message.lower()}",
        ),
    )


def missed(robot: Robot, takes: Sequence[Take]) -> NDArray[np.float64]:
    """Return what was seen of T less what a robot does, in noise deviations, x and z of all runs.

    The true lag, starts and pulls are given.
    """
    try:
        results = simulate_all([(robot, true_condition(take)) for take in takes])
    except InputError:  # it does not stand
        rows = sum(2 * int(np.count_nonzero(take.times > 0)) for take in takes)
        return np.full(rows, _OF_THE_NOISE)
    parts = []
    for take, result in zip(takes, results, strict=True):
        motion = result.motion
        curve = CubicSpline(motion.times, position(motion, TOP)[:, [0, 2]])
        true = take.times + take.late
        after = take.times > 0
        should = curve(np.clip(true[after], 0.0, motion.times[-1]))
        parts.append((take.top[after][:, [0, 2]] - should).ravel() / NOISE_M)
    return np.concatenate(parts)


def true_condition(take: Take) -> Condition:
    """Return what the robot of a take really went through."""
    seconds = float(round(take.times[-1] + take.late, 6))
    if take.steps:
        return Condition("clamped", driven_by(take.steps, seconds))
    return Condition("decay", np.zeros(len(sample_times(seconds))), pull=take.true_pull)


def _listed(numbers: Sequence[float]) -> str:
    return "[" + " ".join(f"{number:.3g}" for number in numbers) + "]"
