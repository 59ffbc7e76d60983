"""The next experiment: of all runs that a bench can make, those that separate best what remains.

Each hypothesis that remains predicts each run, and the observer of every other judges what is
predicted. As far as that other still misses it, its base, its own quantities and what belongs to
the run adapted within what the runs that exist allow, the run separates them (T-optimality:
Atkinson and Fedorov, Biometrika 62, 1975, p. 57). The rule is the diagnosis' own, so a run's
score is the chance that it rejects alternatives, for each minute that it takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise, permutations, zip_longest

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose import Diagnosis, HopperRig
from workbench.fit import ROBUST, Hopper, Scope, edges_of, soft, weights
from workbench.investigate.drive_runs import propose_speed
from workbench.investigate.predicted import Predicted, Setting
from workbench.investigate.proposed import (
    FURTHEST,
    LEAST_CHANCE,
    TIMES,
    Proposal,
    ProposedRun,
    Separation,
    minutes_of,
)
from workbench.investigate.remaining import BEYOND, MOST, Remaining, asked_of, remaining
from workbench.progress import Progress

__all__ = ["TIMES", "Proposal", "Separation", "minutes_of", "propose", "propose_among"]

Array = NDArray[np.float64]

_CLOSER = (
    5  # trials whose alternatives are allowed to adapt; that takes a simulation for each number
)
_BEGIN_S = 3.0  # of each trial, that says which are looked at closer
_MOST_RUNS = 3  # in one proposal
_SILENT = 1e-6  # of the gain: what two alternatives predict alike
_ROUNDS = 4  # of the robust weights in one linearisation


def propose(
    found: Diagnosis, menu: Sequence[ProposedRun], progress: Progress = lambda text: None
) -> Proposal | None:
    """Return the runs that separate best, each minute, what a diagnosis leaves.

    Args:
        found: the diagnosis.
        menu: the runs that the bench can make.
        progress: called at each stage.

    Returns:
        None where the data are at fault, where at most one hypothesis remains, where the rig cannot
        say what other runs would show, or where no run on the menu separates what remains.
    """
    if found.kind == "DATA_FAULT" or not isinstance(found.rig, HopperRig) or not menu:
        return None
    if asked_of(found).part.kind != "SET":  # a set of the drive is asked about first
        return propose_speed(found, menu) or _of_observer(found, found.rig, menu, progress)
    return _of_observer(found, found.rig, menu, progress) or propose_speed(found, menu)


def _of_observer(
    found: Diagnosis, rig: HopperRig, menu: Sequence[ProposedRun], progress: Progress
) -> Proposal | None:
    """Return the runs that separate best what the observer leaves; None where none does."""
    part, fits = asked_of(found).part, found.observer.fits
    strict = BEYOND if part.kind in ("NAMED", "PARTIAL") else 1.0
    wide = rig.with_modes({trial.mode for trial in menu})
    setting = Setting(wide, found.rules, fits.repeats(), fits.samples(), strict, fits.threads)
    left = remaining(found, wide)
    menu = _informative(left, rig, menu)
    if len(left) > MOST:
        progress(f"see which of {len(left) - 1} causes other runs could show")
        left = _shown(left, setting, menu)
    return propose_among(left, setting, menu, progress)


def _shown(
    left: Sequence[Remaining], setting: Setting, menu: Sequence[ProposedRun]
) -> list[Remaining]:
    """Return the base and the hidden causes that the greatest run of some mode shows most."""
    greatest = {one.mode: one for one in sorted(menu, key=lambda one: one.amount)}
    predicted = Predicted(left, setting, list(greatest.values()), _BEGIN_S)
    if not predicted.menu:
        return []
    gains = np.max(predicted.apart([(i, 0) for i in range(1, len(left))]), axis=0)
    most = np.argsort(-gains, kind="stable")[: MOST - 1]
    return [left[0], *(replace(left[1 + k], weight=1 / len(most)) for k in most)]


def _informative(
    left: Sequence[Remaining], rig: HopperRig, menu: Sequence[ProposedRun]
) -> list[ProposedRun]:
    """Return the trials of modes that can separate them.

    A mode that brings numbers nobody has fitted yet, as the ground does, is expensive to simulate
    and says little of what other modes show as well; it counts where a cause shows in no other.
    """
    modes = {trial.mode for trial in menu}
    names = {name for one in left for name in one.names}
    shown = {
        mode: {
            one.name
            for one in rig.with_modes(modes).candidates
            if one.name in names and mode in one.shows_in
        }
        for mode in modes
    }
    plain = {mode for mode in modes if len(rig.with_modes({mode}).base) == len(rig.base)}
    plainly = {name for mode in plain for name in shown[mode]}
    informative = {
        mode for mode in modes if shown[mode] and (mode in plain or shown[mode] - plainly)
    }
    return [trial for trial in menu if trial.mode in informative]


def propose_among(
    left: Sequence[Remaining],
    setting: Setting,
    menu: Sequence[ProposedRun],
    progress: Progress = lambda text: None,
) -> Proposal | None:
    """Return the runs that say best which of some hypotheses is true; None where none does.

    Args:
        left: the hypotheses that remain.
        setting: rig and rules.
        menu: the runs that the bench can make.
        progress: called at each stage.
    """
    pairs = [
        (i, j)
        for i, j in permutations(range(len(left)), 2)
        if left[i].weight > 0 and not left[j].hidden and not _already(left[i], left[j], setting)
    ]
    if not pairs or not menu:
        return None
    progress(f"predict {len(menu)} runs by each of {len(left)} hypotheses that remain")
    closer = _promising(Predicted(left, setting, menu, _BEGIN_S), pairs)
    if not closer:
        return None
    progress(f"refit the alternatives in {len(closer)} of them")
    return _Adapted(Predicted(left, setting, closer), pairs).best()


def _already(truth: Remaining, alternative: Remaining, setting: Setting) -> bool:
    """Return whether the runs that exist reject an alternative if another hypothesis is true."""
    total, seconds = alternative.behind(truth)
    return total / setting.repeats > _least(truth, alternative, setting, seconds, 0, 0.0)


def _least(
    truth: Remaining,
    alternative: Remaining,
    setting: Setting,
    seconds: Array,
    more: int,
    gain: float,
) -> float:
    """Return the gain that rejects an alternative, in all runs, as `decide` has it.

    Args:
        truth: what is taken as true.
        alternative: that is to be rejected.
        setting: with the rules.
        seconds: (b,) gains of all seconds.
        more: samples that the runs would add.
        gain: expected of those; it scatters by twice its root.
    """
    rules = setting.rules
    if not truth.names:
        return -rules.suspected  # a cause always fits better than none; it must gain little
    each = seconds / setting.repeats
    scatter = float(np.sqrt(np.var(each) * len(each) + 4 * gain))
    if not alternative.names:
        size = rules.size * (setting.samples + more) / setting.repeats
        return max(rules.least_gain, size, rules.sure * scatter)
    return setting.strict * max(rules.suspected, rules.apart * scatter)


def _promising(predicted: Predicted, pairs: Sequence[tuple[int, int]]) -> list[ProposedRun]:
    """Return the trials that may separate most each minute, of each mode in turn.

    Alternatives that do not adapt lie farther apart than those that do: more cannot be separated.
    """
    if not predicted.menu:
        return []
    menu, apart = predicted.menu, predicted.apart(pairs)
    scores = {
        t: (min(row) / minutes_of([menu[t]]), float(np.median(row)))
        for t, row in enumerate(apart)
        if max(row) > _SILENT
    }
    order = sorted(scores, key=lambda t: scores[t], reverse=True)
    modes = list(dict.fromkeys(menu[t].mode for t in order))
    queues = [[t for t in order if menu[t].mode == mode] for mode in modes]
    turns = [t for turn in zip_longest(*queues) for t in turn if t is not None]
    return [menu[t] for t in turns[:_CLOSER]]


class _Adapted:
    """Trials under the diagnosis' own rule, what remains adapted to them in one linearisation.

    Args:
        predicted: the trials that are looked at closer.
        pairs: numbers of what is taken as true and of its alternative.
    """

    def __init__(self, predicted: Predicted, pairs: Sequence[tuple[int, int]]) -> None:
        self.predicted, self.pairs = predicted, list(pairs)
        self.setting, self.left = predicted.setting, predicted.left
        self.slopes: dict[int, Array] = {}
        self.residuals: dict[tuple[int, int], list[Array]] = {}
        for i, j in dict.fromkeys([*((i, i) for i, _ in pairs), *pairs]):
            estimator, x = predicted.estimator(j, i)
            left = estimator.residuals(x)
            self.residuals[i, j] = predicted.parts(left, predicted.systems[i])
            if j not in self.slopes:
                own, x = predicted.estimator(j, j)
                self.slopes[j] = own.jacobian(x)
        self.vectors = {j: predicted.estimator(j, j)[0].vector for j in self.slopes}

    def best(self) -> Proposal | None:
        """Return the trials that reject most each minute; more are added while that pays."""
        chosen: list[int] = []
        most, found = 0.0, None
        count = len(self.predicted.menu)
        while len(chosen) < min(_MOST_RUNS, count):
            options = {k: self._proposal([*chosen, k]) for k in range(count) if k not in chosen}
            best = max(options, key=lambda k: (options[k].chance / options[k].minutes, -k))
            value = options[best].chance / options[best].minutes
            if value <= most:
                break
            found, most = options[best], value
            chosen.append(best)
        return found if found is not None and found.chance >= LEAST_CHANCE else None

    def _proposal(self, chosen: list[int]) -> Proposal:
        """Return what some of the trials are expected to show."""
        separations, shares = [], np.zeros(len(self.left))
        own = {i: self._cost(i, i, chosen) for i in {first for first, _ in self.pairs}}
        for i, j in self.pairs:
            truth, alternative = self.left[i], self.left[j]
            gain, chance = self._chance(i, j, chosen, own[i])
            distance = min(float(np.sqrt(gain)), FURTHEST)
            separations.append(Separation(truth.name, alternative.name, distance, chance))
            shares[i] += chance / sum(first == i for first, _ in self.pairs)
        trials = tuple(self.predicted.menu[k] for k in chosen)
        separations.sort(key=lambda one: one.distance)
        chance = float(shares @ [one.weight for one in self.left])
        return Proposal(trials, minutes_of(TIMES * trials), tuple(separations), chance)

    def _chance(
        self, i: int, j: int, chosen: list[int], own: tuple[float, Array]
    ) -> tuple[float, float]:
        """Return the gain that trials are expected to bring, and the chance that one falls.

        Of a gain that noise without misfit makes zero, r' r with residuals r of unit noise, the
        variance is four times itself.
        """
        setting, truth, alternative = self.setting, self.left[i], self.left[j]
        cost, seconds = self._cost(i, j, chosen)
        gain = max(cost - own[0], _SILENT) / setting.repeats
        before, every = alternative.behind(truth)
        every = np.concatenate([every, *([seconds - own[1]] * TIMES)])
        more = TIMES * sum(self.residuals[i, i][k].size for k in chosen)
        least = _least(truth, alternative, setting, every, more, gain)
        margin = before / setting.repeats + gain - least
        return gain, float(scipy.stats.norm.cdf(margin / np.sqrt(4 * gain)))

    def _cost(self, i: int, j: int, chosen: list[int]) -> tuple[float, Array]:
        """Return by how much a hypothesis j costs more once trials show what i predicts.

        Its numbers move within what the runs that exist allow, those of a run within their priors.

        Returns:
            The cost of all `TIMES` runs of each trial, and that of each second of one, (b,).
        """
        vector, sample_s = self.vectors[j], Hopper.sample_s
        shared = vector.shared
        columns = [
            k
            for k, p in enumerate(vector.parameters)
            if p.scope is not Scope.RUN or p.run in chosen
        ]
        parts = self.residuals[i, j]
        ends = np.cumsum([0, *(part.size for part in parts)])
        rows = np.concatenate([np.arange(ends[k], ends[k + 1]) for k in chosen])
        slopes = self.slopes[j][rows][:, columns]
        before = np.concatenate([parts[k].ravel() for k in chosen])
        allowed = np.eye(len(columns)) * TIMES
        allowed[: len(shared), : len(shared)] = self.left[j].within(shared)
        move, now = np.zeros(len(columns)), before
        for _ in range(_ROUNDS):
            trust = TIMES * weights(now, ROBUST)
            curvature = slopes.T @ (slopes * trust[:, None]) + allowed
            move = -np.linalg.solve(curvature, slopes.T @ (trust * before))
            now = before + slopes @ move
        seconds, begin = list[float](), 0
        for k in chosen:
            left = now[begin : begin + parts[k].size].reshape(parts[k].shape)
            begin += parts[k].size
            costs = soft(left, ROBUST).sum(axis=1)
            edges = edges_of(len(costs), sample_s)
            seconds += [float(costs[a:b].sum()) for a, b in pairwise(edges)]
        cost = TIMES * sum(seconds) + float(move @ allowed @ move)
        return cost, np.array(seconds)
