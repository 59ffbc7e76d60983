"""The least-squares problem of a fit: what is unknown, what a run should have shown, how they part.

Unknown are the model's parameters, in logarithms so that a step is a share, and for each run what
nobody wrote down: when exactly it began, how the motor lagged, how strong the pull was, where the
markers sat. These carry priors and are fitted along, so that the intervals of the parameters know
of them. Everything is scaled to one: residuals by the noise, unknowns of a run by their prior.

One evaluation simulates every run once. The Jacobian simulates every run once more for each
parameter, and single runs for what only they know, all in one batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.measured import MeasuredRun
from workbench.identify.drive import lagged_command
from workbench.sim import Condition, Robot, Simulation, sample_times, simulate_all

__all__ = ["LEAD_S", "Problem", "Rows", "Unknown", "needs_no_simulation"]

LEAD_S = 0.1  # the simulation begins this long before the run, so that a delay may be negative
_DELAY_S = 0.01
_LAG_S, _LAG_SHARE = 0.05, 1.0
_GAIN_SHARE = 0.05
_PULL_SHARE = 0.03
_HEIGHT_M = 1e-3  # how well a hand holds a foot above the floor
_PLACE_M = 2e-3  # how well a technician places a marker, and the shape file the strip
_RUN_PLACE_M = 2e-4  # how well the origin is found again in each run
_ANGLE_RAD = 5e-3
_REST_M = 1e-4
_WANTED_CHANGE = 0.03  # of the noise: what a finite difference moves the residuals by; with 0.3
# the derivatives of a robot near its resonance were so far off that d ended 0.3 % elsewhere
_STEP, _LEAST_STEP, _MOST_STEP = 1e-3, 1e-6, 2e-2
_MOST_STEPS = 136  # a sample
_HARDLY = 0.06  # of the noise; estimates differ from those with 0.03 by 5 % of their deviation
_STEEP = 8.0  # a share of e^8 either way is no parameter any more


class Unknown(NamedTuple):
    """One unknown of the fit: a parameter (run -1), or what one run keeps to itself."""

    name: str
    run: int


class Rows(NamedTuple):
    """Where each residual comes from: its run, -1 for a prior, and its time [s]."""

    run: NDArray[np.int64]
    time: NDArray[np.float64]


class _Known(NamedTuple):
    """What the runs show at one place, and in how many steps a sample it was simulated."""

    x: NDArray[np.float64]
    curves: list[scipy.interpolate.CubicSpline]
    steps: int


@dataclass(frozen=True, eq=False)
class _Seen:
    """One run's compared samples."""

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    valid: NDArray[np.bool_]
    sigma: NDArray[np.float64]
    rest: NDArray[np.float64]


