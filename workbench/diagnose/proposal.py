"""The next experiment: of all runs that a bench can make, those that tell best what still remains.

Each hypothesis that remains predicts each run, and the observer of every other judges what is
predicted. As far as that other still misses it, its base, its own quantities and what belongs to
the run adapted within what the runs that exist allow, the run tells them apart (T-optimality:
Atkinson and Fedorov, Biometrika 62, 1975, p. 57). The rule is the diagnosis' own, so a run is worth
the chance that it rejects rivals, for each minute that it takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, permutations, zip_longest
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose.engine import Diagnosis
from workbench.diagnose.hypothetical import hypothetical_runs
from workbench.diagnose.linear import edges_of
from workbench.diagnose.remaining import BEYOND, Remaining, remaining
from workbench.diagnose.rig import Trial
from workbench.diagnose.rigs import HopperRig
from workbench.diagnose.rules import Rules
from workbench.fit import Estimator, Hopper, MeasuredRun, ParameterVector, Scope
from workbench.fit.estimator import ROBUST
from workbench.fit.minimise import soft
from workbench.progress import Progress

__all__ = ["TIMES", "Proposal", "Separation", "Setting", "minutes_of", "propose", "propose_among"]

Array = NDArray[np.float64]

HANDLING_S = {"clamped": 60.0, "decay": 90.0, "hop": 90.0, "drop": 90.0}
"""Mode -> time that a run costs besides itself: export, weight or start line, until all is still.
Assumed, not measured; a mode that is not named takes the first."""
SET_UP_S = {"clamped": 180.0, "decay": 180.0}
"""Mode -> time to clamp the foot, once for all runs of a protocol."""

TIMES = 2
"""How often a proposed run is to be made: what one run alone shows is not named."""

_CLOSER = 5  # trials whose rivals are allowed to adapt; that takes a simulation for each number
_MOST_RUNS = 3  # in one proposal
_LEAST_CHANCE = 0.1  # of rejecting a rival: a proposal below it is none
_FURTHEST = 100.0  # noise deviations: farther than that no linearisation predicts how far
_SILENT = 1e-6  # of the gain: what two rivals predict alike
_ROUNDS = 4  # of the robust weights in one linearisation


@dataclass(frozen=True)
class Separation:
    """What a proposal is expected to tell if one hypothesis is true.

    Args:
        truth: what is taken as true.
        rival: what is refitted to it.
        distance: that remains between the two predictions, in noise deviations of all samples; 100
            means that or more, for a linearisation predicts no farther.
        chance: that the next diagnosis rejects the rival.
    """

    truth: str
    rival: str
    distance: float
    chance: float


@dataclass(frozen=True)
class Proposal:
    """Runs that should be made next.

    Args:
        trials: the runs; each is to be made `TIMES` times.
        minutes: that all of it takes on a bench.
        separations: of each pair that they could tell apart, the hardest first.
        chance: that they reject a rival of what is true.
    """

    trials: tuple[Trial, ...]
    minutes: float
    separations: tuple[Separation, ...]
    chance: float

    def as_json(self) -> dict[str, Any]:
        """Return runs, minutes and what is expected of them."""
        return {
            "runs": [{"mode": one.mode, "amount": one.amount} for one in self.trials],
            "minutes": self.minutes,
            "chance": round(self.chance, 4),
            "separations": [
                {"truth": one.truth, "rival": one.rival, "distance": round(one.distance, 3),
                 "chance": round(one.chance, 4)}
                for one in self.separations
            ],
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class Setting:
    """What a proposal is judged in.

    Args:
        rig: with the runs that exist, of a base and candidates that the menu's modes have too.
        rules: of the diagnosis.
        repeats: how often the innovations repeat one another.
        samples: that the fitted runs have, of all channels.
        strict: times the thresholds by which a rival is to be rejected.
        threads: of the simulation; 0 takes all cores.
    """

    rig: HopperRig
    rules: Rules
    repeats: float = 1.0
    samples: int = 0
    strict: float = 1.0
    threads: int = 0


def minutes_of(trials: Sequence[Trial]) -> float:
    """Return how long runs take on a bench, with the handling that each needs [min]."""
    usual = next(iter(HANDLING_S.values()))
    runs = sum(one.rest + one.duration + HANDLING_S.get(one.mode, usual) for one in trials)
    set_up = max((SET_UP_S.get(one.mode, 0.0) for one in trials), default=0.0)
    return (runs + set_up) / 60


def propose(
    found: Diagnosis, menu: Sequence[Trial], tell: Progress = lambda text: None
) -> Proposal | None:
    """Return the runs that tell best, each minute, what a diagnosis leaves.

    Args:
        found: the diagnosis.
        menu: the runs that the bench can make.
        tell: is told each stage.

    Returns:
        None where at most one hypothesis remains, where the rig cannot tell what other runs would
        show, or where no run on the menu separates what remains.
    """
    if not isinstance(found.rig, HopperRig) or not menu:
        return None
    part, fits = found.parts["observer"], found.fits
    strict = BEYOND if part.kind in ("NAMED", "PARTIAL") else 1.0
    rig = found.rig.with_modes({trial.mode for trial in menu})
    setting = Setting(rig, found.rules, fits.repeats(), fits.samples(), strict, fits.threads)
    return propose_among(remaining(found, rig), setting, menu, tell)


def propose_among(
    left: Sequence[Remaining],
    setting: Setting,
    menu: Sequence[Trial],
    tell: Progress = lambda text: None,
) -> Proposal | None:
    """Return the runs that tell best which of some hypotheses is true; None where none does.

    Args:
        left: the hypotheses that remain.
        setting: rig and rules.
        menu: the runs that the bench can make.
        tell: is told each stage.
    """
    pairs = [
        (i, j)
        for i, j in permutations(range(len(left)), 2)
        if left[i].weight > 0 and not left[j].hidden
        and not _already(left[i], left[j], setting)
    ]  # fmt: skip
    if not pairs:
        return None
    tell(f"predict {len(menu)} runs by each of {len(left)} hypotheses that remain")
    predicted = _Predicted(left, setting, menu)
    closer = predicted.promising(pairs)
    if not closer:
        return None
    tell(f"let the rivals adapt in {len(closer)} of them")
    return _Adapted(predicted.of(closer), pairs).best()


def _already(truth: Remaining, rival: Remaining, setting: Setting) -> bool:
    """Tell whether the runs that exist reject a rival if another hypothesis is true."""
    total, seconds = rival.behind(truth)
    return total / setting.repeats > _least(truth, rival, setting, seconds, 0, 0.0)


def _least(
    truth: Remaining, rival: Remaining, setting: Setting, seconds: Array, more: int, gain: float
) -> float:
    """Return the gain that rejects a rival, in all runs, as `decide` has it.

    Args:
        truth: what is taken as true.
        rival: that is to be rejected.
        setting: with the rules.
        seconds: (b,) gains of all seconds.
        more: samples that the runs would add.
        gain: expected of those; it scatters by twice its root.
    """
    rules = setting.rules
    if not truth.names:
        return -rules.suspected  # a cause always fits better than none; it must be worth little
    each = seconds / setting.repeats
    scatter = float(np.sqrt(np.var(each) * len(each) + 4 * gain))
    if not rival.names:
        size = rules.size * (setting.samples + more) / setting.repeats
        return max(rules.worth, size, rules.sure * scatter)
    return setting.strict * max(rules.suspected, rules.apart * scatter)


class _Predicted:
    """What each hypothesis that remains predicts of each trial.

    Args:
        left: the hypotheses.
        setting: rig and rules.
        menu: the trials; those that some hypothesis cannot make are left out.
        runs: of each hypothesis, each trial as a run; simulated where left out.
    """

    def __init__(
        self,
        left: Sequence[Remaining],
        setting: Setting,
        menu: Sequence[Trial],
        runs: Sequence[Sequence[MeasuredRun]] = (),
    ) -> None:
        self.left, self.setting, self.menu, self.runs = left, setting, list(menu), list(runs)
        if not runs:
            rig, made = setting.rig, []
            for one in left:
                empty = rig.system([], one.parameters)
                robot = empty.robot_with({p: one.values[p.name] for p in one.parameters})
                made.append(hypothetical_runs(robot, menu, rig.measured, setting.threads))
            whole = [t for t in range(len(menu)) if all(runs[t] is not None for runs in made)]
            self.menu = [menu[t] for t in whole]
            self.runs = [[run for t in whole if (run := runs[t]) is not None] for runs in made]
        self.systems = [self._refined(i) for i in range(len(left))]

    def of(self, trials: Sequence[int]) -> _Predicted:
        """Return the predictions of some of the trials."""
        runs = [[runs[t] for t in trials] for runs in self.runs]
        return _Predicted(self.left, self.setting, [self.menu[t] for t in trials], runs)

    def estimator(self, j: int, i: int, like: Hopper | None = None) -> tuple[Estimator, Array]:
        """Return the estimator of a hypothesis j for the runs that i predicts, and its numbers."""
        setting, one = self.setting, self.left[j]
        rig = setting.rig.with_runs(self.runs[i])
        first = len(setting.rig.measured)
        numbers = range(first, first + len(self.menu))
        system = rig.system(numbers, one.parameters, like or self.systems[i])
        vector = ParameterVector(system.parameters)
        x = np.array([p.number(one.values.get(p.name, p.nominal)) for p in vector.parameters])
        return Estimator.of(system, vector, one.noise, threads=setting.threads), x

    def _refined(self, i: int) -> Hopper:
        """Return the system of a hypothesis' own runs, T's turn taken out of the rotor's angle."""
        setting = self.setting
        first = len(setting.rig.measured)
        numbers = range(first, first + len(self.menu))
        plain = setting.rig.with_runs(self.runs[i]).system(numbers, self.left[i].parameters)
        estimator, x = self.estimator(i, i, plain)
        return plain.refined([one.qpos for one in estimator.innovations(x, keep=True)])

    def parts(self, residuals: Array, system: Hopper) -> list[Array]:
        """Return the residuals of each trial, (n, c) each."""
        shapes = [system.seen(k).shape for k in range(len(self.menu))]
        ends = np.cumsum([0, *(n * c for n, c in shapes)])
        return [
            residuals[a:b].reshape(shape)
            for (a, b), shape in zip(pairwise(map(int, ends)), shapes, strict=True)
        ]

    def promising(self, pairs: Sequence[tuple[int, int]]) -> list[int]:
        """Return the trials that may tell most each minute, of each mode in turn.

        Rivals that do not adapt lie farther apart than those that do, so this is what a trial could
        tell at best.
        """
        apart = self._apart(pairs)
        worth = {
            t: (min(row) / minutes_of([self.menu[t]]), float(np.median(row)))
            for t, row in enumerate(apart)
            if max(row) > _SILENT
        }
        order = sorted(worth, key=lambda t: worth[t], reverse=True)
        modes = list(dict.fromkeys(self.menu[t].mode for t in order))
        queues = [[t for t in order if self.menu[t].mode == mode] for mode in modes]
        turns = [t for turn in zip_longest(*queues) for t in turn if t is not None]
        return turns[:_CLOSER]

    def _apart(self, pairs: Sequence[tuple[int, int]]) -> list[list[float]]:
        """Return the gain of each pair without adapting, by trial, in coarse steps."""
        found: list[list[float]] = [[] for _ in self.menu]
        for i in dict.fromkeys(i for i, _ in pairs):
            own, x = self.estimator(i, i)
            exact = own.residuals(x)
            coarse = replace(own, defect=np.zeros(0)).residuals(x)
            count = sum(len(part.ravel()) for part in self.parts(exact, self.systems[i]))
            defect = (exact - coarse)[:count]
            before = [float(np.sum(soft(part, ROBUST))) for part in self.parts(exact, self.systems[i])]
            for j in (j for first, j in pairs if first == i):
                rival, x = self.estimator(j, i)
                cheap = replace(rival, defect=np.zeros(0)).residuals(x)[:count] + defect
                for t, part in enumerate(self.parts(cheap, self.systems[i])):
                    found[t].append(abs(float(np.sum(soft(part, ROBUST))) - before[t]))
        return found


