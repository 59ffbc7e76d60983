"""A rig on paper: an oscillation that is written down, so that a diagnosis takes a moment."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.rig import Asked, Cause, Effects, Fault, Observed, Unknown

__all__ = ["NOISE_M", "PaperRig", "cause", "half_understood", "measured"]

NOISE_M = 3e-4
RATE_HZ, SECONDS = 100, 6.0
SIZES_M = (0.01, 0.02, 0.03, 0.015)
"""Amplitude of each run; the last is held out."""

Array = NDArray[np.float64]
Term = Callable[[Array, float], Array]

TERMS: dict[str, Term] = {
    "creep": lambda t, a: 1e-3 * t,
    "wobble": lambda t, a: 1e-3 * np.sin(11 * t),
    "wobble_again": lambda t, a: 1.02e-3 * np.sin(11 * t),
    "scale": lambda t, a: a * np.cos(5 * t) ** 2,
}
"""Cause -> what one unit of it adds to a run of some amplitude [m]."""


def cause(name: str, group: str = "structure", replaces: tuple[str, ...] = ()) -> Cause:
    """Return a cause with one quantity."""
    quantity = Unknown(f"{name}.amount", "1", 0.0, 0.1, -100.0, 100.0, 1e-3)
    sentence = f"there is {name} of {{amount}}"
    return Cause(name, group, sentence, (quantity,), replaces=replaces)


CAUSES = (
    cause("hardening"),
    cause("creep"),
    cause("wobble"),
    cause("scale", "sensor"),
    cause("stiffness", replaces=("omega",)),
)


@dataclass(frozen=True)
class PaperRig:
    """Runs of x = a exp(-d t) cos(omega t + phase), and causes that add to it."""

    runs: tuple[Observed, ...]
    causes: tuple[Cause, ...] = CAUSES
    base: tuple[Unknown, ...] = (
        Unknown("omega", "rad/s", 5.0, 0.1, 0.1, 50.0, 1e-4),
        Unknown("decay", "1/s", 0.1, 0.05, 0.001, 5.0, 1e-4),
    )
    found: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    source: Path = Path("paper.json")
    name: str = "paper"
    told: tuple[Fault, ...] = ()
    sizes: tuple[float, ...] = SIZES_M

    def own(self, run: int) -> Sequence[Unknown]:
        """Return the phase that each run starts at."""
        return [Unknown("phase", "rad", 0.0, 0.02, -1.0, 1.0, 1e-4)]

    def faults(self) -> Sequence[Fault]:
        """Return those that it was made with."""
        return self.told

    def predict(
        self, asked: Sequence[Asked], until: float = np.inf, coarse: bool = False
    ) -> list[Array]:
        """Write the oscillations down."""
        stated = {one.name: one.stated for one in self.base}
        found = []
        for k, values in asked:
            times = self.runs[k].times[self.runs[k].times <= until]
            amounts = {n: v["amount"] for n, v in self.found.items()} | {
                name.partition(".")[0]: value for name, value in values.items() if "." in name
            }
            path = oscillation(times, self.sizes[k], stated | dict(values), amounts)
            found.append(path[:, None])
        return found

    def shortened(self, ends: Mapping[int, float]) -> PaperRig:
        """Return the rig with some runs compared for a shorter time [s]."""
        runs = tuple(run.until(ends.get(k, np.inf)) for k, run in enumerate(self.runs))
        return replace(self, runs=runs)

    def extend(
        self, path: Path, values: Mapping[str, float], effects: Effects, diagnosis: str
    ) -> PaperRig:
        """Write base and causes as JSON and read them back."""
        file = path.with_suffix(".json")
        found = {n: {q: v for q, (v, _) in given.items()} for n, given in effects.items()}
        file.write_text(json.dumps({"base": dict(values), "found": found}))
        read = json.loads(file.read_text())
        base = tuple(replace(one, stated=read["base"][one.name]) for one in self.base)
        return replace(self, base=base, found=read["found"], source=file)


def oscillation(
    times: Array, size: float, values: Mapping[str, float], amounts: Mapping[str, float]
) -> Array:
    """Return a run as it is without noise, (n,) [m]."""
    omega = values["omega"] * (1 + amounts.get("stiffness", 0.0))
    bent = 1 + amounts.get("hardening", 0.0) * (size / 0.03) ** 2 * np.exp(-values["decay"] * times)
    path = size * np.exp(-values["decay"] * times) * np.cos(
        omega * bent * times + values.get("phase", 0.0)
    )  # fmt: skip
    for name, amount in amounts.items():
        if name in TERMS:
            path = path + amount * TERMS[name](times, size)
    return path


def measured(
    seed: int, amounts: Mapping[str, float] | None = None, stranger: Array | None = None
) -> PaperRig:
    """Return a rig whose runs have causes, noise, and base numbers off within their tolerances.

    Args:
        seed: of all that is drawn.
        amounts: of the causes.
        stranger: (n,) what no cause explains, added to each run in its size [m].
    """
    rng = np.random.default_rng(seed)
    times = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    values = {"omega": 5.0 + rng.uniform(-0.08, 0.08), "decay": 0.1 + rng.uniform(-0.03, 0.03)}
    runs = []
    for k, size in enumerate(SIZES_M):
        phase = rng.normal(0, 0.02)
        path = oscillation(times, size, values | {"phase": phase}, amounts or {})
        if stranger is not None:
            path = path + stranger * size / max(SIZES_M)
        noisy = path + NOISE_M * rng.standard_normal(len(times))
        rest = NOISE_M * rng.standard_normal((200, 1))
        runs.append(
            Observed(
                name=f"run_{k}", mode="swing", role="held_out" if k == 3 else "train", times=times,
                values=noisy[:, None], valid=np.ones((len(times), 1), dtype=bool),
                channels=("x_m",), units=("m",), rest=rest,
            )
        )  # fmt: skip
    return PaperRig(tuple(runs))


def half_understood() -> PaperRig:
    """Return a rig that creeps, and whose run held out also does what no cause explains."""
    rig = measured(1, {"creep": 0.2})
    odd = 3e-3 * np.sin(23 * rig.runs[3].times)[:, None]
    return replace(rig, runs=(*rig.runs[:3], replace(rig.runs[3], values=rig.runs[3].values + odd)))
