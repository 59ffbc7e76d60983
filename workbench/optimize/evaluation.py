"""The fitness of a candidate, and the hash that one is known by."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["Evaluate", "Evaluation", "candidate_key"]


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of one candidate.

    Args:
        fitness: one number for each goal, less is better; finite.
        numbers: whatever else is to be kept, by name with the unit, `distance_m`.
        failure: why the fitness is a penalty; None when the evaluation went well.
    """

    fitness: tuple[float, ...]
    numbers: Mapping[str, float] = field(default_factory=dict)
    failure: str | None = None


Evaluate = Callable[[NDArray[np.float64]], Sequence[Evaluation]]
"""Returns the evaluations of candidates (n, d), in their order; depends on nothing else."""


def candidate_key(problem_id: str, candidate: NDArray[np.float64]) -> str:
    """Return the hash of a problem and a candidate that its evaluation is kept under.

    Args:
        problem_id: of the problem.
        candidate: (d,) [unit of each variable].
    """
    digest = hashlib.sha256(problem_id.encode())
    digest.update(np.ascontiguousarray(candidate, dtype="<f8").tobytes())
    return digest.hexdigest()[:32]
