"""What the ground does to the foot: stiffness and damping from falls, friction from the first hops.

The order is the thesis' (section 4.5), with the beam known from clamped runs. Falls tell the
ground. Until the foot first slips, a hop does not depend on friction, so that part tells how the
motor ran. The next three quarters of a second are compared over a grid of friction levels; then all
runs are fitted together, each hop for as long as it can be reproduced: until what is left unsure
about its start moves it by as much as the noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from workbench.errors import InputError
from workbench.fit.measured import MeasuredRun
from workbench.identify.determinacy import undetermined
from workbench.identify.excitation import first_slip, unexcited
from workbench.identify.identification import Estimate, estimates_of
from workbench.identify.kinked import Minimum, minimum, redrawn
from workbench.identify.problem import Problem
from workbench.identify.solution import Solution
from workbench.progress import Progress
from workbench.protocol import ModelFile, ShapeFile
from workbench.sim import Robot, make_robot

__all__ = ["CONTACT", "FRICTION", "GROUND", "Contact", "identify_contact"]

GROUND = ("ground_stiffness", "ground_damping")
FRICTION = ("friction_slide", "friction_stick")
CONTACT = (*GROUND, *FRICTION)
"""k_Ground, d_Ground, mu_slide and mu_stick of the thesis, section 3.3.2."""

_FALL_S = 1.0  # impact and settling; later the beam rings on, which says nothing of the ground
_LEAST_HELD_S = 0.5
_AFTER_SLIP_S = 0.75  # the first hops; their shape still tells a level that is far off
_LONGEST_S = 3.0
_HOLDING = 100.0  # a friction under which nothing slips
_GRID = np.linspace(-0.6, 0.6, 13)  # log share of the stated level; the valley is as narrow
_HALVINGS = 3
_KEPT = 4  # valleys that are followed: a late slip of one level looks like an early one of another
_UNSETTLED = 0.05  # log share by which clouds disagree: this is no minimum
_POOR = 1.5

_Known = dict[tuple[str, str], float]


@dataclass(frozen=True, eq=False)
class Contact:
    """What the runs say about ground and friction.

    Args:
        estimates: by parameter.
        not_determined: parameter -> why the runs do not tell it; it keeps its stated value.
        windows: run -> how much of it was compared [s].
        misfit: root mean square of measured less simulated, in noise deviations; NaN where nothing
            could be fitted.
        warnings: as whole sentences.
        solution: the fit itself, None where nothing could be fitted.
    """

    estimates: Mapping[str, Estimate]
    not_determined: Mapping[str, str]
    windows: Mapping[str, float]
    misfit: float
    warnings: tuple[str, ...]
    solution: Solution | None

    @property
    def values(self) -> dict[str, float]:
        """Return what was estimated, by parameter."""
        return {name: estimate.value for name, estimate in self.estimates.items()}


def identify_contact(
    runs: Sequence[MeasuredRun],
    model: ModelFile,
    shape: ShapeFile,
    names: Sequence[str] = CONTACT,
    *,
    seed: int = 0,
    progress: Progress = lambda text: None,
    threads: int = 0,
) -> Contact:
    """Fit ground and friction to drops and hops.

    Args:
        runs: all of them; clamped and decay runs do not touch the ground and are left out.
        model: with the beam as identified, and the tolerances of what is fitted.
        shape: of the beam in the runs.
        names: some of `CONTACT`.
        seed: of the bootstrap.
        progress: is told each stage.
        threads: 0 takes all cores.

    Raises:
        InputError: a parameter that is not of the contact, or no run that touches the ground.
    """
    _check(names, model)
    free = [run for run in runs if run.mode in ("drop", "hop")]
    if not free:
        raise InputError(
            "no run touches the ground: ground and friction are told by runs of mode drop and hop, "
            "for example `workbench run protocols/drop.yaml`"
        )
    reasons = unexcited(names, free)
    told = [name for name in CONTACT if name in names and name not in reasons]
    if not told:
        return Contact({}, reasons, {}, float("nan"), (), None)
    fitter = _Fitter(free, make_robot(model.values(), shape, model.increments), progress, threads)
    return _judged(fitter.fit(told), fitter.windows, model, reasons, seed)


def _judged(
    found: Minimum,
    windows: Mapping[str, float],
    model: ModelFile,
    reasons: dict[str, str],
    seed: int,
) -> Contact:
    """Return the answer: what the minimum is worth, and which parameters it leaves open."""
    solution = found.solution
    tolerances = {name: _tolerance(model, name) for name in solution.problem.names}
    for one in undetermined(solution, tolerances):
        reasons |= {name: str(one) for name in one.names}
    for name, error in zip(solution.problem.names, found.error, strict=True):
        if error > _UNSETTLED:
            reasons[name] = (
                f"the fit does not settle: it finds {name} within {100 * error:.0f} % only, "
                f"{solution.misfit:.1f} times the noise from the runs; add runs or mend the model"
            )
    estimates = estimates_of(solution, redrawn(found, seed), model, reasons)
    warnings = tuple(_warnings(estimates, solution))
    return Contact(estimates, reasons, windows, solution.misfit, warnings, solution)


class _Fitter:
    """One fit, stage by stage; what is known is carried by name from stage to stage."""

    def __init__(
        self, runs: Sequence[MeasuredRun], robot: Robot, progress: Progress, threads: int
    ) -> None:
        self.robot, self.progress, self.threads = robot, progress, threads
        self.drops = [_cut(run, _FALL_S) for run in runs if run.mode == "drop"]
        self.hops = [run for run in runs if run.mode == "hop"]
        self.windows = {run.name: _FALL_S for run in self.drops}
        self.known: _Known = {}

    def fit(self, names: Sequence[str]) -> Minimum:
        """Return the minimum over all runs."""
        ground = [name for name in names if name in GROUND]
        if ground and self.drops:
            self.progress(f"fit {' and '.join(ground)} to {len(self.drops)} drops")
            self._learn(minimum(*self._problem(self.drops, ground)).solution)
        if self.hops:
            self._learn_drive()
        friction = [name for name in names if name in FRICTION]
        if friction:
            self._look_around(friction)
        hops = self._reproducible()
        self.windows |= {run.name: float(run.motion.times[-1]) for run in hops}
        self.progress(f"fit {', '.join(names)} to all runs")
        return minimum(*self._problem([*self.drops, *hops], names))

    def _problem(
        self, runs: Sequence[MeasuredRun], names: Sequence[str], robot: Robot | None = None
    ) -> tuple[Problem, NDArray[np.float64]]:
        """Return a problem and the unknowns as far as they are known."""
        held = {name: self.robot.values[name] * float(np.exp(self.known.get((name, ""), 0.0)))
                for name in CONTACT if name not in names}  # fmt: skip
        robot = robot or replace(self.robot, values=dict(self.robot.values) | held)
        problem = Problem(runs, robot, names, threads=self.threads)
        keys = _keys(problem)
        return problem, np.array([self.known.get(key, 0.0) for key in keys])

    def _learn(self, solution: Solution) -> None:
        self.known |= dict(zip(_keys(solution.problem), map(float, solution.x), strict=True))

    def _learn_drive(self) -> None:
        """Find how each hop began and its motor ran, from the part before the foot slips."""
        self.progress(f"fit the motor of {len(self.hops)} hops before the foot slips")
        begun = [_cut(run, max(first_slip(run), _LEAST_HELD_S)) for run in self.hops]
        holding = dict(self.robot.values) | dict.fromkeys(FRICTION, _HOLDING)
        for name in GROUND:
            holding[name] *= float(np.exp(self.known.get((name, ""), 0.0)))
        problem, x = self._problem(begun, (), replace(self.robot, values=holding))
        found = scipy.optimize.least_squares(
            problem.residuals,
            x,
            jac=problem.jacobian,  # pyright: ignore[reportArgumentType]  # the stub omits functions
            loss="soft_l1",
            f_scale=3.0,
            ftol=1e-4,
            max_nfev=10,
        )
        self._learn(Solution.at(problem, np.asarray(found.x)))
        information = problem.jacobian(found.x).T @ problem.jacobian(found.x)
        spread = np.sqrt(np.diag(np.linalg.pinv(information)))
        self.spread = dict(zip(_keys(problem), map(float, spread), strict=True))

    def _look_around(self, names: Sequence[str]) -> None:
        """Search a grid of friction levels, then ever closer about the best."""
        self.progress(f"look around for {' and '.join(names)}")
        hops = [_cut(run, first_slip(run) + _AFTER_SLIP_S) for run in self.hops]
        problem, x = self._problem(hops, names)
        signs = _lattice([-1.0, 0.0, 1.0], len(names))
        stated = np.log([problem.robot.values[name] for name in names])
        width, grid = float(_GRID[1] - _GRID[0]), _lattice(_GRID, len(names))
        best = grid
        for _ in range(1 + _HALVINGS):
            # what sticks holds at least as much as what slides: FRICTION is in this order
            best = self._best(problem, x, grid[(np.diff(grid + stated) >= 0).all(axis=1)])
            width /= 2
            near = (best[:, None, :] + width * signs).reshape(-1, len(names))
            grid = np.unique(near.round(6), axis=0)
        self.known |= {(name, ""): float(v) for name, v in zip(names, best[0], strict=True)}

    def _best(
        self, problem: Problem, x: NDArray[np.float64], grid: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the few levels (kept, names) that miss the runs least, the best one first."""
        places = [np.concatenate([levels, x[len(problem.names) :]]) for levels in grid]
        costs = np.log1p(problem.residuals_of(places) ** 2).sum(axis=1)
        return grid[np.argsort(costs)[:_KEPT]]

    def _reproducible(self) -> list[MeasuredRun]:
        """Return the hops, each for as long as its unsure start moves it less than the noise."""
        if not self.hops:
            return []
        hops = [_cut(run, _LONGEST_S) for run in self.hops]
        problem, x = self._problem(hops, ())
        keys = _keys(problem)
        places = [x]
        for name in ("lag", "gain", "start angle"):
            moves = [self.spread[key] if key[0] == name else 0.0 for key in keys]
            places.append(x + np.array(moves))
        found = problem.residuals_of(places)
        moved = np.abs(found[1:] - found[0]).max(axis=0)
        rows = problem.rows
        out = []
        for k, run in enumerate(hops):
            times = rows.time[(rows.run == k) & (moved > 1)]
            slipped = first_slip(run) + _AFTER_SLIP_S
            out.append(_cut(run, max(float(times.min(initial=_LONGEST_S)), slipped)))
        return out


