"""The next experiment: of all runs that a bench can make, those that tell best what still stands.

Each cause that stands foretells each run. As far as the others, adapting base, own numbers, their
own quantities and all clutter within what the runs that exist allow, still miss it, the run tells
them apart (T-optimality: Atkinson and Fedorov, Biometrika 62, 1975, p. 57). The rule that judges is
the diagnosis' own, taken in the neighbourhood of each fit, so a run is worth the chance that it
dismisses rivals, for each minute that it takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations, zip_longest

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose.diagnosis import Diagnosis
from workbench.diagnose.layout import Layout
from workbench.diagnose.noise import Noise, whitened
from workbench.diagnose.problem import Linear, Problem
from workbench.diagnose.proposed import TIMES, Proposal, Separation, minutes_of
from workbench.diagnose.rig import Experimental, Observed, Rig, Trial
from workbench.diagnose.screen import Neighbourhood
from workbench.diagnose.solve import renewed
from workbench.diagnose.standing import names_standing, still_standing
from workbench.progress import Progress

__all__ = ["TIMES", "Proposal", "Separation", "minutes_of", "propose"]


_CLOSER = 5  # trials whose rivals are allowed to adapt; that takes a simulation for each unknown
_MOST_RUNS = 3  # in one proposal
_LEAST_CHANCE = 0.1  # of dismissing a rival: a proposal below it is none
_FURTHEST = 100.0  # noise deviations: farther than that no neighbourhood foretells how far
_SILENT = 1e-9  # of the cost: what two rivals foretell alike


def propose(
    found: Diagnosis, menu: Sequence[Trial], tell: Progress = lambda text: None
) -> Proposal | None:
    """Return the runs that tell best, each minute, what a diagnosis leaves standing.

    Args:
        found: the diagnosis.
        menu: the runs that the bench can make.
        tell: is told each stage.

    Returns:
        None where at most one cause stands, where the rig cannot tell what other runs would show,
        or where no run on the menu separates what stands.
    """
    if not isinstance(found.rig, Experimental):
        return None
    menu = _telling(found, found.rig, menu)
    if not menu:
        return None
    foretold = _Foretold(found, found.rig.with_trials(menu), menu)
    if len(foretold.standing) < 2:
        return None
    tell(f"foretell {len(menu)} runs by each of {len(foretold.standing)} that stand")
    closer = foretold.promising()
    if not closer:
        return None
    tell(f"let the rivals adapt in {len(closer)} of them")
    return _Judged(foretold, closer).best()


def _telling(found: Diagnosis, rig: Experimental, menu: Sequence[Trial]) -> list[Trial]:
    """Return the trials of modes that can tell.

    A mode that brings numbers nobody has fitted yet, as the ground does, is dear to simulate and
    says little of what other modes show as well; it counts where a cause shows in no other.
    """
    modes = {trial.mode: trial for trial in menu}
    every = rig.with_trials(list(modes.values()))
    names = names_standing(found, Layout(every))
    standing = [cause for cause in every.causes if cause.name in names]
    shown = {
        mode: {one.name for one in standing if not one.shows_in or mode in one.shows_in}
        for mode in modes
    }
    plain = {m for m, trial in modes.items() if len(rig.with_trials([trial]).base) == len(rig.base)}
    plainly = {name for mode in plain for name in shown[mode]}
    telling = {mode for mode in modes if shown[mode] and (mode in plain or shown[mode] - plainly)}
    return [trial for trial in menu if trial.mode in telling]


class _Foretold:
    """What each that stands foretells of each trial."""

    def __init__(self, found: Diagnosis, rig: Rig, menu: Sequence[Trial]) -> None:
        self.rig, self.menu, self.layout = rig, menu, Layout(rig)
        self.first = len(found.rig.runs)
        self.noise = [*found.noise, *_noise_of_trials(found, rig.runs[self.first :])]
        self.standing = still_standing(found, self.layout)
        self.pairs = [
            (i, j)
            for i, j in permutations(range(len(self.standing)), 2)
            if self.standing[i].weight > 0 and not self.standing[j].unseen
        ]

    def problem(self, trials: Sequence[int]) -> Problem:
        """Return the problem of some trials, as if they had been measured as zero."""
        runs = [self.first + t for t in trials]
        return Problem(self.rig, self.layout, self.noise, runs)

    def promising(self) -> list[int]:
        """Return the trials that may tell most each minute, of each mode in turn.

        Rivals that do not adapt lie farther apart than those that do, so this is what a trial could
        tell at best.
        """
        apart = self._apart()
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

    def _apart(self) -> list[list[float]]:
        """Return half the squared distance of each pair's predictions, by trial; one batch."""
        asked = [
            (self.first + t, self.layout.values(one.z, self.first + t))
            for t in range(len(self.menu))
            for one in self.standing
        ]
        paths = iter(self.rig.predict(asked))
        found: list[list[float]] = []
        for t in range(len(self.menu)):
            run, noise = self.rig.runs[self.first + t], self.noise[self.first + t]
            told = [whitened(next(paths), run.valid, noise) for _ in self.standing]
            found.append([float(np.sum((told[i] - told[j]) ** 2)) / 2 for i, j in self.pairs])
        return found


