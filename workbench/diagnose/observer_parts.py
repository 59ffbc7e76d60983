"""What the observer says of all runs: of those whose foot is held first, then of hops.

Held runs show what is wrong with the robot; hops are then asked what they alone show, the floor and
the foot on it. A number is estimated by the runs that show it best.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

from workbench.diagnose.findings import Cause, Refit
from workbench.diagnose.fits import Fits
from workbench.diagnose.hypothesis import Hypothesis
from workbench.diagnose.landing import HopFits
from workbench.diagnose.mesh import by_mesh
from workbench.diagnose.observer_part import ObserverPart, observer_part, shortlisted
from workbench.diagnose.rig import HopperRig
from workbench.diagnose.screening import Promise
from workbench.progress import portion

__all__ = ["ObserverParts", "observer_parts"]

_HELD_FOOT, _HOPS, _MOTION = "held foot", "hops", "motion"
"""Names of the parts: of the robot's runs, and of those of any other machine."""


@dataclass(frozen=True, eq=False)
class ObserverParts:
    """What the observer says.

    Args:
        parts: of it: that of runs whose foot is held, and of hops, by name.
        fits: of all runs, by the mesh that held ones prefer.
    """

    parts: Mapping[str, ObserverPart]
    fits: Fits

    @cached_property
    def base(self) -> Hypothesis:
        """Return the base of all runs."""
        return self._whole(one.base for one in self.parts.values())

    @cached_property
    def best(self) -> Hypothesis:
        """Return what holds of all runs."""
        return self._whole(one.best for one in self.parts.values())

    def beside(self, one: Hypothesis) -> Hypothesis:
        """Return a hypothesis of one part as one of all runs, beside what holds in the other."""
        parts = self.parts.values()
        return self._whole(one if one in (p.base, *p.tried) else p.best for p in parts)

    def _whole(self, each: Iterable[Hypothesis]) -> Hypothesis:
        """Return as one of all runs a hypothesis of each part, in their order."""
        ones = list(each)
        return ones[0] if len(ones) == 1 else self.fits.joined(ones)

    @property
    def causes(self) -> tuple[Cause, ...]:
        """Return what is listed."""
        return tuple(cause for one in self.parts.values() for cause in one.causes)

    @property
    def promises(self) -> tuple[Promise, ...]:
        """Return what each candidate promises, seen from the base, most first."""
        by_name = {one.name: one for part in self.parts.values() for one in part.promises}
        return tuple(sorted(by_name.values(), key=lambda one: -one.gain))

    @property
    def refit(self) -> tuple[Refit, ...]:
        """Return what the fit changed of the model's own numbers, in the model's order."""
        by_name = {one.name: one for part in self.parts.values() for one in part.refit}
        return tuple(by_name[one.name] for one in self.fits.rig.base)


def observer_parts(fits: Fits) -> ObserverParts:
    """Return what the observer says.

    Args:
        fits: of all runs.
    """
    progress, hops = fits.progress, [run for run in fits.train if run in fits.landing]
    still = fits.of(fits.rig, fits.landing) if hops else fits
    parts, best = dict[str, ObserverPart](), None
    if still.train:
        still.progress = portion(progress, 0.1, 0.6 if hops else 0.85)
        name = _HELD_FOOT if isinstance(fits.rig, HopperRig) else _MOTION
        found = parts[name] = by_mesh(still)
        still, best = found.fits, found.best
    if hops:
        hopping = HopFits(fits, still, best)
        hopping.progress = portion(progress, 0.6 if parts else 0.1, 0.85)
        hopping.progress("fit the floor to the hops" if parts else "fit the base")
        parts[_HOPS] = observer_part(hopping, shortlisted(hopping, hopping.base()))
    every = fits.of(still.rig) if hops else still
    every.progress = progress
    return ObserverParts(parts, every)
