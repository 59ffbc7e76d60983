"""How far a robot may hop: one distance is a draw of many, as hopping hangs on little things.

With the thesis' numbers 0.05 of friction doubles the distance. So the same robot hops from start
angles all around, with friction and speed anywhere within their tolerances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.design.uncertainty import Uncertainty, altered
from workbench.errors import InputError
from workbench.motion import FOOT
from workbench.schemas import ModelFile
from workbench.sim import Condition, Robot, Simulation, attempt_all

__all__ = ["DRAWS", "DistanceDraws", "draw_distances", "tolerances_of"]

DRAWS = 16
_VARIED = ("friction_slide", "friction_stick")

_LOW, _HIGH = 0.05, 0.95


@dataclass(frozen=True)
class DistanceDraws:
    """Distances of the draws.

    Args:
        distances: of those that hopped to the end [m].
        failed: draws that fell, blew up or could not stand.
    """

    distances: tuple[float, ...]
    failed: int

    def share(self, share: float) -> float:
        """Return the distance that a share of the draws stays below [m], NaN where none is left."""
        return float(np.quantile(self.distances, share)) if self.distances else float("nan")

    def as_json(self) -> dict[str, float | int]:
        """Return median and the middle nine tenths under names with units."""
        return {
            "low_m": self.share(_LOW),
            "median_m": self.share(0.5),
            "high_m": self.share(_HIGH),
            "draws": len(self.distances) + self.failed,
            "failed": self.failed,
        }

    def text(self) -> str:
        """Return them in words."""
        if not self.distances:
            return f"none of {self.failed} draws hopped to the end"
        low, middle, high = (1000 * self.share(share) for share in (_LOW, 0.5, _HIGH))
        lost = f", {self.failed} failed" if self.failed else ""
        draws = len(self.distances) + self.failed
        return f"{low:.0f} to {high:.0f} mm, median {middle:.0f} mm ({draws} draws{lost})"


def tolerances_of(model: ModelFile) -> dict[str, float]:
    """Return the tolerances of a model's parameters that vary, SI."""
    return {name: getattr(model.parameters, name).tolerance for name in _VARIED}


def draw_distances(
    jobs: Sequence[tuple[Robot, Condition]],
    tolerances: Mapping[str, float],
    draws: int = DRAWS,
    seed: int = 0,
) -> list[DistanceDraws]:
    """Return how far robots hop when start angle, friction and speed are not what they should be.

    Args:
        jobs: robots and hops; all meet the same departures.
        tolerances: of `tolerances_of`, SI.
        draws: of each.
        seed: of the drawing.
    """
    departures = Uncertainty(tolerances, draws, seed, bend_error=0.0).departures
    varied = [
        (
            altered(robot, departure),
            replace(
                hop,
                command=hop.command + departure.omega * np.sign(hop.command),
                start_angle=hop.start_angle + departure.turned,
            ),
        )
        for robot, hop in jobs
        for departure in departures
    ]
    results = attempt_all(varied)
    return [_draws_of(results[i : i + draws]) for i in range(0, len(results), draws)]


def _draws_of(results: Sequence[Simulation | InputError]) -> DistanceDraws:
    paths = [
        one.motion[FOOT[0]]
        for one in results
        if isinstance(one, Simulation) and one.outcome == "completed"
    ]
    distances = tuple(float(path[-1] - path[0]) for path in paths)
    return DistanceDraws(distances, len(results) - len(distances))
