"""A day in the laboratory: honest runs with all bodies filmed, and ways to spoil one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tests.diagnose.hidden import DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import HopperRig
from workbench.fit import MeasuredRun
from workbench.motion import FOOT, ROTOR, ROTOR_ANGLE, TOP, position, rotor_angle
from workbench.timeseries import TimeSeries

__all__ = [
    "CLAMPED",
    "FREE",
    "Array",
    "Bodies",
    "day",
    "faults",
    "mapped",
    "named",
    "spoiled",
    "told",
]

Array = NDArray[np.float64]
Bodies = dict[str, Array]

CLAMPED = (
    Asked("clamped", 11.0, 3.0),
    Asked("clamped", 13.0, 3.0),
    Asked("clamped", 15.0, 3.0),
    Asked("clamped", 17.0, 3.0),
    Asked("decay", 0.3, 3.0),
    Asked("decay", 0.6, 3.0),
    Asked("decay", 0.9, 3.0),
)
FREE = (Asked("hop", 17.0, 3.0), Asked("hop", 18.0, 3.0), Asked("drop", 0.02, 2.0))
_RADIUS_M, _NOISE_M = 0.035, 3e-4


def day(
    asked: Sequence[Asked] = CLAMPED,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    seed: int = 1,
) -> dict[str, MeasuredRun]:
    """Return runs by name, of a robot that has effects."""
    runs = runs_of(truth(seed, effects or {}), seed, asked)
    rng = np.random.default_rng([seed, 5])
    return {run.name: _with_rotor(run, rng) for run in runs}


def faults(runs: Mapping[str, MeasuredRun]) -> list[tuple[str, str]]:
    """Return (run, evidence) of what the robot's rig finds in some runs."""
    chosen = list(runs.values())
    rig = HopperRig(chosen, DOCUMENT, SHAPE)
    return [(chosen[fault.run].name, fault.evidence) for fault in rig.faults()]


def spoiled(
    runs: Mapping[str, MeasuredRun], name: str, change: Callable[[MeasuredRun], MeasuredRun]
) -> dict[str, MeasuredRun]:
    """Return the runs with one of them changed."""
    return dict(runs) | {name: change(runs[name])}


def told(evidence: Sequence[tuple[str, str]], name: str) -> str:
    """Return all that is told of one run."""
    return " | ".join(text for run, text in evidence if run == name)


def named(evidence: Sequence[tuple[str, str]]) -> set[str]:
    """Return the runs that something is told of."""
    return {run for run, _ in evidence}


def mapped(run: MeasuredRun, change: Callable[[Bodies, Array], Bodies]) -> MeasuredRun:
    """Return a run whose bodies' paths, (n, 3) by `foot`, `top`, `rotor`, were changed.

    Args:
        run: as filmed.
        change: gets the paths and the times.
    """
    names = {"foot": FOOT, "top": TOP, "rotor": ROTOR}
    paths = {body: position(run.motion, name).copy() for body, name in names.items()}
    paths = change(paths, run.motion.times)
    columns: dict[str, Array] = {}
    for body, name in names.items():
        columns |= dict(zip(name, paths[body].T, strict=True))
    columns[ROTOR_ANGLE] = rotor_angle(paths["top"], paths["rotor"])
    return replace(run, motion=TimeSeries.of(run.motion.times, columns))


def _with_rotor(run: MeasuredRun, rng: np.random.Generator) -> MeasuredRun:
    """Return a run with the rotor's place, as its angle has it."""
    angle, top = run.motion[ROTOR_ANGLE], position(run.motion, TOP)
    arm = np.stack([np.cos(angle), np.zeros(len(angle)), -np.sin(angle)], axis=1)
    places = top + _RADIUS_M * arm + _NOISE_M * rng.standard_normal(top.shape)
    columns = {name: run.motion[name] for name in run.motion.names}
    columns |= dict(zip(ROTOR, places.T, strict=True))
    return replace(run, motion=TimeSeries.of(run.motion.times, columns))