class _Judged:
    """Trials under the diagnosis' own rule: all that stand refitted, in the neighbourhood of each.

    Args:
        foretold: with all that stand.
        trials: that are looked at closer.
    """

    def __init__(self, foretold: _Foretold, trials: Sequence[int]) -> None:
        self.foretold, self.trials = foretold, list(trials)
        self.near = self._neighbourhoods()

    def best(self) -> Proposal | None:
        """Return the trials that dismiss most each minute; more are added while that pays."""
        chosen: list[int] = []
        worth, found = 0.0, None
        while len(chosen) < min(_MOST_RUNS, len(self.trials)):
            options = [self._proposal([*chosen, k]) for k in range(len(self.trials))
                       if k not in chosen]  # fmt: skip
            best, k = max(((p.chance / p.minutes, -n) for n, (p, _) in enumerate(options)))
            if best <= worth:
                break
            found, added = options[-k]
            chosen.append(added)
            worth = best
        return found if found is not None and found.chance >= _LEAST_CHANCE else None

    def _neighbourhoods(self) -> list[Linear]:
        """Return the trials around each that stands; only its own quantities' columns are anew."""
        foretold, layout = self.foretold, self.foretold.layout
        problem = foretold.problem(self.trials)
        own = [layout.own(foretold.first + t) for t in self.trials]
        columns = np.concatenate([layout.shared, *own])
        first = problem.linear(foretold.standing[0].z, columns)
        rest = [
            renewed(problem, one.z, layout.quantities(one.causes), np.inf, first)
            for one in foretold.standing[1:]
        ]
        return [first, *rest]

    def _proposal(self, chosen: list[int]) -> tuple[Proposal, int]:
        """Return what some of the trials are expected to tell, and the last of them."""
        standing = self.foretold.standing
        separations, shares = [], np.zeros(len(standing))
        costs = {i: self._cost(i, i, chosen) for i in {first for first, _ in self.foretold.pairs}}
        for i, j in self.foretold.pairs:
            truth, rival = standing[i], standing[j]
            own, other = costs[i], self._cost(i, j, chosen)
            gained = max(other - own - (rival.cost - truth.cost), _SILENT)
            margin = other - own - rival.beaten_by(truth)
            chance = float(scipy.stats.norm.cdf(margin / np.sqrt(2 * gained)))
            separations.append(
                Separation(
                    truth.name, rival.name, min(float(np.sqrt(2 * gained)), _FURTHEST), chance
                )
            )
            shares[i] += chance / sum(first == i for first, _ in self.foretold.pairs)
        trials = tuple(self.foretold.menu[self.trials[k]] for k in chosen)
        separations.sort(key=lambda one: one.distance)
        chance = float(shares @ [one.weight for one in standing])
        minutes = minutes_of(TIMES * trials)
        return Proposal(trials, minutes, tuple(separations), chance), chosen[-1]

    def _cost(self, i: int, j: int, chosen: list[int]) -> float:
        """Return the lowest cost of one that stands once trials showed what another foretells."""
        rival = self.foretold.standing[j]
        here, there = self.near[j], self.near[i]
        slopes = (rival.known.slopes[0], *(here.slopes[k] for k in chosen))
        residuals = [
            rival.known.residuals[0],
            *(here.residuals[k] - there.residuals[k] for k in chosen),
        ]
        runs = (-1, *(self.trials[k] for k in chosen))
        samples = rival.samples + sum(len(here.residuals[k]) for k in chosen)
        linear = Linear(rival.z, runs, residuals, slopes)
        return Neighbourhood(self.foretold.layout, linear, samples).lowest(rival.causes)


def _noise_of_trials(found: Diagnosis, trials: Sequence[Observed]) -> list[Noise]:
    """Return the noise that runs will have: that of each channel, or of the worst in its unit.

    A channel of a unit that no run has seen says nothing: nobody knows its noise.
    """
    known: dict[str, tuple[float, float]] = {}
    worst: dict[str, tuple[float, float]] = {}
    for run, noise in zip(found.rig.runs, found.noise, strict=True):
        rows = zip(run.channels, run.units, noise.sigma, noise.memory, strict=True)
        for channel, unit, sigma, memory in rows:
            known[channel] = (float(sigma), float(memory))
            worst[unit] = max(worst.get(unit, known[channel]), known[channel])
    return [_noise_of_trial(trial, known, worst) for trial in trials]


def _noise_of_trial(
    trial: Observed,
    known: dict[str, tuple[float, float]],
    worst: dict[str, tuple[float, float]],
) -> Noise:
    pairs: list[tuple[float, float]] = []
    for channel, unit in zip(trial.channels, trial.units, strict=True):
        pairs.append(known.get(channel) or worst.get(unit, (np.inf, 0.0)))
    found: NDArray[np.float64] = np.array(pairs)
    return Noise(found[:, 0], found[:, 1])
