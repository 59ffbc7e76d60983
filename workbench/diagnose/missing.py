"""The force that a robot's model misses, run by run, and what it depends on.

The smoother says which force at T would make the model do as the robot did (`fit.smoother`). A
robust regression of that force on one coordinate at a time, each with some terms, says which of
them explains most; its share is that of pieces of the runs that the regression has not seen.

A term goes through the same smoother before it is compared (`missing_force.Response`).
What the regression finds is then in N, and the share is of what exceeds the cameras' noise. A force
that keeps all the while is not seen: every channel has its origin where the robot rests.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.force_at_top import CONTACT_M, MissingForce, force_of
from workbench.diagnose.hypothesis import Hypothesis
from workbench.diagnose.rules import RULES, Rules
from workbench.diagnose.wording import digits
from workbench.fit import Hopper
from workbench.noise import robust_sigma

__all__ = ["ABSENT", "INDEPENDENT", "Dependence", "MissingForceAnalysis", "missing_force"]

Array = NDArray[np.float64]

ABSENT = "nothing is missing above the noise"
INDEPENDENT = "a force that depends on none of these"

_CHANCE = 0.2  # share that a coordinate may explain of a disturbance without a rule: see the tests
_WHOLE = 0.8  # of what a coordinate explains, that one term must explain to be its law
_MOST_NOISE = 0.7  # of what is smoothed, that noise is taken for: the rest would be a chance
_PRESENT = 1.5  # times the power that the cameras' noise makes: less is nothing
_ROUNDS, _FAR = 6, 3.0  # of the robust regression; residuals beyond so many deviations pull less
_STILL = 0.1  # of the usual speed: below, a sign is no sign
_FOLDS, _PIECE_S = 4, 0.5  # every fourth piece of each run is left out at a time

_AXES = ("forward", "up")
_STRAIGHT = 0.7  # width over length of a path, from which on it has no direction
_EITHER_WAY = "the same either way"
_ALONG = ("in proportion to speed", "with the square of speed", "independent of speed")
_ODD = ("in proportion to it", "with its cube")
_WHOSE = {
    "time": "the time of the run",
    "rotor's angle": "the rotor's angle",
    "foot's height": "the foot's height",
    "slip speed": "the foot's slip",
}

_Term = Callable[[Array], Array]
_POWERS: dict[str, _Term] = {
    "in proportion to it": lambda s: s,
    "with its square": lambda s: s**2,
    "with its cube": lambda s: s**3,
}
_RATES: dict[str, _Term] = {
    "in proportion to speed": lambda v: v,
    "with the square of speed": lambda v: v * np.abs(v),
    "independent of speed": lambda v: v / np.hypot(v, _STILL * max(float(np.std(v)), 1e-9)),
    f"with the square of speed, {_EITHER_WAY}": lambda v: v**2,
}
_PHASE: dict[str, _Term] = {
    "once a turn": lambda p: np.column_stack([np.cos(p), np.sin(p)]),
    "twice a turn": lambda p: np.column_stack([np.cos(2 * p), np.sin(2 * p)]),
}
_TERMS: dict[str, dict[str, _Term]] = {
    "time": {"steadily": lambda t: t, "with its square": lambda t: t**2},
    "displacement forward": _POWERS,
    "displacement up": _POWERS,
    "velocity forward": _RATES,
    "velocity up": _RATES,
    "rotor's angle": _PHASE,
    "foot's height": {
        "in proportion to it": lambda h: np.maximum(h, 0.0),
        "only while the foot stands": lambda h: (h < CONTACT_M).astype(np.float64),
    },
    "slip speed": {key: _RATES[key] for key in ("in proportion to speed", "independent of speed")},
}
"""Coordinate -> name of each term and what it is of the coordinate, (n,) or (n, 2)."""

_UNITS = {
    "time": "s", "displacement forward": "m", "displacement up": "m", "velocity forward": "m/s",
    "velocity up": "m/s", "rotor's angle": "rad", "foot's height": "m", "slip speed": "m/s",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Dependence:
    """How much of the missing force a coordinate explains.

    Args:
        name: of the coordinate.
        unit: of it.
        share: of the variance beyond that of noise, in pieces that the regression has not seen.
        law: the term that explains it nearly alone, or how it changes sides with speed; empty where
            neither is.
        direction: (2,) forward and up, in which the force is given [1].
        where: what to call that direction.
        size: root mean square of the force in it [N].
        sign: 1 where it goes with the coordinate, -1 against it; 0 where it is across it.
    """

    name: str
    unit: str
    share: float
    law: str
    direction: Array
    where: str
    size: float
    sign: float


@dataclass(frozen=True, eq=False)
class MissingForceAnalysis:
    """What a model misses in the fitted runs.

    Args:
        forces: of each run.
        dependences: on each coordinate, the one that explains most first.
        sentence: what it is, in words.
        power: mean square of all, in that of the cameras' noise alone.
    """

    forces: tuple[MissingForce, ...]
    dependences: tuple[Dependence, ...]
    sentence: str
    power: float

    @property
    def worst(self) -> MissingForce:
        """Return the run that misses most."""
        return max(self.forces, key=lambda one: one.rms)


def missing_force(base: Hypothesis, rules: Rules = RULES) -> MissingForceAnalysis | None:
    """Return the force that a hypothesis misses in its fitted runs; None of another rig's.

    Args:
        base: with its estimator, process noise and parameters.
        rules: that say how much process noise the cameras alone ask for.
    """
    estimator, system = base.estimator, base.estimator.system
    if not isinstance(system, Hopper) or not any(estimator.noise.values()):
        return None
    forces = tuple(force_of(base, system, k) for k in range(len(system.names)))
    names = [name for name in _TERMS if any(name in f.coordinates for f in forces)]
    found = sorted((_dependence(forces, name) for name in names), key=lambda one: -one.share)
    misses = any(
        q > rules.noise_share * system.strong[group]
        for group, q in estimator.noise.items()
        if estimator.depends_on(group)
    )
    rows = _rows(forces, "time", [])
    power = float(np.mean(rows.force**2)) / rows.noise
    sentence = _sentence(found[0], misses) if power > _PRESENT else ABSENT
    return MissingForceAnalysis(forces, tuple(found), sentence, power)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Force and terms of all runs, both components made white.

    Args:
        force: (2 n,).
        columns: (2 n, 2 c), the terms as a force forward, then as one up.
        folds: (2 n,) number of the piece that is left out together.
        noise: mean square of `force` where only the cameras' noise is.
    """

    force: Array
    columns: Array
    folds: NDArray[np.int64]
    noise: float


