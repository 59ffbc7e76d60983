"""The windows of all hops of a rig: found once, then predicted for whatever the model may be."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.following import Followed, Hop, Look, best, followable, followed, moved
from workbench.diagnose.noise import Noise
from workbench.diagnose.rig import Asked
from workbench.diagnose.windows import Windows, windows_in
from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.sim import Condition, Robot, Standing, spread

__all__ = ["HopWindows", "Robots"]

Array = NDArray[np.float64]
Values = Mapping[str, float]

_BEFORE = ("delay", "lag", "start angle")
"""What a run keeps to itself that is over, or made up for by the stance, when a window begins."""


@dataclass(frozen=True)
class Robots:
    """How a rig makes robots of values.

    Args:
        stands: returns the robot of a run, in coarse steps or not, and its condition with the
            command of the whole run; None where it cannot be simulated.
        looks: returns what cameras see in a run.
        felt: tells whether a hop depends on an unknown of a name.
        lead: samples of the command before a run begins.
    """

    stands: Callable[[int, Values, bool], tuple[Robot, Condition] | None]
    looks: Callable[[int, Values], Look]
    felt: Callable[[str], bool]
    lead: int

    def hop(self, run: int, values: Values, coarse: bool = False) -> Hop | None:
        """Return the robot of a run as windows need it; None where it cannot be simulated."""
        later = {name: value for name, value in values.items() if name not in _BEFORE}
        asked = self.stands(run, later, coarse)
        if asked is None:
            return None
        try:
            return Hop(Standing.of(*asked), self.looks(run, values), self.lead)
        except InputError:
            return None

    def moves(self, values: Values) -> tuple[tuple[str, float], ...]:
        """Return those values that a window's motion depends on."""
        own = values.items()
        return tuple(sorted((n, v) for n, v in own if n not in _BEFORE and self.felt(n)))


@dataclass(frozen=True, eq=False)
class HopWindows:
    """Windows by run, and how the model that they were found with follows them.

    Args:
        windows: by run.
        before: by run.
        threads: of the simulation; 0 takes all cores.
    """

    windows: Mapping[int, Windows]
    before: Mapping[int, Followed]
    threads: int = 0

    @classmethod
    def found(
        cls,
        runs: Mapping[int, tuple[MeasuredRun, Noise]],
        robots: Robots,
        values: Mapping[int, Values],
        threads: int = 0,
    ) -> HopWindows:
        """Return the windows of some hops that a model follows.

        Args:
            runs: with their noise.
            robots: of the rig.
            values: that the model has there, by run.
            threads: of the simulation.
        """

        def follow(k: int) -> tuple[Windows, Followed] | None:
            windows, hop = windows_in(*runs[k]), robots.hop(k, values[k])
            return None if windows is None or hop is None else followable(windows, hop)

        told = dict(zip(runs, spread(follow, list(runs), threads), strict=True))
        kept = {k: one for k, one in told.items() if one is not None and len(one[0])}
        windows = {k: one for k, (one, _) in kept.items()}
        return cls(windows, {k: one for k, (_, one) in kept.items()}, threads)

    def without(self, runs: Container[int]) -> HopWindows:
        """Return the windows of all other runs."""
        kept = [k for k in self.windows if k not in runs]
        windows = {k: self.windows[k] for k in kept}
        return HopWindows(windows, {k: self.before[k] for k in kept}, self.threads)

    def predicted(
        self, asked: Sequence[Asked], robots: Robots, until: float = np.inf, coarse: bool = False
    ) -> list[Array | None]:
        """Return what is told of each that is asked, (w n, c); None where nothing can be.

        The first of a run is followed; others of it, by straight lines beside that.

        Args:
            asked: run and values.
            robots: of the rig.
            until: only windows that begin up to this time are told [s].
            coarse: whether larger steps will do.
        """
        first: dict[int, Values] = {}
        for k, values in asked:
            first.setdefault(k, values)
        cut = {k: self.windows[k].until(until) for k in first}

        def follow(k: int) -> Followed | None:
            hop = robots.hop(k, first[k], coarse)
            if hop is None or not len(cut[k]):
                return None
            return followed(cut[k], hop, self.before[k].chosen(np.arange(len(cut[k]))))

        anchors = dict(zip(first, spread(follow, list(first), self.threads), strict=True))
        groups: dict[tuple[object, ...], list[int]] = {}
        for at, (k, values) in enumerate(asked):
            own = () if values is first[k] else robots.moves(values)
            groups.setdefault((k, values is first[k], *own), []).append(at)

        def tell(members: list[int]) -> list[Array | None]:
            k, values = asked[members[0]]
            anchor = anchors[k]
            if anchor is not None and values is first[k]:
                return [_rows(best(cut[k], anchor))] * len(members)
            hop = None if anchor is None else robots.hop(k, values, coarse)
            if anchor is None or hop is None:
                return [None] * len(members)
            looks = [robots.looks(k, asked[at][1]) for at in members]
            return [_rows(one) for one in moved(cut[k], hop, looks, anchor)]

        found: list[Array | None] = [None] * len(asked)
        done = spread(tell, list(groups.values()), self.threads)
        for members, told in zip(groups.values(), done, strict=True):
            for at, one in zip(members, told, strict=True):
                found[at] = one
        return found


def _rows(told: Array) -> Array:
    return told.reshape(-1, told.shape[2])
