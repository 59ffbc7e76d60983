"""What the rotor's angle says of the drive: each cause and each two of them, in one regression."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.decide import Part, Scored, decide
from workbench.diagnose.drive import DRIVE, DriveFits, drive_fits
from workbench.diagnose.findings import Cause, quantity_of
from workbench.diagnose.fits import Fits
from workbench.diagnose.hypothesis import Hypothesis
from workbench.fit import Hopper, Innovations, Solved, arm_of
from workbench.sim import EFFECTS

__all__ = ["DrivePart", "drive_part"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DrivePart:
    """What the rotor's angle says.

    Args:
        part: of the answer.
        causes: that it lists.
        fitted: the regression of the fitted runs.
        angles: (n,) of each run held out, the rotor's angle against T [rad] without a cause and
            with those that hold; None where nothing is driven.
    """

    part: Part
    causes: tuple[Cause, ...]
    fitted: DriveFits
    angles: tuple[list[Array | None], list[Array | None]]


def drive_part(fits: Fits, best: Hypothesis) -> DrivePart | None:
    """Return what the rotor's angle says of the drive; None where nothing is driven."""
    regressions = _regressions(fits, best)
    if regressions is None:
        return None
    fits.progress("judge the drive by the rotor's angle")
    fitted, held = regressions
    names = [name for name in DRIVE if name in fitted.quantities]
    every = [(), *((name,) for name in names), *combinations(names, 2)]
    solved = {one: fitted.solved(one) for one in every}
    samples = len(fitted.linear.residuals)

    def scored(names: tuple[str, ...]) -> Scored:
        found = solved[names]
        own = found.cost - float(found.blocks.sum())
        power = float(found.blocks.sum()) / samples
        missing = max(0.0, (power - 1) / (fits.rules.whole**2 - 1))  # beyond the noise
        judged = tuple(held.by_run(held.like(fitted, found))) if fits.held else ()
        runs = zip(fitted.runs, fitted.by_run(found), strict=True)
        by_run = {fits.rig.names[fits.train[k]]: float(blocks.sum()) for k, blocks in runs}
        numbers = sum(len(fitted.quantities[name]) for name in names)
        return Scored(names, own, found.blocks, judged, lambda: missing, by_run, numbers=numbers)

    tried = [scored(one) for one in every if one]
    part = decide(scored(()), tried, samples, fits.rules)
    causes: dict[str, Cause] = {}
    listed = {name for alike in part.alike for name in alike.names}
    others = [name for name in names if name not in listed]
    for alike in part.alike:
        found = fitted.values(alike.names, solved[alike.names], others)
        for name in alike.names:
            effect = EFFECTS[name]
            quantities = {
                q.name: quantity_of(*found[f"{name} {q.name}"], q.low, q.high, q.unit)
                for q in effect.quantities
            }
            causes.setdefault(name, Cause(name, quantities, effect.sentence.format_map(quantities)))
    angles = tuple(_angles(fits, fitted, held, solved[one]) for one in ((), part.best.names))
    return DrivePart(part, tuple(causes.values()), fitted, (angles[0], angles[1]))


def _regressions(fits: Fits, at: Hypothesis) -> tuple[DriveFits, DriveFits] | None:
    """Return the regressions of the drive in the runs fitted and held out; None without one."""
    system = at.estimator.system
    if not isinstance(system, Hopper) or not any(run.driven for run in system.runs):
        return None
    turned = _turns(system, at.estimator.innovations(at.x, keep=True))
    arm = arm_of(system, turned)
    found = [drive_fits(system, turned, arm)]
    held = fits.unseen(at) if fits.held else None
    if held is not None and isinstance(held.system, Hopper):
        x = held.vector.named(at.values)
        turns = _turns(held.system, held.innovations(x, keep=True))
        found.append(drive_fits(held.system, turns, arm))
    return found[0], found[-1]


def _turns(system: Hopper, found: Sequence[Innovations]) -> list[Array]:
    return [system.turn_of_top(k, one.qpos) for k, one in enumerate(found)]


def _angles(fits: Fits, fitted: DriveFits, held: DriveFits, found: Solved) -> list[Array | None]:
    """Return the rotor's angle of each run held out, as the drive is said to turn it."""
    judged = held.like(fitted, found)
    shared = [n for n, own in zip(fitted.linear.names, fitted.linear.own, strict=True) if not own]
    numbers = dict(zip(fitted.linear.names, found.x, strict=True))
    own = dict(zip(held.linear.names, judged.x, strict=True))
    whole = replace(
        judged,
        x=np.array([numbers[name] if name in shared else own[name] for name in held.linear.names]),
    )
    return [held.angle(whole, k) if k in held.runs else None for k in range(len(fits.held))]
