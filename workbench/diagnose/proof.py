"""The gain of an extension, on runs that no fit has seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.answer import NOTHING_LEFT
from workbench.diagnose.layout import Layout
from workbench.diagnose.minimum import Prior
from workbench.diagnose.noise import Noise
from workbench.diagnose.problem import Problem
from workbench.diagnose.rig import Rig
from workbench.diagnose.solve import fit

__all__ = ["HARM", "MOST", "Errors", "Proof", "errors_of"]

HARM = 0.02
"""Of an error: thousands of samples do not err by so much more by chance."""
MOST = 0.5
"""Of the removable error: an extension that removes less does not make up for it."""

_MM = 1000.0


@dataclass(frozen=True, eq=False)
class Errors:
    """How far runs are from their prediction [mm], or in the channels' own unit where none is one.

    Args:
        by_run: root mean square by run.
        noise_floor: what the noise of the cameras makes of it.
        unit: of both.
        predicted: by run, (n, c) in the channels' units.
        values: by run, what it was predicted from, by name.
    """

    by_run: dict[str, float]
    noise_floor: float
    unit: str
    predicted: Mapping[str, NDArray[np.float64]]
    values: Mapping[str, Mapping[str, float]]

    @property
    def rmse(self) -> float:
        """Return the root mean square over all runs."""
        return float(np.sqrt(np.mean(np.square(list(self.by_run.values())))))


@dataclass(frozen=True, eq=False)
class Proof:
    """Base and extended model on the runs held out."""

    base: Errors
    extended: Errors

    @property
    def harms(self) -> bool:
        """Tell whether the extension errs clearly more than the base."""
        return self.extended.rmse > (1 + HARM) * self.base.rmse

    @property
    def size(self) -> float:
        """Return how much of what is held out the extension explains, in noise deviations."""
        explained = max(self.base.rmse**2 - self.extended.rmse**2, 0.0)
        return float(np.sqrt(explained)) / self.base.noise_floor

    @property
    def removed(self) -> float:
        """Return the share of the removable error that the extension removes."""
        removable = self.base.rmse - self.base.noise_floor
        if removable <= 0:
            return 0.0
        return float(np.clip((self.base.rmse - self.extended.rmse) / removable, -1.0, 1.0))

    @property
    def adequate(self) -> bool:
        """Tell whether the extension makes up for most of the misfit, or leaves next to none."""
        little = float(np.hypot(1, NOTHING_LEFT)) * self.base.noise_floor
        return self.removed >= MOST or self.extended.rmse <= little


def errors_of(
    rig: Rig,
    noise: Sequence[Noise],
    runs: Sequence[int],
    z: NDArray[np.float64] | None = None,
) -> Errors:
    """Return how far runs are from what a rig predicts.

    Only what a run keeps to itself (its start, its markers' places) is fitted to the run.

    Args:
        rig: with its runs.
        noise: by run.
        runs: that are judged.
        z: (u,) scaled unknowns; None takes the rig as it stands.
    """
    layout = Layout(rig)
    problem = Problem(rig, layout, noise, runs)
    prior = Prior(np.ones(len(layout)), np.flatnonzero(np.isin(layout.run, runs)))
    begin = np.zeros(len(layout)) if z is None else z
    problem.look_again(begin)
    found = fit(problem, begin, prior)
    predictions = problem.predictions(found.z)
    names = [rig.runs[k].name for k in runs]
    by_run, floors, units = {}, [], set()
    for k, predicted in zip(runs, predictions, strict=True):
        run = rig.runs[k]
        lengths = np.array([unit == "m" for unit in run.units])
        chosen = lengths if lengths.any() else np.ones(len(lengths), dtype=bool)
        scale = _MM if lengths.any() else 1.0
        seen = problem.seen[k][:, chosen]
        apart = (run.values - predicted)[:, chosen][seen]
        by_run[run.name] = scale * float(np.sqrt(np.mean(apart**2)))
        floors.append(scale * float(np.sqrt(np.mean(noise[k].sigma[chosen] ** 2))))
        units |= {"mm"} if lengths.any() else set(run.units)
    return Errors(
        by_run,
        float(np.sqrt(np.mean(np.square(floors)))),
        " and ".join(sorted(units)),
        dict(zip(names, predictions, strict=True)),
        {name: layout.values(found.z, k) for name, k in zip(names, runs, strict=True)},
    )
