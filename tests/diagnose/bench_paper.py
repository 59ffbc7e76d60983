"""A rig on paper that also tells what runs would show that nobody has made yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tests.diagnose.paper import (
    NOISE_M,
    RATE_HZ,
    SECONDS,
    TERMS,
    PaperRig,
    cause,
    oscillation,
)
from workbench.diagnose.rig import Cause, Observed, Trial

__all__ = ["SIZE_M", "BenchRig", "alike", "grown", "made", "swings"]

SIZE_M = 0.02
"""What all first runs have: causes that grow with another power of it look the same in them."""


def grown(name: str, power: float) -> Cause:
    """Return a cause that grows with a power of the run's size, equal for all at `SIZE_M`."""
    TERMS[name] = lambda t, a: 1e-3 * (a / SIZE_M) ** power * np.sin(11 * t)
    return cause(name)


def alike(*powers: float) -> tuple[Cause, ...]:
    """Return causes that runs of one size cannot tell apart, `grown_0`, `grown_1` and so on."""
    return tuple(grown(f"grown_{power:g}", power) for power in powers)


def swings(*sizes: float) -> list[Trial]:
    """Return trials of some sizes [m]."""
    return [Trial("swing", size, SECONDS, 2.0) for size in sizes]


@dataclass(frozen=True)
class BenchRig(PaperRig):
    """A paper rig that can be asked for other sizes."""

    def with_trials(self, trials: Sequence[Trial]) -> BenchRig:
        """Return the rig with imagined runs after its own."""
        runs = tuple(_run(f"trial_{k}", np.zeros(_count()), None) for k in range(len(trials)))
        sizes = (*self.sizes, *(trial.amount for trial in trials))
        return replace(self, runs=(*self.runs, *runs), sizes=sizes)


def made(
    seed: int,
    amounts: dict[str, float],
    causes: tuple[Cause, ...],
    sizes: Sequence[float] = (SIZE_M,) * 4,
) -> BenchRig:
    """Return a rig with runs of some sizes, the fourth held out; the same seed, the same robot.

    Args:
        seed: of the robot, and of the noise run by run.
        amounts: of the causes that are true.
        causes: that the rig knows.
        sizes: of the runs [m].
    """
    rng = np.random.default_rng([seed, 0])
    values = {"omega": 5.0 + rng.uniform(-0.05, 0.05), "decay": 0.1 + rng.uniform(-0.03, 0.03)}
    times = np.arange(_count()) / RATE_HZ
    runs = []
    for k, size in enumerate(sizes):
        own = np.random.default_rng([seed, 1, k])
        path = oscillation(times, size, values | {"phase": own.normal(0, 0.02)}, amounts)
        noisy = path + NOISE_M * own.standard_normal(len(times))
        runs.append(_run(f"run_{k}", noisy, NOISE_M * own.standard_normal((200, 1)), k == 3))
    return BenchRig(tuple(runs), causes, sizes=tuple(sizes))


def _run(name: str, path: np.ndarray, rest: np.ndarray | None, held_out: bool = False) -> Observed:
    return Observed(
        name=name, mode="swing", role="held_out" if held_out else "train",
        times=np.arange(len(path)) / RATE_HZ, values=path[:, None],
        valid=np.ones((len(path), 1), dtype=bool), channels=("x_m",), units=("m",),
        rest=np.empty((0, 1)) if rest is None else rest,
    )  # fmt: skip


def _count() -> int:
    return round(SECONDS * RATE_HZ)
