"""Where the point taken for T sits, from the rotor's arm alone, without a simulation.

The arm is rigid: r e(t) about T, e(t) its direction at the angle t against T. From a point d off T
an arm of length l is seen at the angle s, with l e(s) = r e(t) - d, so that

    l / 2 = (r^2 - d^2) / (2 l) - d . e(s)

which is linear in d and in r^2 - d^2, however large d is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from workbench.fit.measured import MeasuredRun
from workbench.fit.systems.hopper_view import View
from workbench.motion import ROTOR, TOP, position
from workbench.noise import robust_sigma

__all__ = ["Arm", "arm_of"]

Array = NDArray[np.float64]

_GLITCH = 8.0  # deviations of a length that is left out
_FEWEST = 10  # samples of a run
_OFF = 3.0  # errors of an offset that is there


class Turning(Protocol):
    """Runs whose rotor was seen; the robot as a system is one."""

    @property
    def runs(self) -> Sequence[MeasuredRun]:
        """Return the runs."""
        ...

    def first(self, run: int) -> int:
        """Return the first sample of a run that is looked at."""
        ...

    def world_angle(self, run: int) -> Array:
        """Return the rotor's angle in the world from there on, (n,) [rad]."""
        ...


@dataclass(frozen=True)
class Arm:
    """Where the point taken for T sits.

    Args:
        offset: (2,) forward and up of T at rest [m].
        deviation: (2,) standard errors [m]; infinite where no rotor turned.
        radius: of the rotor [m].
    """

    offset: Array
    deviation: Array
    radius: float

    @property
    def known(self) -> bool:
        """Return whether a rotor turned."""
        return bool(np.isfinite(self.deviation).all())

    @property
    def off(self) -> bool:
        """Return whether the point is off T beyond its error."""
        return self.known and float(np.hypot(*(self.offset / self.deviation))) > _OFF

    def true_angle(self, seen: Array) -> Array:
        """Return angles about T, (n,) [rad], of angles (n,) about the point taken for it [rad]."""
        if not self.known:
            return seen
        forward, up = self.offset
        return View(forward=forward, up=up).true_angle(seen, self.radius)

    def seen_angle(self, true: Array) -> Array:
        """Return angles about the point taken for T, (n,) [rad], of angles (n,) about T [rad]."""
        if not self.known:
            return true
        forward, up = self.offset
        x, z = self.radius * np.cos(true) - forward, self.radius * np.sin(true) + up
        return np.asarray(true + np.angle(np.exp(1j * (np.arctan2(z, x) - true))))

    def length(self, seen: Array) -> Array:
        """Return lengths of the arm as seen at angles (n,) about that point [rad], (n,) [m]."""
        if not self.known:
            return np.ones_like(seen)
        forward, up = self.offset
        along = forward * np.cos(seen) - up * np.sin(seen)
        across = forward * np.sin(seen) + up * np.cos(seen)
        return np.asarray(np.sqrt(np.maximum(self.radius**2 - across**2, 0.0)) - along)


def arm_of(system: Turning, turns: Sequence[Array | None] | None = None) -> Arm:
    """Return where the point taken for T sits, as the driven runs of a system show it.

    Args:
        system: with its runs.
        turns: of each run, (n,) turn of T from its rest [rad]; a run without one is left out. No
            run turns where no list is given: an unknown turn of 0.1 rad moves an offset of 20 mm by
            half a millimetre.
    """
    rows, lengths = [], []
    for k, run in enumerate(system.runs):
        turn = 0.0 if turns is None else turns[k]
        if not run.driven or ROTOR[0] not in run.motion or turn is None:
            continue
        begin, world = system.first(k), system.world_angle(k)
        arm = (position(run.motion, ROTOR) - position(run.motion, TOP))[begin : begin + len(world)]
        angle = world - turn
        length = np.hypot(arm[:, 0], arm[:, 2])
        seen = np.isfinite(length) & np.isfinite(angle) & (length > 0)
        if seen.sum() < _FEWEST:
            continue
        length, angle = length[seen], angle[seen]
        row = np.column_stack([0.5 / length, -np.cos(angle), np.sin(angle)])
        left = length / 2 - row @ _solved(row, length / 2)
        calm = np.abs(left - np.median(left)) < _GLITCH * robust_sigma(left)
        rows.append(row[calm])
        lengths.append(length[calm] / 2)
    if not rows:
        return Arm(np.zeros(2), np.full(2, np.inf), np.nan)
    a, b = np.concatenate(rows), np.concatenate(lengths)
    found = _solved(a, b)
    each = np.array([_solved(r, v) for r, v in zip(rows, lengths, strict=True)])
    white = np.sqrt(np.diag(np.linalg.inv(a.T @ a)) * float(np.var(b - a @ found)))[1:]
    between = each.std(axis=0, ddof=1)[1:] / np.sqrt(len(each)) if len(each) > 1 else white
    offset = found[1:]
    return Arm(offset, np.maximum(white, between), float(np.sqrt(found[0] + offset @ offset)))


def _solved(a: Array, b: Array) -> Array:
    return np.asarray(np.linalg.lstsq(a, b, rcond=None)[0], dtype=np.float64)
