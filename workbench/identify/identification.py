"""From runs to parameters: what is determined, how surely, and what is not.

The question is put to `workbench.fit`: the runs that depend on the named parameters are observed
together, and the parameters fitted. What the runs cannot distinguish is held and said.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.errors import InputError
from workbench.fit import (
    FINER,
    HOPPING_BEAM,
    Combination,
    Estimator,
    Fit,
    Hopper,
    MeasuredRun,
    Parameter,
    ParameterVector,
    Scope,
    covariance,
    fit_near,
    fit_system,
    free_parameters,
    intervals,
    paced,
    parameters_within_tolerance,
    separable,
    warnings_of,
)
from workbench.fit import FOOT as FOOT_JOINTS
from workbench.progress import Progress
from workbench.schemas import ModelFile, ShapeFile
from workbench.sim import Robot, linear_modes, make_robot

__all__ = ["BEAM", "FOOT", "Identification", "ParameterEstimate", "identify"]

BEAM = ("hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping")
"""k, kT, d and dT of the thesis, section 4.4."""
FOOT = (
    "ground_stiffness", "ground_damping", "friction_slide", "friction_stick", "friction_threshold",
    "foot_mass", "foot_length",
)  # fmt: skip
"""Parameters that only runs with a free foot determine (thesis, 3.3.2 and 4.5)."""

_NEAR_BOUND = 0.98
_STIFFNESSES = ("hinge_stiffness", "root_stiffness")
_SEEN = 2  # modes that runs show
_WHOLE, _WHOLE_HOP = 0.11, 0.35  # of the strong process noise, at the beam clamped and hopping
_CLAMPED = ("clamped", "decay")
_FREE = ("drop", "hop")
_FRICTION_RUN = "add a hop at a speed at which the robot travels"
_GROUND_RUN = "add a drop, or a hop whose foot leaves the ground"
_ADVICE = {
    "ground_stiffness": _GROUND_RUN,
    "ground_damping": _GROUND_RUN,
    "friction_slide": _FRICTION_RUN,
    "friction_stick": _FRICTION_RUN,
}


@dataclass(frozen=True)
class ParameterEstimate:
    """One parameter with its 90 % interval, in the unit of the model file.

    Args:
        value: best fit.
        low: lower end of the interval.
        high: its upper end.
        unit: of all three.
        stated: what the model said before.
        tolerance: what the model said about its own error.
        at_bound: whether the fit wanted to leave the third to three times of the stated value.
    """

    value: float
    low: float
    high: float
    unit: str
    stated: float
    tolerance: float
    at_bound: bool = False

    @property
    def half_width(self) -> float:
        """Return half the interval."""
        return (self.high - self.low) / 2

    def __str__(self) -> str:
        """Return value, interval, unit and what it was: `9.31 (9.29 to 9.33) N m/rad, was 9.5`."""
        interval = f"({self.low:.4g} to {self.high:.4g})"
        return f"{self.value:.4g} {interval} {self.unit}, was {self.stated:.4g}"

    def as_json(self) -> dict[str, Any]:
        """Return value, interval and unit as the command line prints them."""
        return {"value": self.value, "interval90": [self.low, self.high], "unit": self.unit,
                "stated": self.stated, "at_bound": self.at_bound}  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Identification:
    """What the runs say about the model.

    Args:
        estimates: by parameter, of those that were named.
        within_tolerance: by parameter, of the others that moved within theirs.
        values: every fitted parameter, those that carry a combination included.
        not_determined: what the runs leave open; those parameters keep their stated values, but
            for one of each product or ratio, which carries it.
        misfits: run -> root mean square of the innovations over the cameras' noise; one is perfect.
        warnings: as whole sentences.
        runs: that were fitted.
        robot: as fitted.
        fit: of them.
    """

    estimates: Mapping[str, ParameterEstimate]
    within_tolerance: Mapping[str, ParameterEstimate]
    values: Mapping[str, float]
    not_determined: tuple[str, ...]
    misfits: Mapping[str, float]
    warnings: tuple[str, ...]
    runs: tuple[MeasuredRun, ...]
    robot: Robot
    fit: Fit

    def __repr__(self) -> str:
        """Return the misfit and each estimate, a line each."""
        head = f"{len(self.runs)} runs fitted, misfit {self.misfit:.2f} times the noise"
        return "\n  ".join([head, *(f"{name} {one}" for name, one in self.every.items())])

    @property
    def every(self) -> dict[str, ParameterEstimate]:
        """Return all estimates, those that were named first."""
        return {**self.estimates, **self.within_tolerance}

    @property
    def misfit(self) -> float:
        """Return the root mean square of the runs' misfits."""
        return float(np.sqrt(np.mean(np.square(list(self.misfits.values())))))

    @property
    def process_noise(self) -> dict[str, float]:
        """Return what the model misses at each group of joints that moved, in N(m) sqrt(s)."""
        estimator = self.fit.estimator
        return {g: float(q) for g, q in estimator.noise.items() if estimator.depends_on(g)}


