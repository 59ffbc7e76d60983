"""From runs to parameters: what is told, how surely, and what is not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import InputError, did_you_mean
from workbench.identify.determinacy import Combination
from workbench.identify.intervals import bootstrap
from workbench.identify.measured import MeasuredRun
from workbench.identify.solution import Solution
from workbench.identify.solve import BOUND, fit_runs
from workbench.protocol import UNITS, ModelFile, ShapeFile
from workbench.sim import make_robot

__all__ = ["BEAM", "Estimate", "Identification", "identify"]

BEAM = ("hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping")
"""k, kT, d and dT of the thesis, section 4.4."""

_NEAR_BOUND = 0.98
_MODES = ("clamped", "decay")
"""Hopping is chaotic, and tells of the ground first."""

Progress = Callable[[str], None]


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
    fit = fit_runs(fitting, robot, tolerances, progress, threads)
    solution, open_ = fit.solution, fit.open
    fitted = solution.problem.names
    members = {name for one in open_ for name in one.names}
    logs = bootstrap(solution, seed)
    low, high = np.percentile(logs, [5, 95], axis=0)
    estimates: dict[str, Estimate] = {}
    for k, name in enumerate(fitted):
        if name in members:
            continue
        stated = model.values()[name]
        value, least, most = (stated * float(np.exp(v)) for v in (solution.x[k], low[k], high[k]))
        tolerance = getattr(model.parameters, name).tolerance
        estimates[name] = Estimate(value, least, most, UNITS[name], stated, tolerance)
    return Identification(
        estimates=estimates,
        not_determined=open_,
        increments=solution.problem.robot.increments,
        misfit=solution.misfit,
        runs=tuple(fitting),
        warnings=tuple(_warnings(estimates, open_, solution, model)),
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
    if solution.misfit > 1.5:
        warnings.append(
            f"the fitted model misses the runs by {solution.misfit:.1f} times the noise; "
            "`workbench diagnose` looks for what it lacks, and the intervals do not know of it"
        )
    return warnings
