"""The drive on its own: what the motor did with its command, without a simulation.

The rotor's angle against T is what was commanded, through a first-order lag and a delay, and what
the motor does otherwise:

    speed = lagged[(1 + share) w + offset] (1 + rate t) + w ripple(p) - slope torque

w the commanded speed, p the rotor's angle in the world, the torque that which the rotor's mass
takes about T. All of it is linear in what is asked for, so each cause is a column of angles, and
every set of causes is one regression. Each run has a start angle, a lag, a delay and a small share
of its own. The point taken for T may sit off T: the length of the rotor's arm shows where (`arm`).
Glitches are left out, and noise with a memory is whitened: r[k] - memory r[k-1] counts.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.fit import Arm, Hopper, Linear, Solved, calm, commanded_angle, edges_of, fit_drive
from workbench.sim import EFFECTS

__all__ = ["DRIVE", "DriveFits", "drive_fits"]

Array = NDArray[np.float64]

DRIVE = ("speed_scale", "speed_offset", "speed_drift", "motor_droop", "speed_ripple")
"""Candidates that the rotor's angle judges."""

_RUN_PRIORS = {"start": 10.0, "delay": 0.01, "lag": 0.05, "gain": 1e-3}
"""What a run keeps to itself -> how far it may be off [rad, s, s, 1]."""
_FIRST_S = 0.1  # of what is seen of a run, that shows where it starts
_OFFSETS = ("marker forward", "marker up")
_TOLERATED_M = 2e-4  # how far the point taken for T may sit off T and nobody minds


@dataclass(frozen=True, eq=False)
class DriveFits:
    """The regression of the rotor's angle in some runs.

    Args:
        linear: all columns of all runs.
        quantities: candidate -> names of its columns.
        tolerances: column -> its prior deviation [SI].
        runs: numbers of the driven runs in their system.
        edges: (r + 1,) of the runs, in blocks.
        angles: of each driven run, (n,) as commanded, about the point taken for T [rad].
        arm: where that point sits.
        columns: of each, name -> (n,) what a number of 1 adds to it [rad].
    """

    linear: Linear
    quantities: Mapping[str, tuple[str, ...]]
    tolerances: Mapping[str, float]
    runs: tuple[int, ...]
    edges: tuple[int, ...]
    angles: tuple[Array, ...]
    arm: Arm
    columns: tuple[Mapping[str, Array], ...]

    def _moving(self, names: Sequence[str]) -> dict[str, bool]:
        """Return the numbers that move with some candidates -> whether their prior is normal."""
        released = {key: False for name in names for key in self.quantities[name]}
        return dict.fromkeys(_OFFSETS, True) | released

    def solved(self, names: Sequence[str]) -> Solved:
        """Return the regression with some candidates released."""
        return self.linear.solved(self._moving(names))

    def like(self, fitted: DriveFits, found: Solved) -> Solved:
        """Return the regression where the shared numbers are those of other runs."""
        shared, mine = dict(zip(fitted.linear.names, found.x, strict=True)), self.linear
        pairs = zip(mine.names, mine.own, strict=True)
        step = np.array([0.0 if own else shared.get(name, 0.0) for name, own in pairs])
        residuals = mine.residuals + mine.jacobian @ step
        return replace(mine, x=mine.x + step, residuals=residuals).solved({})

    def by_run(self, found: Solved) -> list[Array]:
        """Return the cost of each second, (b,) [1], of each driven run."""
        return [found.blocks[a:b] for a, b in pairwise(self.edges)]

    def angle(self, found: Solved, k: int) -> Array:
        """Return a run's angle against T, (n,) [rad], as the regression has it."""
        at = self.runs.index(k)
        angle = self.angles[at].copy()
        for name, number in zip(self.linear.names, found.x, strict=True):
            angle += number * self.columns[at].get(name, 0.0)
        return self.arm.true_angle(angle)

    def values(
        self, names: Sequence[str], found: Solved, others: Collection[str] = ()
    ) -> dict[str, tuple[float, float]]:
        """Return the value and standard error [SI] of each number of some candidates.

        Args:
            names: of the candidates.
            found: the regression with them.
            others: candidates that may be there as well, within their tolerances.
        """
        free = [key for name in others for key in self.quantities[name]]
        wider = self.linear.wider(self._moving(names), free)
        every = zip(self.linear.names, found.x, found.deviation, strict=True)
        return {
            key: (float(x) * self.tolerances[key], float(error) * wider[key] * self.tolerances[key])
            for key, x, error in every
            if key in self.tolerances
        }