def identify(
    runs: Sequence[MeasuredRun],
    model: ModelFile,
    shape: ShapeFile,
    names: Sequence[str] = BEAM,
    *,
    progress: Progress = lambda text: None,
    threads: int = 0,
) -> Identification:
    """Fit parameters of a model to measured runs.

    Where the foot is held, the model's other numbers move within their tolerances: a gram more on
    T, held as stated, is stiffness that the fit finds too low.

    Args:
        runs: of any modes; those with information on the named parameters are fitted together.
        model: the start, with its tolerances.
        shape: of the beam in the runs.
        names: of the parameters.
        progress: receives each stage.
        threads: 0 takes all cores.

    Raises:
        InputError: an unknown or unfit parameter, no runs, or runs that determine none of them.
    """
    if not names:
        raise InputError("no parameter is named; --fit takes names, for example hinge_stiffness")
    named = free_parameters(model, names)
    used = [paced(run) for run in informative_runs(names, runs)]
    free = (*named, *(one for one in _others(model, used) if one.name not in names))
    robot = make_robot(model.values(), shape, model.increments)
    system = Hopper(robot, used, free)
    fit = fit_system(system, ParameterVector(system.parameters), progress=progress, threads=threads)
    other: Fit | None = None
    if misses_physics(fit) and robot.increments < FINER:
        finer = replace(robot, increments=FINER)
        progress(f"a beam of {robot.increments} increments does not follow: try {FINER}")
        system = Hopper(finer, used, free)
        noise = fit.estimator.noise
        other = fit_near(Estimator.of(system, fit.vector, noise, threads=threads), fit.x, progress)
        if _log_likelihood(other) > _log_likelihood(fit):
            robot, fit, other = finer, other, fit
    doubts = _unlike(fit, other) if other is not None and misses_physics(fit) else {}
    if robot.increments != model.increments:
        coarse = _coarseness(robot)
        doubts |= {name: float(np.hypot(doubts.get(name, 0.0), coarse)) for name in _STIFFNESSES}
    fit, open_ = separable(fit, progress)
    members = {name for one in open_ for name in one.names}
    every = _estimates(fit, model, members, doubts)
    estimates = {name: one for name, one in every.items() if name in names}
    values = {
        p.name: value for p, value in fit.vector.values(fit.x).items() if p.scope is not Scope.RUN
    }
    if not values.keys() & set(names):
        raise InputError("the runs determine none of the parameters: " + "; ".join(_said(open_)))
    return Identification(
        estimates, {name: one for name, one in every.items() if name not in names}, values,
        tuple(_said(open_)), _misfits(fit),
        tuple(_warnings(every, fit, model.increments, robot.increments)), tuple(used),
        replace(robot, values={**robot.values, **values}), fit,
    )  # fmt: skip


def _others(model: ModelFile, runs: Sequence[MeasuredRun]) -> tuple[Parameter, ...]:
    """Return what moves within its tolerance beside what is named.

    Where a foot lands, nothing: only what was weighed determines the scale of all masses and
    stiffnesses, and slopes between kinks claim to know it.
    """
    modes = {run.mode for run in runs}
    return () if modes & set(_FREE) else parameters_within_tolerance(model, modes)


def misses_physics(fit: Fit) -> bool:
    """Return whether a fit needs a process noise of the beam that camera noise does not explain.

    A complete model ends near a tenth of the strong noise: what is left of the noise of
    the rotor's angle shakes the beam as much. Of hops it ends there or near a third, for landings
    magnify it.
    """
    strong = fit.estimator.system.strong
    return any(
        noise > (_WHOLE_HOP if group == HOPPING_BEAM else _WHOLE) * strong[group]
        for group, noise in _of_the_beam(fit).items()
    )


def _of_the_beam(fit: Fit) -> dict[str, float]:
    """Return the process noise of the beam's joints, clamped and hopping, where they moved."""
    estimator = fit.estimator
    groups = [g for g in estimator.noise if g != FOOT_JOINTS and estimator.depends_on(g)]
    return {group: estimator.noise[group] for group in groups}


def _log_likelihood(fit: Fit) -> float:
    return fit.estimator.log_likelihood(fit.x)


def informative_runs(names: Collection[str], runs: Sequence[MeasuredRun]) -> list[MeasuredRun]:
    """Return the runs that are fitted for some parameters.

    Parameters of foot and ground need a free foot; for those of beam and rotor clamped runs are
    taken where there are some, because a ground that is stated wrongly would pull at them.

    Raises:
        InputError: when there are none.
    """
    free = [run for run in runs if run.mode in _FREE]
    clamped = [run for run in runs if run.mode in _CLAMPED]
    ground = [name for name in names if name in FOOT]
    if ground and not free:
        raise InputError(
            f"{', '.join(ground)}: no run touches the ground; runs of mode drop or hop with role "
            "train show it, for example `workbench run protocols/drop.yaml`"
        )
    if len(ground) == len(names):
        return free
    chosen = list(runs) if ground else clamped or free
    if not chosen:
        raise InputError(
            "nothing to fit: no run has role train. protocols/clamped-sweep.yaml and "
            "protocols/free-decay.yaml make some"
        )
    return chosen


