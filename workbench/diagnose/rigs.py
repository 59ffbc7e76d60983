"""What a diagnosis asks of a mechanical system, and the hopping robot as one.

A rig knows its runs, the numbers of its model that may be off within their tolerance, and the
candidates. It offers some of its runs as a system that can be fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from workbench.diagnose.candidates import Candidate, hopper_base, hopper_candidates
from workbench.fit import Hopper, MeasuredRun, Parameter, System, paced
from workbench.protocol import Document, ModelFile, ShapeFile
from workbench.sim import make_robot

__all__ = ["HopperRig", "Rig"]


_WARMTH = 1e-3  # share of the stiffness: aluminium's falls by about 5e-4 a degree


class Rig(Protocol):
    """A mechanical system, its runs, and what may be other than its model says."""

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


class HopperRig:
    """The robot of one model and shape with some runs of it.

    Args:
        runs: measured, of one robot.
        document: the model file; its effects stay as they are.
        shape: of the beam.
    """

    def __init__(
        self, runs: Sequence[MeasuredRun], document: Document[ModelFile], shape: ShapeFile
    ) -> None:
        self.name = "hopping robot"
        self.document, self.shape = document, shape
        model = document.content
        self.measured = tuple(paced(run) for run in runs)
        self.robot = make_robot(model.values(), shape, model.increments, model.quantities())
        modes = {run.mode for run in runs}
        self.base = hopper_base(model, modes)
        self.candidates = hopper_candidates(modes, self.base, self.robot.effects)
        self._quantities: Mapping[str, tuple[str, str]] = {
            parameter.name: (one.name, quantity)
            for one in self.candidates
            for quantity, parameter in one.quantities.items()
        }

    @property
    def roles(self) -> tuple[str, ...]:
        """Return the role of each run."""
        return tuple(run.role for run in self.measured)

    def system(
        self, runs: Sequence[int], parameters: Sequence[Parameter], like: System | None = None
    ) -> Hopper:
        """Return some runs as a system; of `Rig`."""
        own = [one for one in parameters if one.name not in self._quantities]
        more = {one: self._quantities[one.name] for one in parameters
                if one.name in self._quantities}  # fmt: skip
        turned = like.turned if isinstance(like, Hopper) else ()
        return Hopper(self.robot, [self.measured[k] for k in runs], own, more, turned, _WARMTH)