class Problem:
    """What a fit minimises.

    Args:
        runs: all of them fitted together.
        robot: everything that is not fitted stays as it is here.
        names: of the parameters to be fitted.
        window: how much of each run is compared, from its time zero [s].
        threads: of the simulation; 0 takes all cores.
    """

    def __init__(
        self,
        runs: Sequence[MeasuredRun],
        robot: Robot,
        names: Sequence[str],
        window: float = np.inf,
        threads: int = 0,
    ) -> None:
        self.runs, self.robot, self.names = tuple(runs), robot, tuple(names)
        self.window, self.threads = window, threads
        self.seen = [_seen(run, window) for run in runs]
        places = list(dict.fromkeys(place for run in runs for place in run.places))
        self.unknowns = [Unknown(name, -1) for name in names]
        self.unknowns += [Unknown(f"place {place}", -1) for place in places]
        for k, run in enumerate(runs):
            self.unknowns += [Unknown(name, k) for name in _own(run)]
        self.index = {unknown: i for i, unknown in enumerate(self.unknowns)}
        self.steps = np.full(len(self.unknowns), _STEP)
        self._known: _Known | None = None
        self._slopes: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    @property
    def start(self) -> NDArray[np.float64]:
        """Return the unknowns where everything is as stated, (u,)."""
        return np.zeros(len(self.unknowns))

    @property
    def rows(self) -> Rows:
        """Return where each residual comes from."""
        run = [np.full(len(s.rest) + s.values.size, k) for k, s in enumerate(self.seen)]
        time = [np.concatenate([np.zeros(len(s.rest)), np.repeat(s.times, s.values.shape[1])])
                for s in self.seen]  # fmt: skip
        priors = len(self.unknowns) - len(self.names)
        return Rows(np.concatenate([*run, np.full(priors, -1)]),
                    np.concatenate([*time, np.zeros(priors)]))  # fmt: skip

    def values(self, x: NDArray[np.float64]) -> dict[str, float]:
        """Return the parameters of unknowns (u,)."""
        share = np.exp(np.clip(x[: len(self.names)], -_STEEP, _STEEP))
        stated = self.robot.values
        return {name: stated[name] * float(s) for name, s in zip(self.names, share, strict=True)}

    def residuals(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return measured less simulated over the noise, then the priors, (m,)."""
        parts = [self._run_residual(k, x, c) for k, c in enumerate(self._responses(x).curves)]
        return np.concatenate([*parts, x[len(self.names) :]])

    def residuals_of(self, places: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return the residuals of many unknowns at once, (places, m), in one batch."""
        asked = [(k, x) for x in places for k in range(len(self.runs))]
        curves = iter(self._simulated(asked, self.robot.steps_per_sample)[0])
        return np.array([
            np.concatenate([*(self._run_residual(k, x, next(curves))
                              for k in range(len(self.runs))), x[len(self.names) :]])
            for x in places
        ])  # fmt: skip

    def jacobian(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the derivatives of the residuals by the unknowns, (m, u).

        They are those of a place nearby where the residuals have hardly moved since: the last steps
        of a fit are far smaller than what the derivatives change over.
        """
        if self._slopes is not None and self._hardly_moved(x):
            return self._slopes[1]
        base, moves = self._responses(x), self._moves(x)
        curves, steps = self._simulated([(k, moved) for _, k, moved in moves], base.steps)
        if steps != base.steps:  # a difference of two step sizes is no derivative
            base = self._at(x, steps)
        at = [self._run_residual(k, x, c) for k, c in enumerate(base.curves)]
        length = [len(part) for part in at]
        begin = np.concatenate([[0], np.cumsum(length)])
        jacobian = np.zeros((begin[-1] + len(x) - len(self.names), len(x)))
        for (i, k, moved), curve in zip(moves, curves, strict=True):
            change = self._run_residual(k, moved, curve) - at[k]
            jacobian[begin[k] : begin[k + 1], i] = change / (moved[i] - x[i])
        self._adapt_steps(jacobian[: begin[-1]])
        for i, unknown in enumerate(self.unknowns):
            if needs_no_simulation(unknown):
                for k in range(len(at)) if unknown.run < 0 else [unknown.run]:
                    moved = x.copy()
                    moved[i] += 1e-3
                    change = self._run_residual(k, moved, base.curves[k]) - at[k]
                    jacobian[begin[k] : begin[k + 1], i] = change / 1e-3
        count = len(self.names)
        jacobian[begin[-1] :, count:] = np.eye(len(x) - count)
        self._slopes = (x.copy(), jacobian)
        return jacobian

    def _hardly_moved(self, x: NDArray[np.float64]) -> bool:
        assert self._slopes is not None
        place, slopes = self._slopes
        moved = slopes[: len(slopes) - len(x) + len(self.names)] @ (x - place)
        return bool(np.sqrt(np.mean(moved**2)) < _HARDLY)

    def _moves(self, x: NDArray[np.float64]) -> list[tuple[int, int, NDArray[np.float64]]]:
        """Return (unknown, run, moved unknowns) of every simulation that a Jacobian needs."""
        moves = []
        for i, unknown in enumerate(self.unknowns):
            if needs_no_simulation(unknown):
                continue
            moved = x.copy()
            moved[i] += self.steps[i]
            moves += [(i, k, moved) for k in range(len(self.runs)) if unknown.run in (-1, k)]
        return moves

    def _adapt_steps(self, jacobian: NDArray[np.float64]) -> None:
        size = np.sqrt(np.mean(jacobian**2, axis=0))
        moved = np.flatnonzero(size > 0)
        wanted = _WANTED_CHANGE / size[moved]
        self.steps[moved] = np.clip(wanted, _LEAST_STEP, _MOST_STEP)

    def _responses(self, x: NDArray[np.float64]) -> _Known:
        if self._known is None or not np.array_equal(self._known.x, x):
            self._known = self._at(x, self.robot.steps_per_sample)
        return self._known

    def _at(self, x: NDArray[np.float64], steps: int) -> _Known:
        asked = [(k, x) for k in range(len(self.runs))]
        return _Known(x.copy(), *self._simulated(asked, steps))

    def _simulated(
        self, asked: list[tuple[int, NDArray[np.float64]]], steps: int
    ) -> tuple[list[scipy.interpolate.CubicSpline], int]:
        """Return the response of run k with unknowns x, for each pair asked, and the steps."""
        results, steps = self._results(asked, steps)
        curves = []
        for (k, _), result in zip(asked, results, strict=True):
            motion = result.motion
            values = motion.select(self.runs[k].channels).values
            if len(motion) < 2:
                values, times = np.repeat(values, 2, axis=0), np.array([0.0, 1.0])
            else:
                times = motion.times
            curves.append(scipy.interpolate.CubicSpline(times, values))
        return curves, steps

    def _results(
        self, asked: list[tuple[int, NDArray[np.float64]]], steps: int
    ) -> tuple[list[Simulation], int]:
        """Simulate in so many steps a sample, or in more where a trial is too stiff for them.

        Raises:
            InputError: when even the most do not help, or the robot does not stand.
        """
        while True:
            jobs = [
                (replace(self._robot(x), steps_per_sample=steps), self.condition(k, x))
                for k, x in asked
            ]
            try:
                return simulate_all(jobs, self.threads), steps
            except InputError:
                steps *= 2
                if steps > _MOST_STEPS:
                    raise

    def _robot(self, x: NDArray[np.float64]) -> Robot:
        return replace(self.robot, values=dict(self.robot.values) | self.values(x))

    def condition(self, k: int, x: NDArray[np.float64]) -> Condition:
        """Return what run k was put through by unknowns (u,); a driven one begins `LEAD_S` early.

        It lasts as long as the run is compared.
        """
        run, seen = self.runs[k], self.seen[k]
        times = sample_times(float(seen.times[-1]) + 2 * LEAD_S) - LEAD_S
        if not run.driven:
            still = np.zeros(len(times))
            pull = run.pull * np.exp(_PULL_SHARE * self._own(x, "pull", k))
            height = max(run.height + _HEIGHT_M * self._own(x, "height", k), 0.0)
            return Condition(run.mode, still, run.start_angle, pull=pull, height=height)
        start = run.start_angle + _ANGLE_RAD * self._own(x, "start angle", k)
        lag = _LAG_S * np.exp(_LAG_SHARE * self._own(x, "lag", k))
        gain = 1 + _GAIN_SHARE * self._own(x, "gain", k)
        return Condition(run.mode, lagged_command(times, run.steps, lag, gain), start)

    def _own(self, x: NDArray[np.float64], name: str, k: int) -> float:
        i = self.index.get(Unknown(name, k))
        return 0.0 if i is None else float(x[i])

    def _run_residual(
        self, k: int, x: NDArray[np.float64], curve: scipy.interpolate.CubicSpline
    ) -> NDArray[np.float64]:
        run, seen = self.runs[k], self.seen[k]
        delay = _DELAY_S * self._own(x, "delay", k)
        lead = LEAD_S if run.driven else 0.0  # what is let go begins with the simulation
        should = curve(np.clip(seen.times - delay + lead, 0.0, curve.x[-1]))
        count = len(run.places)
        offset = np.array([
            _PLACE_M * x[self.index[Unknown(f"place {place}", -1)]]
            + _RUN_PLACE_M * self._own(x, f"place {axis}", k)
            for axis, place in enumerate(run.places)
        ])  # fmt: skip
        should[:, :count] += offset
        parted = np.where(seen.valid, (seen.values - should) / seen.sigma, 0.0)
        rest = (seen.rest - curve(0.0)[:count] - offset) / _REST_M
        return np.concatenate([np.nan_to_num(rest), parted.ravel()])


def needs_no_simulation(unknown: Unknown) -> bool:
    """Tell whether an unknown only moves what was simulated, in time or place."""
    return unknown.name == "delay" or unknown.name.startswith("place ")


def _own(run: MeasuredRun) -> list[str]:
    """Return what a run keeps to itself."""
    places = [f"place {axis}" for axis in range(len(run.places))]
    if run.driven:
        return ["delay", "lag", "gain", "start angle", *places]
    return ["delay", "pull" if run.mode == "decay" else "height", *places]


def _seen(run: MeasuredRun, window: float) -> _Seen:
    part = run.during(window)
    valid = part.valid & np.isfinite(part.values)
    return _Seen(part.times, part.values, valid, run.noise(), run.at_rest())
