"""A measured motion beside the simulated one of the same run, for figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.fit import Fit, MeasuredRun
from workbench.motion import time_zero
from workbench.sim import Condition, Robot, linear_modes, sample_times, simulate, staircase
from workbench.timeseries import TimeSeries

__all__ = ["FrequencySurface", "Pair", "fitted_pairs", "frequency_surface", "label",
           "simulated_pair"]  # fmt: skip

_REST_S = 0.6
_AFTER_S = 0.2


class Pair(NamedTuple):
    """One run, measured and simulated.

    Args:
        run: its name.
        label: what was done, `17.0 rad/s`.
        measured: channels of `workbench.motion`.
        simulated: the same channels.
    """

    run: str
    label: str
    measured: TimeSeries
    simulated: TimeSeries


class FrequencySurface(NamedTuple):
    """The longitudinal frequency over both stiffnesses.

    Args:
        hinge: (n,) stiffnesses [N m/rad].
        root: (m,) stiffnesses [N m/rad].
        hz: (n, m) frequencies [Hz].
    """

    hinge: NDArray[np.float64]
    root: NDArray[np.float64]
    hz: NDArray[np.float64]


def label(run: MeasuredRun) -> str:
    """Return in few words what was done in a run."""
    if run.driven:
        speed = next((s for _, s in reversed(run.steps) if s), 0.0)
        return f"{speed:.1f} rad/s"
    if run.mode == "decay":
        return f"released from {run.pull:.2g} N"
    return f"dropped by {1000 * run.height:.3g} mm"


def fitted_pairs(fit: Fit, runs: Sequence[MeasuredRun]) -> list[Pair]:
    """Return each fitted run beside the free simulation with the values of the fit.

    Its start and its rotor's angle are those of the fit, so what is left is the model's. Where a
    sample was not seen, both sides are NaN.
    """
    system = fit.estimator.system
    free = fit.estimator.uncorrected().innovations(fit.x)
    pairs = []
    for k, (run, one) in enumerate(zip(runs, free, strict=True)):
        names, seen = tuple(system.channels_of(k)), system.seen(k)
        times = run.motion.times[-len(seen) :]
        pairs.append(Pair(run.name, label(run), *(
            TimeSeries(times, values, names, np.isfinite(values))
            for values in (seen, seen - one.error)
        )))  # fmt: skip
    return pairs


def simulated_pair(run: MeasuredRun, robot: Robot) -> Pair:
    """Return a run beside its simulation from rest as commanded; nothing is fitted to it.

    Args:
        run: in any mode.
        robot: with the parameters to be shown.
    """
    stop = float(run.motion.times[-1])
    times = sample_times(stop + _AFTER_S)
    speed = staircase(times, run.steps) if run.driven else np.zeros(len(times))
    condition = Condition(run.mode, speed, run.start_angle, _REST_S, run.pull, run.height)
    motion = simulate(robot, condition).motion
    zero = time_zero(run.mode, motion) or 0.0  # by the same estimator as the track's
    return Pair(run.name, label(run), run.motion, motion.shifted(-zero))


def frequency_surface(
    robot: Robot, hinge: Sequence[float], root: Sequence[float], rotor_angle: float | None = None
) -> FrequencySurface:
    """Return the longitudinal frequency of the clamped robot for pairs of stiffnesses.

    Of the two slowest modes the one in which T moves more upward is the longitudinal one.

    Args:
        robot: everything else stays as it is here.
        hinge: k of the beam [N m/rad].
        root: kT of the root [N m/rad].
        rotor_angle: where the gearbox holds the rotor, as in a ring-down [rad]; None takes it as a
            point mass at T.

    Raises:
        InputError: when the robot does not stand with one of the pairs.
    """
    hz = np.empty((len(hinge), len(root)))
    for i, k in enumerate(hinge):
        for j, at_root in enumerate(root):
            values = dict(robot.values) | {"hinge_stiffness": k, "root_stiffness": at_root}
            modes = linear_modes(replace(robot, values=values), rotor_angle=rotor_angle, count=2)
            hz[i, j] = max(modes, key=lambda mode: abs(mode.top_direction[1])).hz
    return FrequencySurface(np.asarray(hinge), np.asarray(root), hz)
