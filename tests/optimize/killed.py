"""A search in a process of its own, slow enough to be killed: ALGORITHM CHECKPOINT."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.optimize.contract import ALGORITHMS, beam, ridges
from workbench.optimize import Evaluation, History, search

EVALUATIONS = 480


def run(name: str, checkpoint: Path | None, pause: float) -> History:
    """Search, pausing before each generation [s]."""
    algorithm = ALGORITHMS[name](beam(), 5)
    objective = ridges(algorithm.goals)

    def slowly(candidates: NDArray[np.float64]) -> Sequence[Evaluation]:
        time.sleep(pause)
        return objective(candidates)

    penalty = (102.0,) * algorithm.goals
    return search(
        "ridges", algorithm, slowly, evaluations=EVALUATIONS, penalty=penalty, checkpoint=checkpoint
    )


if __name__ == "__main__":
    run(sys.argv[1], Path(sys.argv[2]), pause=0.01)