def _coarseness(robot: Robot) -> float:
    """Return the share by which stiffness is off to make up for a chain of too few increments.

    A chain rings below its strip by what falls with the square of its increments: three quarters of
    that are gone with twice as many. Stiffness goes with the square of frequency.
    """
    finer = linear_modes(replace(robot, increments=2 * robot.increments), count=_SEEN)
    modes = zip(linear_modes(robot, count=_SEEN), finer, strict=True)
    return max(2 * 4 / 3 * abs(fine.hz / own.hz - 1) for own, fine in modes)


def _unlike(fit: Fit, other: Fit) -> dict[str, float]:
    """Return by how much two fits' values differ, as a share."""
    values = other.vector.values(other.x)
    return {
        p.name: abs(values[p] / value - 1)
        for p, value in fit.vector.values(fit.x).items()
        if p.scope is not Scope.RUN
    }


def _estimates(
    fit: Fit, model: ModelFile, without: Collection[str], doubts: Mapping[str, float]
) -> dict[str, ParameterEstimate]:
    """Return the fitted parameters with their intervals, but for some that no run determines.

    Args:
        fit: of them.
        model: what is stated.
        without: names of those that the runs do not determine.
        doubts: share by which a parameter may be off beyond what the runs leave open: another
            mesh, that follows as badly, has it otherwise, or the mesh is too coarse; it counts like
            half an interval.
    """
    found: dict[str, ParameterEstimate] = {}
    found_intervals = intervals(fit, covariance(fit))
    for parameter, one in found_intervals.items():
        name, value = parameter.name, one.value
        if parameter.scope is Scope.RUN or name in without:
            continue
        stated = getattr(model.parameters, name)
        more = doubts.get(name, 0.0) * value
        below, above = (float(np.hypot(end - value, more)) for end in (one.low, one.high))
        found[name] = ParameterEstimate(
            value, value - below, value + above, parameter.unit, stated.value, stated.tolerance,
            _at_bound(parameter, value),
        )  # fmt: skip
    return found


def _at_bound(parameter: Parameter, value: float) -> bool:
    reach = np.log(parameter.high / parameter.nominal)
    return bool(abs(np.log(value / parameter.nominal)) > _NEAR_BOUND * reach)


def _said(open_: Sequence[Combination]) -> list[str]:
    """Return each combination in words, and which run would determine it."""
    said = []
    for one in open_:
        advice = dict.fromkeys(_ADVICE[name] for name in one.names if name in _ADVICE)
        said.append("; ".join([str(one), *advice]))
    return said


def _misfits(fit: Fit) -> dict[str, float]:
    system = fit.estimator.system
    return {
        name: float(np.sqrt(np.nanmean((one.error[: one.sane] / system.sigma(k)) ** 2)))
        for k, (name, one) in enumerate(zip(system.names, fit.innovations, strict=True))
    }


def _warnings(
    estimates: Mapping[str, ParameterEstimate], fit: Fit, stated: int, increments: int
) -> list[str]:
    warnings = []
    if increments != stated:
        warnings.append(
            f"a beam of {stated} increments follows these runs worse than one of {increments}; the "
            "new model says so"
        )
    if misses_physics(fit):
        misfits = _misfits(fit)
        worst = max(misfits, key=misfits.__getitem__)
        warnings.append(
            "the model misses something that the runs show: they ask for process noise of "
            f"{max(_of_the_beam(fit).values()):.2g} N m sqrt(s) at each hinge, and {worst} is "
            f"missed most, {misfits[worst]:.2f} times the cameras' noise one sample ahead. The "
            "intervals count it, and what beams of other increments make of it, but not that the "
            "missing cause may bend the values; `workbench diagnose` looks for what it is"
        )
    for name, estimate in estimates.items():
        if estimate.at_bound:
            warnings.append(
                f"{name} ends at its bound, {estimate.value:.4g} {estimate.unit}, a third or three "
                "times its nominal value; the model misses something, or the nominal value is wrong"
            )
        elif abs(estimate.value - estimate.stated) > 3 * estimate.tolerance:
            warnings.append(
                f"{name} is {estimate.value:.4g} {estimate.unit}, more than three tolerances "
                f"from the nominal {estimate.stated:.4g}"
            )
    if not fit.converged:
        warnings.append(
            "the fit had not come to rest after its last round; values may still move by more than "
            "their intervals"
        )
    return warnings + warnings_of(fit)
