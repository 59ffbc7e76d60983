"""What a diagnosis asks of a mechanical system, and the hopping robot as one.

A rig knows its runs, the numbers of its model that may be off within their tolerance, and the
candidates. It offers some of its runs as a system that can be fitted.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from workbench.bundle import Bundle
from workbench.data_quality import Facts, Fault, Recorded, hopper_faults
from workbench.diagnose.candidates import Candidate, hopper_candidates
from workbench.diagnose.extension import Effects, write_extension
from workbench.diagnose.rules import RULES, Rules
from workbench.diagnose.validate import Errors, errors_of
from workbench.fit import (
    FINER,
    Hopper,
    MeasuredRun,
    Parameter,
    System,
    coloured_noise,
    measured_runs,
    paced,
    parameters_within_tolerance,
    same_robot,
)
from workbench.progress import Progress
from workbench.schemas import UNITS, Document, ModelFile, ShapeFile
from workbench.sim import make_robot

__all__ = ["HopperRig", "Rig", "robot_of"]

Array = NDArray[np.float64]
_WARMTH = 1e-3  # share of the stiffness: aluminium's falls by about 5e-4 a degree


class Rig(Recorded, Protocol):
    """A mechanical system, its runs, and what may be other than its model says."""

    @property
    def name(self) -> str:
        """Return what to call it."""
        ...

    @property
    def rules(self) -> Rules:
        """Return the numbers that decide."""
        ...

    @property
    def source(self) -> Path:
        """Return the file of the model."""
        ...

    @property
    def names(self) -> Sequence[str]:
        """Return the names of the runs."""
        ...

    @property
    def roles(self) -> Sequence[str]:
        """Return the role of each run."""
        ...

    @property
    def base(self) -> Sequence[Parameter]:
        """Return the numbers of the model with their tolerances."""
        ...

    @property
    def candidates(self) -> Sequence[Candidate]:
        """Return what may explain a misfit."""
        ...

    @property
    def whole(self) -> float:
        """Return how many times the noise a free simulation of a whole model may be off."""
        ...

    def repeats(self) -> float:
        """Return how often innovations repeat one another; 1 where they are white."""
        ...

    def system(
        self, runs: Sequence[int], parameters: Sequence[Parameter], like: System | None = None
    ) -> System:
        """Return some runs as a system.

        Args:
            runs: their numbers.
            parameters: of the model and of candidates that are fitted.
            like: a system of the same runs whose inputs are taken over.
        """
        ...

    def finer(self) -> Rig | None:
        """Return the rig with a finer mesh, to be tried beside its own, if there is one."""
        ...

    def extend(
        self, path: Path, values: Mapping[str, float], effects: Effects, diagnosis: str
    ) -> Rig:
        """Write the model with other values and more effects, and return what is read back of it.

        Args:
            path: of the new file, without its ending.
            values: of the model's own numbers, SI.
            effects: that were found.
            diagnosis: name of what they came from.
        """
        ...

    def errors(
        self,
        runs: Sequence[int],
        values: Mapping[str, float] | None,
        angles: Sequence[Array | None] | None,
        threads: int = 0,
    ) -> Errors | None:
        """Return how far some runs are from what the model predicts; None of none.

        Args:
            runs: their numbers.
            values: of the model's own numbers, where they are not those of its file.
            angles: (n,) of each run, how its drive turns [rad]; as it was seen where left out.
            threads: 0 takes all cores.
        """
        ...


class HopperRig:
    """The robot of one model and shape with some runs of it.

    Args:
        runs: measured, of one robot.
        document: the model file; its effects stay as they are.
        shape: of the beam.
        modes: of runs that may be made, besides those of the runs.
        increments: of the beam; None takes those of the model.
    """

    def __init__(
        self,
        runs: Sequence[MeasuredRun],
        document: Document[ModelFile],
        shape: ShapeFile,
        modes: Collection[str] = (),
        increments: int | None = None,
    ) -> None:
        self.name, self.rules = "hopping robot", RULES
        self.document, self.shape = document, shape
        model = document.content
        self.measured = tuple(paced(run) for run in runs)
        self.robot = make_robot(
            model.values(), shape, increments or model.increments, model.quantities()
        )
        self.coloured = coloured_noise(self.measured)
        self._modes = {run.mode for run in runs} | set(modes)
        self.base = parameters_within_tolerance(model, self._modes)
        self.candidates = hopper_candidates(self._modes, self.base, self.robot.effects)
        self._quantities: Mapping[str, tuple[str, str]] = {
            parameter.name: (one.name, quantity)
            for one in self.candidates
            for quantity, parameter in one.quantities.items()
        }

    @property
    def source(self) -> Path:
        """Return the model file."""
        return self.document.path

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the runs."""
        return tuple(run.name for run in self.measured)

    @property
    def roles(self) -> tuple[str, ...]:
        """Return the role of each run."""
        return tuple(run.role for run in self.measured)

    @property
    def facts(self) -> tuple[Facts, ...]:
        """Return what was measured of each run."""
        return tuple(self._facts(run) for run in self.measured)

    @property
    def whole(self) -> float:
        """Return infinity: hops are chaotic, and the observer alone judges them; of `Rig`."""
        return np.inf

    def faults(self) -> list[Fault]:
        """Return the runs that are not what they are said to be, as drive and bodies show."""
        return hopper_faults(replace(self.robot, planar=True), self.measured)

    def repeats(self) -> float:
        """Return 1: observer and drive know the memory of the noise; of `Rig`."""
        return 1.0

    def system(
        self, runs: Sequence[int], parameters: Sequence[Parameter], like: System | None = None
    ) -> Hopper:
        """Return some runs as a system; of `Rig`."""
        own = [one for one in parameters if one.name not in self._quantities]
        more = {
            one: self._quantities[one.name] for one in parameters if one.name in self._quantities
        }
        turned = like.turned if isinstance(like, Hopper) else ()
        return Hopper(
            self.robot, [self.measured[k] for k in runs], own, more, turned, _WARMTH, self.coloured
        )

    def with_runs(self, runs: Sequence[MeasuredRun]) -> HopperRig:
        """Return the rig with more runs after its own; it may still fit what its modes feel."""
        return self._like((*self.measured, *runs), self._modes)

    def with_modes(self, modes: Collection[str]) -> HopperRig:
        """Return the rig with base and candidates of more modes than its runs have."""
        return self._like(self.measured, {*self._modes, *modes})

    def beside(self, causes: Collection[str], felt: Collection[str]) -> HopperRig:
        """Return the rig with causes that are known, for runs which show more than others do.

        Args:
            causes: whose quantities belong to the base.
            felt: names of the numbers that the others show; what has such a number is no candidate.
        """
        found = copy(self)
        known = [one for one in self.candidates if one.name in causes]
        found.base = (*self.base, *(p for one in known for p in one.quantities.values()))
        found.candidates = tuple(
            one
            for one in self.candidates
            if not {*one.frees, *(p.name for p in one.quantities.values())} & {*felt}
        )
        return found

    def finer(self) -> HopperRig | None:
        """Return the robot with a beam of more increments, if its own has few; of `Rig`."""
        if self.robot.increments >= FINER:
            return None
        return self._like(self.measured, self._modes, FINER)

    def _like(
        self, runs: Sequence[MeasuredRun], modes: Collection[str], increments: int | None = None
    ) -> HopperRig:
        more = increments or self.robot.increments
        return HopperRig(runs, self.document, self.shape, modes, more)

    def extend(
        self, path: Path, values: Mapping[str, float], effects: Effects, diagnosis: str
    ) -> HopperRig:
        """Write the model with other values and more effects; of `Rig`."""
        own = {name: value for name, value in values.items() if name in UNITS}
        file = path.with_name(f"{path.name}.yaml")
        written = write_extension(
            file, self.document, own, effects, diagnosis, self.robot.increments
        )
        return HopperRig(self.measured, written, self.shape)

    def errors(
        self,
        runs: Sequence[int],
        values: Mapping[str, float] | None,
        angles: Sequence[Array | None] | None,
        threads: int = 0,
    ) -> Errors | None:
        """Return how far some runs are from what the model predicts; of `Rig`."""
        if not runs:
            return None
        robot = replace(self.robot, values={**self.robot.values, **(values or {})})
        turned = angles or [None] * len(runs)
        return errors_of(robot, [self.measured[k] for k in runs], turned, threads)

    @staticmethod
    def _facts(run: MeasuredRun) -> Facts:
        part = run.motion.select(run.channels)
        values = np.where(part.valid, part.values, np.nan)
        return Facts(run.name, run.mode, run.role, run.channels, values)


def robot_of(bundles: Sequence[Bundle], progress: Progress) -> tuple[HopperRig, dict[str, Path]]:
    """Return the robot that made some runs, and the files that it is known from.

    A run that is not complete, such as one that was stopped, is left out with a word.

    Args:
        bundles: of the runs.
        progress: called at each run that is read.

    Returns:
        the rig; the shape under `shape`, and each run's take under the name of its bundle.

    Raises:
        InputError: when several robots made them, a take is missing, or none is complete.
    """
    runs = measured_runs(bundles, progress)
    whole = [bundle for bundle in bundles if bundle.manifest.status == "complete"]
    stated, shape = same_robot(bundles)
    files = {"shape": shape.path} | {bundle.path.name: bundle.take() for bundle in whole}
    return HopperRig(runs, stated, shape.content), files
