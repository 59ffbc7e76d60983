"""By which mesh of the beam the observer answers.

Too coarse a mesh bends otherwise than the strip does, which causes then make up for. Runs whose
foot is held show it, and take less time.
"""

from __future__ import annotations

from typing import NamedTuple

from workbench.diagnose.fits import Fits
from workbench.diagnose.hypothesis import Hypothesis
from workbench.diagnose.observer_part import ObserverPart, observer_part, practical, shortlisted
from workbench.diagnose.wording import together
from workbench.progress import portion

__all__ = ["by_mesh"]


class _Mesh(NamedTuple):
    """Fits of the runs by one mesh of the beam, and the base."""

    fits: Fits
    base: Hypothesis

    def prefers(self, other: _Mesh, leader: Hypothesis) -> bool:
        """Return whether a hypothesis with causes, by another mesh, is surely likelier by this one.

        It gains what is of a practical size on the base by either mesh: beside the base of the mesh
        that is less likely, what makes up for that gained 141 where no cause was.
        """
        other.fits.progress(f"fit {together(leader.names)} by the other mesh")
        leader = other.fits.settled(other.fits.at_once(leader))
        moved = self.fits.settled(_moved(leader, other.fits, self.fits))
        gain = min(self.base.cost, other.base.cost) - moved.cost
        return moved.cost < leader.cost and gain > practical(self.fits, moved)


def by_mesh(fits: Fits) -> ObserverPart:
    """Return what the observer says, by the mesh that the leading cause prefers.

    A base without the cause may take a mesh for it: the numbers of a slope were five standard
    errors off so. The cause that leads alone is asked before any other work, and what is found in
    the end once more where that is another; of two answers the likelier stays.

    Args:
        fits: of runs whose foot is held.
    """
    progress = fits.progress
    fits.progress = portion(progress, 0.0, 0.3)
    meshes = _meshes(fits)
    for one in meshes:
        one.fits.progress = portion(progress, 0.3, 1.0)
    own, other = meshes[0], meshes[-1]
    listed = shortlisted(*own)
    if other is own:
        return observer_part(own.fits, listed)
    gain = own.base.cost - listed.leader.cost
    asked = listed.leader if gain > fits.rules.least_gain else own.base
    if asked.names and other.prefers(own, asked):
        own, other = other, own
        listed = shortlisted(*own)
    found = observer_part(own.fits, listed)
    if found.leader.names not in ((), asked.names) and other.prefers(own, found.leader):
        again = observer_part(other.fits, shortlisted(*other))
        return min(found, again, key=lambda one: one.leader.cost)
    return found


def _meshes(fits: Fits) -> list[_Mesh]:
    """Return the mesh of the beam that the base prefers, and the other where there is a finer."""
    fits.progress("fit the base within its tolerances")
    coarse, finer = _Mesh(fits, fits.base()), fits.rig.finer()
    if finer is None:
        return [coarse]
    fits.progress("fit it with a finer beam")
    other = fits.of(finer)
    fine = _Mesh(other, _moved(coarse.base, fits, other))
    return sorted([fine, coarse], key=lambda one: one.base.cost)


def _moved(one: Hypothesis, fits: Fits, other: Fits) -> Hypothesis:
    """Return a hypothesis of some fits by the mesh of others, which have the same runs.

    Where it misses much the way is not straight, and it is fitted by the whole recipe.
    """
    return other.moved(one) if fits.missing(one) <= 1 else other.whole(one.names, one.values)
