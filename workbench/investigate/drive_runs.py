"""The run that separates causes of the drive, from the rotor's speed alone.

Each cause changes a run's mean speed by its amount times a lever: a scale by the speed, an offset
by one, a drift by the speed and half the run's time. Causes that agree at the speeds that were run
part at another. A run keeps a small share of its speed to itself, which no cause accounts for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import permutations

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose import Cause, Diagnosis, Rules, Scored
from workbench.investigate.proposed import (
    FURTHEST,
    LEAST_CHANCE,
    TIMES,
    Proposal,
    ProposedRun,
    Separation,
    minutes_of,
)
from workbench.motion import DRIVEN

__all__ = ["propose_speed", "propose_speed_among"]

Lever = Callable[[float, float], float]

_LEVERS: Mapping[str, Lever] = {
    "speed_scale": lambda speed, time: speed,
    "speed_offset": lambda speed, time: 1.0,
    "speed_drift": lambda speed, time: speed * time / 2,
}
"""Cause -> what an amount of one adds to a run's mean speed, by its speed [rad/s] and time [s]."""
_OWN_SHARE = 1e-3  # of its speed that a run keeps to itself, as the drive's regression has it


def propose_speed(found: Diagnosis, menu: Sequence[ProposedRun]) -> Proposal | None:
    """Return the run whose speed separates causes of the drive; None where no speed does.

    Args:
        found: the diagnosis, whose drive may be a set.
        menu: the runs that the bench can make.
    """
    part = found.parts.get("drive")
    if part is None or part.kind != "SET":
        return None
    causes = {one.name: one for one in found.causes}
    alike = [one for one in part.alike if len(one.names) == 1 and one.names[0] in causes]
    weights = _weights(alike)
    return propose_speed_among([causes[one.names[0]] for one in alike], weights, menu, found.rules)


def propose_speed_among(
    causes: Sequence[Cause], weights: Sequence[float], menu: Sequence[ProposedRun], rules: Rules
) -> Proposal | None:
    """Return the run whose speed separates some causes; None where no speed does.

    Args:
        causes: with what was found of their amounts.
        weights: how likely each is.
        menu: the runs that the bench can make.
        rules: of the diagnosis.
    """
    pairs = [
        (i, j)
        for i, j in permutations(range(len(causes)), 2)
        if {causes[i].name, causes[j].name} <= set(_LEVERS)
    ]
    options = []
    for trial in menu:
        if trial.mode not in DRIVEN or not pairs:
            continue
        separations, chance = [], 0.0
        for i, j in pairs:
            gain = _gain(causes[i], causes[j], trial)
            likely = _chance(gain, rules)
            chance += weights[i] * likely / sum(first == i for first, _ in pairs)
            distance = min(float(np.sqrt(gain)), FURTHEST)
            separations.append(Separation(causes[i].name, causes[j].name, distance, likely))
        separations.sort(key=lambda one: one.distance)
        minutes = minutes_of([trial] * TIMES)
        options.append(Proposal((trial,), minutes, tuple(separations), chance))
    if not options:
        return None
    best = max(options, key=lambda one: (one.chance / one.minutes, one.separations[0].distance))
    return best if best.chance >= LEAST_CHANCE else None


def _gain(truth: Cause, alternative: Cause, trial: ProposedRun) -> float:
    """Return the gain that `TIMES` runs of a trial bring for one cause over another."""
    speed, time = trial.amount, trial.duration
    true, false = _LEVERS[truth.name](speed, time), _LEVERS[alternative.name](speed, time)
    amount, other = (next(iter(one.quantities.values())) for one in (truth, alternative))
    apart = amount.value * true - other.value * false
    variance = (_OWN_SHARE * speed) ** 2 / TIMES + (other.error * false) ** 2
    return max(apart**2 / variance, 1e-9)


def _chance(gain: float, rules: Rules) -> float:
    spread = 2 * np.sqrt(gain)
    least = max(rules.suspected, rules.apart * spread)
    return float(scipy.stats.norm.cdf((gain - least) / spread))


def _weights(alike: Sequence[Scored]) -> list[float]:
    costs: NDArray[np.float64] = np.array([one.cost for one in alike])
    return [float(w) for w in scipy.special.softmax(-costs / 2)] if alike else []