class _Adapted:
    """Trials under the diagnosis' own rule, what remains adapted to them in one linearisation.

    Args:
        predicted: the trials that are looked at closer.
        pairs: numbers of what is taken as true and of its rival.
    """

    def __init__(self, predicted: _Predicted, pairs: Sequence[tuple[int, int]]) -> None:
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
        worth, found = 0.0, None
        count = len(self.predicted.menu)
        while len(chosen) < min(_MOST_RUNS, count):
            options = {k: self._proposal([*chosen, k]) for k in range(count) if k not in chosen}
            best = max(options, key=lambda k: (options[k].chance / options[k].minutes, -k))
            value = options[best].chance / options[best].minutes
            if value <= worth:
                break
            found, worth = options[best], value
            chosen.append(best)
        return found if found is not None and found.chance >= _LEAST_CHANCE else None

    def _proposal(self, chosen: list[int]) -> Proposal:
        """Return what some of the trials are expected to tell."""
        separations, shares = [], np.zeros(len(self.left))
        own = {i: self._cost(i, i, chosen) for i in {first for first, _ in self.pairs}}
        for i, j in self.pairs:
            truth, rival = self.left[i], self.left[j]
            gain, chance = self._chance(i, j, chosen, own[i])
            distance = min(float(np.sqrt(gain)), _FURTHEST)
            separations.append(Separation(truth.name, rival.name, distance, chance))
            shares[i] += chance / sum(first == i for first, _ in self.pairs)
        trials = tuple(self.predicted.menu[k] for k in chosen)
        separations.sort(key=lambda one: one.distance)
        chance = float(shares @ [one.weight for one in self.left])
        return Proposal(trials, minutes_of(TIMES * trials), tuple(separations), chance)

    def _chance(
        self, i: int, j: int, chosen: list[int], own: tuple[float, Array]
    ) -> tuple[float, float]:
        """Return the gain that trials are expected to bring, and the chance that a rival falls.

        Of a gain that noise without misfit makes zero, r' r with residuals r of unit noise, the
        variance is four times itself.
        """
        setting, truth, rival = self.setting, self.left[i], self.left[j]
        cost, seconds = self._cost(i, j, chosen)
        gain = max(cost - own[0], _SILENT) / setting.repeats
        before, every = rival.behind(truth)
        every = np.concatenate([every, *([seconds - own[1]] * TIMES)])
        more = TIMES * sum(self.residuals[i, i][k].size for k in chosen)
        least = _least(truth, rival, setting, every, more, gain)
        margin = before / setting.repeats + gain - least
        return gain, float(scipy.stats.norm.cdf(margin / np.sqrt(4 * gain)))

    def _cost(self, i: int, j: int, chosen: list[int]) -> tuple[float, Array]:
        """Return by how much a hypothesis j costs more once trials show what i predicts.

        Its numbers move within what the runs that exist allow, those of a run within their priors.

        Returns:
            The cost of all `TIMES` runs of each trial, and that of each second of one, (b,).
        """
        vector, sample_s = self.vectors[j], Hopper.sample_s
        shared = [p for p in vector.parameters if p.scope is not Scope.RUN]
        columns = [
            k for k, p in enumerate(vector.parameters)
            if p.scope is not Scope.RUN or p.run in chosen
        ]  # fmt: skip
        parts = self.residuals[i, j]
        ends = np.cumsum([0, *(part.size for part in parts)])
        rows = np.concatenate([np.arange(ends[k], ends[k + 1]) for k in chosen])
        slopes, before = self.slopes[j][np.ix_(rows, columns)], np.concatenate(
            [parts[k].ravel() for k in chosen]
        )  # fmt: skip
        allowed = np.eye(len(columns)) * TIMES
        allowed[: len(shared), : len(shared)] = self.left[j].within(shared)
        move, now = np.zeros(len(columns)), before
        for _ in range(_ROUNDS):
            weights = TIMES / np.sqrt(1 + (now / ROBUST) ** 2)
            curvature = slopes.T @ (slopes * weights[:, None]) + allowed
            move = -np.linalg.solve(curvature, slopes.T @ (weights * before))
            now = before + slopes @ move
        seconds, begin = list[float](), 0
        for k in chosen:
            left = now[begin : begin + parts[k].size].reshape(parts[k].shape)
            begin += parts[k].size
            costs = soft(left, ROBUST).sum(axis=1)
            seconds += [float(costs[a:b].sum()) for a, b in pairwise(edges_of(len(costs), sample_s))]
        cost = TIMES * sum(seconds) + float(move @ allowed @ move)
        return cost, np.array(seconds)
