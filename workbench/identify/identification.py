"""From runs to parameters: what is told, how surely, and what is not."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError, did_you_mean
from workbench.fit.measured import MeasuredRun
from workbench.identify.determinacy import Combination
from workbench.identify.intervals import bootstrap
from workbench.identify.leftover import leftover
from workbench.identify.pairs import run_misfits
from workbench.identify.solution import Solution
from workbench.identify.solve import BOUND, Fit, fit_runs
from workbench.progress import Progress
from workbench.protocol import UNITS, ModelFile, ShapeFile
from workbench.sim import make_robot

__all__ = ["BEAM", "Estimate", "Identification", "estimates_of", "identify"]

BEAM = ("hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping")
"""k, kT, d and dT of the thesis, section 4.4."""

_NEAR_BOUND = 0.98
_MODES = ("clamped", "decay")
"""Hopping is chaotic, and tells of the ground first."""


@dataclass(frozen=True)
class Estimate:
    """One parameter with its 90 % interval, in the unit of the model file.

    Args:
        value: best fit.
        low: 5 % of the redrawn fits lie below.
        high: 5 % lie above.
        unit: of all three.
        stated: what the model said before.
        tolerance: what the model said about its own error.
    """

    value: float
    low: float
    high: float
    unit: str
    stated: float
    tolerance: float

    @property
    def half_width(self) -> float:
        """Return half the interval."""
        return (self.high - self.low) / 2

    @property
    def at_bound(self) -> bool:
        """Tell whether the fit wanted to leave the third to three times of the stated value."""
        return bool(abs(np.log(self.value / self.stated)) > _NEAR_BOUND * np.log(BOUND))

    def as_json(self) -> dict[str, Any]:
        """Return value, interval and unit as the command line prints them."""
        return {"value": self.value, "interval90": [self.low, self.high], "unit": self.unit,
                "stated": self.stated, "at_bound": self.at_bound}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Identification:
    """What the runs say about the model.

    Args:
        estimates: by parameter.
        not_determined: what the runs leave open; those parameters keep their stated values, but
            for one of each product or ratio, which carries it.
        increments: of the beam that was fitted.
        misfit: root mean square of measured less simulated, in noise deviations; one is perfect.
        runs: that were fitted.
        warnings: as whole sentences.
        solution: the fit itself.
    """

    estimates: Mapping[str, Estimate]
    not_determined: tuple[Combination, ...]
    increments: int
    misfit: float
    runs: tuple[MeasuredRun, ...]
    warnings: tuple[str, ...]
    solution: Solution

    @property
    def values(self) -> dict[str, float]:
        """Return every fitted parameter, those that carry a combination included."""
        return self.solution.problem.values(self.solution.x)


def identify(
    runs: Sequence[MeasuredRun],
    model: ModelFile,
    shape: ShapeFile,
    names: Sequence[str] = BEAM,
    *,
    seed: int = 0,
    progress: Progress = lambda text: None,
    threads: int = 0,
) -> Identification:
    """Fit parameters of a model to measured runs.

    Args:
        runs: those clamped and in decay are fitted together; of others nothing is taken.
        model: the start, with its tolerances.
        shape: of the beam in the runs.
        names: of the parameters; the others stay as stated.
        seed: of the bootstrap.
        progress: is told each stage.
        threads: 0 takes all cores.

    Raises:
        InputError: an unknown or unfit parameter, no runs, or runs that tell none of them.
    """
    tolerances = _tolerances(model, names)
    fitting = [run for run in runs if run.mode in _MODES]
    if not fitting:
        modes = ", ".join(sorted({run.mode for run in runs})) or "none"
        raise InputError(
            f"nothing to fit: runs of mode {' or '.join(_MODES)} with role train are needed, given "
            f"are {modes}. protocols/clamped-sweep.yaml and protocols/free-decay.yaml make some"
        )
    robot = make_robot(model.values(), shape, model.increments)
    return _judged(fit_runs(fitting, robot, tolerances, progress, threads), model, seed)


def estimates_of(
    solution: Solution,
    redrawn: NDArray[np.float64],
    model: ModelFile,
    without: Collection[str] = (),
) -> dict[str, Estimate]:
    """Return the fitted parameters with their intervals.

    Args:
        solution: where the fit ended.
        redrawn: (draws, names) parameters as logarithms of their share of the stated value.
        model: the start.
        without: parameters that the runs do not tell.
    """
    low, high = np.percentile(redrawn, [5, 95], axis=0)
    found: dict[str, Estimate] = {}
    for k, name in enumerate(solution.problem.names):
        if name in without:
            continue
        stated = model.values()[name]
        value, least, most = (stated * float(np.exp(v)) for v in (solution.x[k], low[k], high[k]))
        tolerance = getattr(model.parameters, name).tolerance
        found[name] = Estimate(value, least, most, UNITS[name], stated, tolerance)
    return found


def _judged(fit: Fit, model: ModelFile, seed: int) -> Identification:
    """Return the answer: what the fit is worth, and what speaks against it."""
    solution = fit.solution
    members = {name for one in fit.open for name in one.names}
    estimates = estimates_of(solution, bootstrap(fit.meshed or solution, seed), model, members)
    return Identification(
        estimates=estimates,
        not_determined=fit.open,
        increments=solution.problem.robot.increments,
        misfit=solution.misfit,
        runs=solution.problem.runs,
        warnings=tuple(_warnings(estimates, fit.open, solution, model)),
        solution=solution,
    )


def _tolerances(model: ModelFile, names: Sequence[str]) -> dict[str, float]:
    """Return the tolerance of each named parameter as a share of its value."""
    found: dict[str, float] = {}
    for name in names:
        if name not in UNITS:
            hint = did_you_mean(name, UNITS)
            raise InputError(f"parameter {name!r} is unknown{hint}; there are {', '.join(UNITS)}")
        parameter = getattr(model.parameters, name)
        if parameter.value <= 0:
            raise InputError(
                f"parameter {name} is {parameter.value:g} in model {model.name!r}; "
                "a fit starts above zero, state a positive value"
            )
        if parameter.tolerance == 0:
            raise InputError(
                f"parameter {name} has tolerance 0 in model {model.name!r}: it is known exactly; "
                "state how far it may be off to have it fitted"
            )
        found[name] = parameter.tolerance / parameter.value
    if not found:
        raise InputError("no parameter is named; --fit takes names, for example hinge_stiffness")
    return found


def _warnings(
    estimates: Mapping[str, Estimate],
    open_: Sequence[Combination],
    solution: Solution,
    model: ModelFile,
) -> list[str]:
    warnings = [str(one) for one in open_]
    for name, estimate in estimates.items():
        if estimate.at_bound:
            warnings.append(
                f"{name} ends at its bound, {estimate.value:.4g} {estimate.unit}, {BOUND:g} times "
                "off its stated value; the model lacks something, or the stated value is wrong"
            )
        elif abs(estimate.value - estimate.stated) > 3 * estimate.tolerance:
            warnings.append(
                f"{name} is {estimate.value:.4g} {estimate.unit}, more than three tolerances "
                f"from the stated {estimate.stated:.4g}"
            )
    increments = solution.problem.robot.increments
    if increments != model.increments:
        warnings.append(
            f"a beam of {model.increments} increments cannot follow these runs; they are fitted "
            f"with {increments}, and the new model says so"
        )
    left = leftover(solution)
    if left.is_more_than_noise:
        misfits = run_misfits(solution)
        worst = max(misfits, key=misfits.__getitem__)
        warnings.append(
            f"the model lacks something that the runs show: it misses them by {left.misfit:.3f} "
            f"times the noise, where noise alone leaves {left.noise:.3f} \N{PLUS-MINUS SIGN} "
            f"{left.noise * left.error:.3f}, most in {worst} ({misfits[worst]:.2f} times); values "
            "and intervals do not know of it. `workbench diagnose` looks for what it is"
        )
    return warnings