def drive_fits(system: Hopper, turns: Sequence[Array], arm: Arm) -> DriveFits:
    """Return the regression of the rotor's angle in the driven runs of a system.

    Args:
        system: with its runs.
        turns: of each run, (n,) turn of T from its rest [rad].
        arm: where the point taken for T sits.
    """
    quantities = {
        name: tuple(f"{name} {q.name}" for q in EFFECTS[name].quantities) for name in DRIVE
    }
    tolerances = {
        f"{name} {q.name}": q.tolerance for name in DRIVE for q in EFFECTS[name].quantities
    }
    wide = dict(zip(_OFFSETS, np.hypot(np.minimum(arm.deviation, 1.0), _TOLERATED_M), strict=True))
    shared, driven = [*tolerances, *_OFFSETS], [k for k, r in enumerate(system.runs) if r.driven]
    scale = {**tolerances, **wide, **_RUN_PRIORS}
    edges, ends, angles, residuals, lengths = [0], [0], [], [], []
    columns: list[dict[str, Array]] = []
    for k in driven:
        seen, usual, made = _columns(system, k, turns[k], arm)
        near = _near(system, k, arm)
        angles.append(usual)
        residuals.append(_counted(system, k, near * (seen - usual)))
        own = {key: f"{key} of run {k}" for key in _RUN_PRIORS}
        columns.append({own.get(key, key): scale[key] * one for key, one in made.items()})
        lengths.append(near)
        edges += list(edges[-1] + edges_of(len(seen), system.sample_s)[1:])
        ends.append(len(edges) - 1)
    names = (*shared, *(f"{key} of run {k}" for k in driven for key in _RUN_PRIORS))
    jacobian, begin = np.zeros((edges[-1], len(names))), 0
    for k, residual, made, near in zip(driven, residuals, columns, lengths, strict=True):
        rows = slice(begin, begin + len(residual))
        for j, key in enumerate(names):
            if key in made:
                column = np.where(np.isfinite(residual), near * made[key], np.nan)
                jacobian[rows, j] = -_whitened(system, k, column)
        begin += len(residual)
    alone = np.arange(len(names)) >= len(shared)
    white = [_whitened(system, k, one) for k, one in zip(driven, residuals, strict=True)]
    left = np.concatenate([np.zeros(0), *white])
    linear = Linear(names, alone, np.zeros(len(names)), left, jacobian, np.array(edges))
    return DriveFits(
        linear, quantities, tolerances, tuple(driven), tuple(ends), tuple(angles), arm,
        tuple(columns),
    )  # fmt: skip


def _columns(
    system: Hopper, k: int, turn: Array, arm: Arm
) -> tuple[Array, Array, dict[str, Array]]:
    """Return a run's angle as seen and as commanded, and the angles that causes make of it."""
    run, times, step = system.runs[k], system.times(k), system.sample_s
    world = system.world_angle(k)
    seen = world - (turn - turn[0])
    sigma, memory = system.rotor_noise(k)
    torque = system.motor_torque(k)
    motor = fit_drive(times, arm.true_angle(seen) + turn, run.steps, sigma, turn, memory, torque)
    lag, delay = motor.lag, motor.delay

    def angle(late: float, slow: float) -> Array:
        return commanded_angle(times, run.steps, 1.0, slow, late)

    usual = angle(delay, lag)
    speed = np.gradient(usual, step)
    phase = system.turned[k]
    assert phase is not None
    absolute = phase + turn
    radius = arm.radius if arm.known else system.robot.values["rotor_radius"]
    on = tuple((t, float(np.sign(w))) for t, w in run.steps)
    columns = {
        "speed_scale share": usual,
        "speed_offset offset": commanded_angle(times, on, 1.0, lag, delay),
        "speed_drift rate": _integral(speed * np.maximum(times, 0.0), step),
        "motor_droop slope": -_integral(torque(absolute) * (speed > 0), step),
        "speed_ripple cos_1": _integral(speed * np.cos(absolute), step),
        "speed_ripple sin_1": _integral(speed * np.sin(absolute), step),
        "speed_ripple cos_2": _integral(speed * np.cos(2 * absolute), step),
        "speed_ripple sin_2": _integral(speed * np.sin(2 * absolute), step),
        "marker forward": np.sin(phase) / radius,
        "marker up": np.cos(phase) / radius,
        "start": np.ones(len(times)),
        "delay": -speed,
        "lag": (angle(delay, lag * 1.01 + 1e-4) - usual) / (lag * 0.01 + 1e-4),
        "gain": usual,
    }
    usual = usual + arm.seen_angle(phase) - phase
    off = seen - usual
    start = float(np.median(off[np.isfinite(off)][: round(_FIRST_S / step)]))
    return seen, usual + start, columns


def _integral(rate: Array, step: float) -> Array:
    return np.asarray(scipy.integrate.cumulative_trapezoid(rate, dx=step, initial=0.0))


def _near(system: Hopper, k: int, arm: Arm) -> Array:
    """Return the length of the rotor's arm over that where its angle's noise was taken, (n,) [1].

    A place is seen with the same noise everywhere, an angle with the more the shorter its arm is.
    White noise is taken over the whole run, noise with a memory at rest.
    """
    phase = system.turned[k]
    assert phase is not None
    length = arm.length(arm.seen_angle(phase))
    usual = length[0] if system.rotor_noise(k).memory else np.median(length)
    return np.asarray(length / usual)


def _counted(system: Hopper, k: int, left: Array) -> Array:
    """Return a run's remainder, (n,) [rad], NaN where not seen or wild."""
    return np.where(calm(left, system.rotor_noise(k).sigma), left, np.nan)


def _whitened(system: Hopper, k: int, rest: Array) -> Array:
    """Return a run's angles, (n,) [rad], over white noise; zero where not seen (NaN)."""
    sigma, memory = system.rotor_noise(k)
    before = np.append(np.nan, rest[:-1])
    fresh = (rest - memory * before) / np.sqrt(1 - memory**2)
    return np.asarray(np.nan_to_num(np.where(np.isfinite(before), fresh, rest)) / sigma)