def _lattice(levels: ArrayLike, count: int) -> NDArray[np.float64]:
    """Return every combination of levels, (levels ** count, count)."""
    return np.array(np.meshgrid(*[levels] * count), dtype=float).reshape(count, -1).T


def _keys(problem: Problem) -> list[tuple[str, str]]:
    """Return each unknown's name and that of its run, empty where all runs share it."""
    return [(one.name, problem.runs[one.run].name if one.run >= 0 else "")
            for one in problem.unknowns]  # fmt: skip


def _cut(run: MeasuredRun, stop: float) -> MeasuredRun:
    return replace(run, motion=run.motion.between(-np.inf, stop))


def _check(names: Sequence[str], model: ModelFile) -> None:
    for name in names:
        if name not in CONTACT:
            raise InputError(
                f"parameter {name!r} is not of the contact with the ground; these are: "
                f"{', '.join(CONTACT)}"
            )
        if _tolerance(model, name) <= 0:
            raise InputError(
                f"parameter {name} has tolerance 0 or value 0 in model {model.name!r}; state how "
                "far it may be off to have it fitted"
            )


def _tolerance(model: ModelFile, name: str) -> float:
    """Return a parameter's tolerance as a share of its value, 0 where one of them is 0."""
    parameter = getattr(model.parameters, name)
    return parameter.tolerance / parameter.value if parameter.value > 0 else 0.0


def _warnings(estimates: Mapping[str, Estimate], solution: Solution) -> list[str]:
    warnings = [
        f"{name} ends at its bound, {one.value:.4g} {one.unit}; the model lacks something, or the "
        "stated value is wrong"
        for name, one in estimates.items()
        if one.at_bound
    ]
    if solution.misfit > _POOR:
        warnings.append(
            f"the fitted contact misses the runs by {solution.misfit:.1f} times the noise; fit the "
            "beam on clamped runs first, then `workbench diagnose` looks for what the model lacks"
        )
    return warnings