def _noise(forces: Sequence[MissingForce], root: Array) -> float:
    """Return the mean square of white components where only the cameras' noise is."""
    sizes = [float(np.trace(root @ f.response.noise @ root.T)) / 2 for f in forces]
    return float(np.average(sizes, weights=[f.usable.sum() for f in forces]))


def _dependence(forces: Sequence[MissingForce], name: str) -> Dependence:
    """Return how much a coordinate explains, and by which law."""
    terms = _TERMS[name]
    every = list(terms.values())
    share, coefficients = _explained(_rows(forces, name, every))
    alone = {law: _explained(_rows(forces, name, [term])) for law, term in terms.items()}
    law = max(alone, key=lambda key: alone[key][0])
    best = max(share, alone[law][0])
    if clear := alone[law][0] >= _WHOLE * best:
        every, coefficients = [terms[law]], alone[law][1]
    components = coefficients.reshape(2, -1)  # of the force forward, and up
    values, coordinate = (np.concatenate(parts) for parts in zip(*(
        (np.column_stack([_columns(term, f.coordinates[name]) for term in every])[f.usable],
         f.coordinates[name][f.usable])
        for f in forces if name in f.coordinates
    ), strict=True))  # fmt: skip
    fitted = values @ components.T
    direction, where = _direction(forces, fitted)
    pushed = fitted @ direction
    size = float(np.sqrt(np.mean(pushed**2)))
    kind, _, axis = name.partition(" ")
    if axis in _AXES and kind in ("displacement", "velocity"):
        pushed = pushed * direction[_AXES.index(axis)]  # zero where the force is across it
    sign = float(np.sign(pushed @ coordinate)) if np.any(pushed) else 0.0
    turning = _turning(coordinate, pushed) if kind == "velocity" else ""
    chosen = law if clear else turning
    return Dependence(name, _UNITS[name], max(best, 0.0), chosen, direction, where, size, sign)


def _direction(forces: Sequence[MissingForce], fitted: Array) -> tuple[Array, str]:
    """Return the direction in which a fitted force is given, (2,), and what to call it.

    A path that is longer than wide shows forces along it only: two components would share one
    force. Else the component is taken that is more sure.
    """
    rates = [np.column_stack([f.coordinates[f"velocity {one}"] for one in _AXES]) for f in forces]
    moved = np.concatenate([rate[f.usable] for rate, f in zip(rates, forces, strict=True)])
    _, sizes, axes = np.linalg.svd(moved, full_matrices=False)
    if sizes[1] < _STRAIGHT * sizes[0]:
        first = axes[0] * (1.0 if axes[0][0] >= 0 else -1.0)
        return np.asarray(first, dtype=np.float64), "along T's path"
    spread = np.sqrt(np.diag(np.linalg.inv(_usual(forces))))
    along = int(np.argmax(np.sqrt(np.mean(fitted**2, axis=0)) / spread))
    return np.eye(2)[along], _AXES[along]


