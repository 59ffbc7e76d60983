"""Find the parameters: look around, then fit ever longer windows.

A lightly damped beam forgets nothing: after ten seconds one percent of stiffness has turned its
phase by a radian, and a fit that starts farther off falls into a wrong valley. So the first second
is compared at many places of the parameter space, the best of them is fitted, and the window grows
from fit to fit until it holds whole runs.

On the way two things are decided that a fit cannot mend: whether a beam of so few increments can
follow the runs at all, and whether the runs tell the parameters apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.measured import MeasuredRun
from workbench.identify.determinacy import Combination, undetermined
from workbench.identify.mesh import Meshed, best_mesh
from workbench.identify.problem import Problem
from workbench.identify.solution import ROBUST, Solution
from workbench.progress import Progress, Stage
from workbench.sim import Robot

__all__ = ["BOUND", "FINER", "Fit", "fit_runs"]

BOUND = 3.0  # a parameter stays within a third and three times its stated value
FINER = 32  # increments of the beam that is tried where the model's own cannot follow
_SHORT_S = (1.0, 2.5)
_LONG_S = (6.0,)
_SEARCHED = 0.4  # share either way that is looked at in the first second
_PLACES = 64
_EVALUATIONS = 40  # of a window, about: what the time left is told by
_POOR = 1.2  # times the noise, over the short window
_WON = 0.9  # of the misfit: what a finer beam must reach to be taken
_REACH = 8.0  # of a run's unknown, in deviations of its prior


@dataclass(frozen=True, eq=False)
class Fit:
    """What a fit came to.

    Args:
        solution: over whole runs, of the parameters that the runs tell apart.
        open: what they leave open, in the order in which it was found.
        evaluations: how often all runs were simulated for residuals.
        meshed: the solution with the mesh as one more unknown, where it was fitted as well.
    """

    solution: Solution
    open: tuple[Combination, ...]
    evaluations: int
    meshed: Solution | None = None


def fit_runs(
    runs: Sequence[MeasuredRun],
    robot: Robot,
    tolerances: Mapping[str, float],
    progress: Progress = lambda text: None,
    threads: int = 0,
) -> Fit:
    """Fit parameters to runs.

    Args:
        runs: fitted together.
        robot: the start; what is not named stays.
        tolerances: of each parameter to be fitted, as a share of its value.
        progress: is told each stage.
        threads: of the simulation; 0 takes all cores.

    Raises:
        InputError: when the runs tell none of the parameters.
    """
    return _Fitter(runs, tolerances, progress, threads).fit(robot)


class _Fitter:
    """One fit, stage by stage."""

    def __init__(
        self,
        runs: Sequence[MeasuredRun],
        tolerances: Mapping[str, float],
        progress: Progress,
        threads: int,
    ) -> None:
        self.runs, self.tolerances = runs, dict(tolerances)
        self.progress, self.threads = progress, threads
        self.open: list[Combination] = []
        self.evaluations = 0
        self.longest = max(float(run.motion.times[-1]) for run in runs)

    def fit(self, robot: Robot) -> Fit:
        first = self._problem(_coarse(robot), _SHORT_S[0])
        self.progress(Stage(f"look at {_PLACES} places, {_SHORT_S[0]:g} s of each run", 0.0))
        short = self._chosen(robot, self._look_around(first))
        chain = replace(robot, increments=short.problem.robot.increments)
        windows = (*(w for w in _LONG_S if w < self.longest), np.inf)
        problem, x = self._problem(chain, windows[0], short.problem), short.x
        if undetermined(Solution.at(problem, x), self.tolerances):  # by the rest of the runs too?
            problem, x = self._told_apart(self._problem(chain, np.inf, short.problem), x)
        meshed: Meshed | None = None
        for window in windows:
            if window != problem.window:
                problem = self._problem(problem.robot, window, problem)
            x = self._minimum(problem, x)
            if chain.increments != robot.increments:
                meshed = self._meshed(Solution.at(problem, x), meshed)
                problem, x = meshed.solution.problem, meshed.solution.x
        if meshed is None:
            return Fit(Solution.at(problem, x), tuple(self.open), self.evaluations)
        return Fit(meshed.solution, tuple(self.open), self.evaluations, meshed.with_mesh)

    def _meshed(self, solution: Solution, before: Meshed | None) -> Meshed:
        """Return a fit with the number of increments that the runs ask for."""
        count = solution.problem.robot.increments
        self.progress(f"look how many increments follow the runs best, from {count}")
        meshed = best_mesh(solution, None if before is None else before.path)
        self.evaluations += meshed.evaluations
        return meshed

    def _problem(self, robot: Robot, window: float, before: Problem | None = None) -> Problem:
        problem = Problem(self.runs, robot, list(self.tolerances), window, self.threads)
        if before is not None and len(before.steps) == len(problem.steps):
            problem.steps = before.steps.copy()
        return problem

    def _look_around(self, problem: Problem) -> NDArray[np.float64]:
        """Return the best of many places in the first second."""
        count = len(problem.names)
        cube = scipy.stats.qmc.Sobol(count, rng=0).random(_PLACES)
        places = np.vstack([np.zeros(count), np.log(1 + _SEARCHED * (2 * cube - 1))])
        best, lowest = problem.start, np.inf
        for place in places:
            x = problem.start
            x[:count] = place
            cost = float(np.sum(np.log1p(problem.residuals(x) ** 2)))
            if cost < lowest:
                best, lowest = x, cost
        self.evaluations += len(places)
        return best

    def _chosen(self, robot: Robot, x: NDArray[np.float64]) -> Solution:
        """Return the short fit, of a finer beam where the given one cannot follow the runs."""
        given = self._short(robot, x, _SHORT_S)
        if given.misfit < _POOR or robot.increments >= FINER:
            return given
        finer = self._short(replace(robot, increments=FINER), given.x, _SHORT_S[-1:])
        return finer if finer.misfit < _WON * given.misfit else given

    def _short(self, robot: Robot, x: NDArray[np.float64], windows: Sequence[float]) -> Solution:
        problem: Problem | None = None
        for window in windows:
            problem = self._problem(_coarse(robot), window, problem)
            x = self._minimum(problem, x)
        assert problem is not None
        return Solution.at(problem, x)

    def _minimum(self, problem: Problem, x: NDArray[np.float64]) -> NDArray[np.float64]:
        whole = problem.window >= self.longest
        words = "whole runs" if whole else f"the first {problem.window:g} s of each run"
        words = f"fit {words}, beam of {problem.robot.increments} increments"
        self.progress(Stage(words, self._share_before(problem.window)))
        reach = np.full(len(x), _REACH)
        reach[: len(problem.names)] = np.log(BOUND)
        found = scipy.optimize.least_squares(
            problem.residuals,
            np.clip(x, -0.999 * reach, 0.999 * reach),
            jac=problem.jacobian,  # pyright: ignore[reportArgumentType]  # the stub omits functions
            bounds=(-reach, reach),
            loss="soft_l1" if whole else "linear",
            f_scale=ROBUST,
            ftol=1e-7 if whole else 1e-3,
            xtol=1e-7,
            x_scale="jac",  # a share of k weighs a thousand times what a lag does
            max_nfev=25 if whole else 8,
        )
        self.evaluations += int(found.nfev)
        return np.asarray(found.x)

    def _share_before(self, window: float) -> float:
        """Return the share of the work that is done when a window's fit begins, by its seconds."""
        every = [w for w in (*_SHORT_S, *_LONG_S) if w < self.longest] + [self.longest]
        looked = _PLACES * _SHORT_S[0]
        before = looked + _EVALUATIONS * sum(w for w in every if w < min(window, self.longest))
        return before / (looked + _EVALUATIONS * sum(every))

    def _told_apart(
        self, problem: Problem, x: NDArray[np.float64]
    ) -> tuple[Problem, NDArray[np.float64]]:
        """Hold a parameter of each combination that whole runs leave open."""
        solution = Solution.at(problem, x)
        while found := undetermined(solution, self.tolerances):
            worst = max(found, key=lambda one: one.spread)
            self.open.append(worst)
            held = min(worst.exponents, key=lambda name: self.tolerances[name])
            self.progress(f"{worst}; {held} stays as stated")
            solution = self._without(solution, held, worst)
        return solution.problem, solution.x

    def _without(self, solution: Solution, held: str, along: Combination) -> Solution:
        """Return the solution with one parameter at its stated value, the others moved along."""
        names = solution.problem.names
        k = names.index(held)
        powers = np.array([along.exponents.get(name, 0.0) for name in names])
        x = solution.x.copy()
        x[: len(names)] -= x[k] / powers[k] * powers
        del self.tolerances[held]
        if not self.tolerances:
            raise InputError(
                "the runs tell none of the parameters: " + "; ".join(str(one) for one in self.open)
            )
        steps = np.delete(solution.problem.steps, k)
        problem = self._problem(solution.problem.robot, solution.problem.window)
        problem.steps = steps
        keep = np.delete(np.arange(len(x)), k)
        return Solution(problem, x[keep], solution.residuals, solution.jacobian[:, keep])


def _coarse(robot: Robot) -> Robot:
    """Return the robot in steps twice as long: in the first seconds they are far below the noise.

    Measured over 2.5 s: T is off by 0.07 mm at 17 rad/s and by at most 0.12 mm (at 11 rad/s).
    """
    return replace(robot, steps_per_sample=max(1, robot.steps_per_sample // 2))
