"""What each hypothesis that remains predicts of runs that could be made, and how others see it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose import HopperRig, Rules
from workbench.fit import ROBUST, Estimator, Hopper, MeasuredRun, ParameterVector, soft
from workbench.investigate.hypothetical import hypothetical_runs
from workbench.investigate.proposed import ProposedRun
from workbench.investigate.remaining import Remaining

__all__ = ["Predicted", "Setting"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Setting:
    """What a proposal is judged in.

    Args:
        rig: with the runs that exist, of a base and candidates that the menu's modes have too.
        rules: of the diagnosis.
        repeats: how often the innovations repeat one another.
        samples: that the fitted runs have, of all channels.
        strict: times the thresholds by which an alternative is to be rejected.
        threads: of the simulation; 0 takes all cores.
    """

    rig: HopperRig
    rules: Rules
    repeats: float = 1.0
    samples: int = 0
    strict: float = 1.0
    threads: int = 0


class Predicted:
    """What each hypothesis that remains predicts of each trial.

    Args:
        left: the hypotheses.
        setting: rig and rules.
        menu: the trials; those that some hypothesis cannot make are left out.
        longest: how much of each is predicted [s].
    """

    def __init__(
        self,
        left: Sequence[Remaining],
        setting: Setting,
        menu: Sequence[ProposedRun],
        longest: float = np.inf,
    ) -> None:
        self.left, self.setting = left, setting
        rig, made = setting.rig, list[list[MeasuredRun | None]]()
        begun = [replace(one, duration=min(one.duration, longest)) for one in menu]
        for one in left:
            empty = rig.system([], one.parameters)
            robot = empty.robot_with({p: one.values[p.name] for p in one.parameters})
            made.append(hypothetical_runs(robot, begun, rig.measured, setting.threads))
        whole = [t for t in range(len(menu)) if all(runs[t] is not None for runs in made)]
        self.menu = [menu[t] for t in whole]
        self.runs = [[run for t in whole if (run := runs[t]) is not None] for runs in made]
        self.systems = [self._refined(i) for i in range(len(left))] if whole else []

    def estimator(self, j: int, i: int, like: Hopper | None = None) -> tuple[Estimator, Array]:
        """Return the estimator of j for the runs that i predicts, and its numbers, (p,) [1]."""
        setting, one = self.setting, self.left[j]
        rig = setting.rig.with_runs(self.runs[i])
        first = len(setting.rig.measured)
        numbers = range(first, first + len(self.menu))
        system = rig.system(numbers, one.parameters, like or self.systems[i])
        vector = ParameterVector(system.parameters)
        x = vector.named(one.values)
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
        """Return the residuals of each trial, (n, c) each [1].

        Args:
            residuals: (m,) of all [1].
            system: that observed them.
        """
        shapes = [system.seen(k).shape for k in range(len(self.menu))]
        ends = np.cumsum([0, *(n * c for n, c in shapes)])
        return [
            residuals[a:b].reshape(shape)
            for (a, b), shape in zip(pairwise(map(int, ends)), shapes, strict=True)
        ]

    def apart(self, pairs: Sequence[tuple[int, int]]) -> list[list[float]]:
        """Return the gain of each pair without adapting, by trial, in coarse steps."""
        found: list[list[float]] = [[] for _ in self.menu]
        for i in dict.fromkeys(i for i, _ in pairs):
            own, x = self.estimator(i, i)
            exact = own.residuals(x)
            coarse = own.coarse(x)
            whole = self.parts(exact, self.systems[i])
            count = sum(part.size for part in whole)
            defect = (exact - coarse)[:count]
            before = [float(np.sum(soft(part, ROBUST))) for part in whole]
            for j in (j for first, j in pairs if first == i):
                alternative, x = self.estimator(j, i)
                cheap = alternative.coarse(x)[:count] + defect
                for t, part in enumerate(self.parts(cheap, self.systems[i])):
                    found[t].append(abs(float(np.sum(soft(part, ROBUST))) - before[t]))
        return found