def _turning(velocity: Array, fitted: Array) -> str:
    """Return in words how a force changes sides as T gets faster; empty where it does not."""
    along, speed = fitted * np.sign(velocity), np.abs(velocity)
    usual, most = np.quantile(speed, (0.5, 0.9))
    slow = float(np.sum(along[speed < usual]))
    fast = float(np.sum(along[speed > most]))
    if slow * fast >= 0:
        return ""
    sides = ("with", "against") if slow > 0 else ("against", "with")
    return f"{sides[0]} the motion where slow, {sides[1]} it where fast"


def _usual(forces: Sequence[MissingForce]) -> Array:
    """Return the inverse of the usual covariance of a smoothed force, (2, 2)."""
    return np.asarray(np.mean(np.concatenate([f.information[f.usable] for f in forces]), axis=0))


def _rows(forces: Sequence[MissingForce], name: str, terms: Sequence[_Term]) -> _Rows:
    """Return the regression of the force on terms of a coordinate; zero where a run has it not."""
    every, outputs, folds = [], [], []
    root: Array = np.linalg.cholesky(_usual(forces)).T.astype(np.float64)
    for one in forces:
        kept = one.usable
        coordinate = one.coordinates.get(name, np.zeros(len(one.times)))
        every_term = (_columns(term, coordinate) for term in terms)
        values = np.column_stack([np.empty((len(one.times), 0)), *every_term])
        values *= name in one.coordinates
        moved = one.response.of(values - values.mean(axis=0))[kept]
        every.append(moved.reshape(len(moved), 2, 2 * values.shape[1]))
        outputs.append(one.force[kept] - one.force[kept].mean(axis=0))
        pieces = ((one.times[kept] - one.times[0]) / _PIECE_S).astype(np.int64)
        folds.append(pieces % _FOLDS)
    values, force = np.concatenate(every), np.concatenate(outputs)
    white = np.asarray(force @ root.T, dtype=np.float64)
    columns = np.asarray(root @ values, dtype=np.float64)
    return _Rows(
        white.ravel(),
        columns.reshape(2 * len(values), values.shape[2]),
        np.repeat(np.concatenate(folds), 2),
        _noise(forces, root),
    )


def _explained(rows: _Rows) -> tuple[float, Array]:
    """Return the share of the variance that columns explain where unseen, and coefficients."""
    left = np.empty_like(rows.force)
    for fold in np.unique(rows.folds):
        out = rows.folds == fold
        if out.all():
            return 0.0, np.zeros(rows.columns.shape[1])
        found = _robust(rows.columns[~out], rows.force[~out])
        left[out] = rows.force[out] - rows.columns[out] @ found
    weights = _weights(left)
    total = float(np.sum(weights * rows.force**2))
    noise = min(rows.noise * float(weights.sum()), _MOST_NOISE * total)
    share = (total - float(np.sum(weights * left**2))) / max(total - noise, 1e-300)
    return min(share, 1.0), _robust(rows.columns, rows.force)


def _robust(columns: Array, force: Array) -> Array:
    """Return the coefficients of a Huber regression."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    scaled, weights, found = columns / size, np.ones(len(force)), np.zeros(columns.shape[1])
    for _ in range(_ROUNDS):
        root = np.sqrt(weights)
        found = np.linalg.lstsq(scaled * root[:, None], force * root, rcond=1e-6)[0]
        weights = _weights(force - scaled @ found)
    return np.asarray(found / size)


def _weights(left: Array) -> Array:
    scale = max(float(robust_sigma(left)), 1e-300)
    return np.minimum(1.0, _FAR * scale / np.maximum(np.abs(left), 1e-300))


def _columns(term: _Term, coordinate: Array) -> Array:
    values = term(coordinate)
    return values if values.ndim == 2 else values[:, None]


def _sentence(best: Dependence, misses: bool) -> str:
    """Return what is missing, in words."""
    if best.share < _CHANCE:
        return INDEPENDENT if misses else ABSENT
    size, share = f"{digits(best.size)} N", f"({100 * best.share:.0f} % of what is missing)"
    kind = best.name.split(" ")[0]
    own = best.sign != 0
    if kind == "velocity" and own and best.law in _ALONG:
        what = f"{'against' if best.sign < 0 else 'with'} the motion"
    elif kind == "displacement" and own and best.law in _ODD:
        what = f"{'towards' if best.sign < 0 else 'away from'} the middle of its motion"
    else:
        what = f"that depends on {_WHOSE.get(best.name, f'its {best.name}')}"
    return f"a force at T {what}, {size}, {best.law or 'by no simple law'} {share}"
