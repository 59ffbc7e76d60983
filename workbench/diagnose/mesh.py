"""By which mesh of the beam the observer answers.

Too coarse a mesh bends otherwise than the strip does, which causes then make up for. Runs whose
foot is held show it, and take less time.
"""

from __future__ import annotations

from dataclasses import dataclass

from workbench.diagnose.fits import Fits
from workbench.diagnose.hypothesis import Hypothesis
from workbench.diagnose.landing import LandingFits
from workbench.diagnose.observer_part import ObserverPart, observer_part, shortlisted
from workbench.diagnose.wording import together
from workbench.progress import Progress, portion

__all__ = ["observed"]


@dataclass(frozen=True, eq=False)
class _Mesh:
    """One mesh of the beam.

    Args:
        still: fits by it of the runs whose foot is held.
        base: of those; None where there is none.
    """

    still: Fits
    base: Hypothesis | None

    def every(self, fits: Fits) -> tuple[Fits, Hypothesis]:
        """Return fits by it of all runs that other fits have, and their base."""
        if self.base is not None and not fits.landing:
            return self.still, self.base
        fits = LandingFits(fits, self.still, self.base)
        return fits, fits.whole((), {})

    def prefers(self, fits: Fits, leader: Hypothesis) -> bool:
        """Return whether a hypothesis with causes, of other fits, is likelier by it."""
        if isinstance(fits, LandingFits):
            fits, leader = fits.still_part(leader)
        if not leader.names:  # hops alone show it, and those of either mesh are alike
            return False
        fits.progress(f"fit {together(leader.names)} by the other mesh")
        leader = fits.weighed(leader)
        return _moved(leader, fits, self.still).cost < leader.cost


def observed(fits: Fits, progress: Progress) -> ObserverPart:
    """Return what the observer says, by the mesh that the leading cause prefers.

    A base without the cause may take a mesh for it: the numbers of a slope were five standard
    errors off so. The cause that leads alone is asked before any other work, and what is found in
    the end once more where that is another.

    Args:
        fits: of all runs.
        progress: of the whole diagnosis.
    """
    fits.progress = portion(progress, 0.1, 0.4)
    own, other = _meshes(fits)
    fits, base = own.every(fits)
    fits.progress = portion(progress, 0.4, 0.75)
    listed = shortlisted(fits, base)
    if other is None:
        return observer_part(fits, listed)
    gain = base.cost - listed.leader.cost
    asked = listed.leader if gain > fits.rules.least_gain else base
    if asked.names and other.prefers(fits, asked):
        own, other = other, own
        fits, base = own.every(fits)
        fits.progress = portion(progress, 0.4, 0.75)
        listed = shortlisted(fits, base)
    found = observer_part(fits, listed)
    if found.leader.names not in ((), asked.names) and other.prefers(fits, found.leader):
        fits, base = other.every(fits)
        fits.progress = portion(progress, 0.75, 0.85)
        return observer_part(fits, shortlisted(fits, base))
    return found


def _meshes(fits: Fits) -> tuple[_Mesh, _Mesh | None]:
    """Return the mesh of the beam that the base prefers and the other, with the base fitted.

    Where no run's foot is held, or there is no finer mesh, it is one.
    """
    fits.progress("fit the base within its tolerances")
    finer, landing = fits.rig.finer(), fits.landing
    still = fits.of(fits.rig, landing) if landing else fits
    base = still.base() if still.train else None
    if finer is None or base is None:
        return _Mesh(still, base), None
    fits.progress("fit it with a finer beam")
    other = fits.of(finer, landing)
    finely = _moved(base, still, other)
    coarse, fine = _Mesh(still, base), _Mesh(other, finely)
    return (fine, coarse) if finely.cost < base.cost else (coarse, fine)


def _moved(one: Hypothesis, fits: Fits, other: Fits) -> Hypothesis:
    """Return a hypothesis of some fits by the mesh of others, which have the same runs.

    Where it misses much the way is not straight, and it is fitted by the whole recipe.
    """
    return other.moved(one) if fits.missing(one) <= 1 else other.whole(one.names, one.values)
