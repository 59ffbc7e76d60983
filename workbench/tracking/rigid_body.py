"""The markers' positions on a rigid body, learned from a take; their order and weights."""

from __future__ import annotations

import itertools

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.tracking.pose import fit_poses, on_a_line
from workbench.tracking.take import known

__all__ = ["learn_places", "marker_weights", "order_of_places", "sample_of"]

_SAMPLES = 400  # enough to average 0.2 mm of noise to 0.01 mm
_LEAST_SAMPLES = 20
_ROUNDS = 3
_SPOILT = 0.5  # a marker without which the misfit is less than this share counts less
_LEAST_WEIGHT = 1e-3
_MOST_MARKERS = 7  # 5040 orders; more markers are never reordered
_SAME_FIT_M = 1e-3  # orders whose distances fit this much worse than the best one are candidates
_UPRIGHT_RAD = np.pi / 2


def learn_places(cloud: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Learn a rigid body's marker places from its markers (generalised Procrustes analysis).

    Starts with the markers most often seen together, in the sample whose distances are nearest the
    usual ones; each round fits that body to the samples and takes each marker's median place.

    Args:
        cloud: (n, m, 3) markers seen, swaps undone [m], NaN where not.

    Returns:
        (m, 3) places about their centroid [m], NaN for a marker that is never seen beside three
        others; None where no sample shows three markers that span a plane.
    """
    seen = sample_of(cloud)
    places = _start(seen)
    if places is None:
        return None
    for _ in range(_ROUNDS):
        poses = fit_poses(places, seen)
        posed = known(poses.origin)
        turned = np.swapaxes(poses.matrix[posed], 1, 2)  # bench to body
        local = np.einsum("nij,nmj->nmi", turned, seen[posed] - poses.origin[posed, None])
        given = known(local)
        shown = given.any(axis=0)
        median = np.median if given[:, shown].all() else np.nanmedian  # ten times as fast
        places = np.full_like(places, np.nan)
        places[shown] = median(local[:, shown], axis=0)
    return places - places[known(places)].mean(axis=0)


def marker_weights(places: NDArray[np.float64], cloud: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return each marker's weight, (m,) [1], less for one that spoils the fit of the others.

    Each marker is left out in turn: a loose one, or one off its place, spoils the fit of all.

    Args:
        places: (m, 3) [m].
        cloud: (n, m, 3) [m], NaN where not seen.
    """
    seen = sample_of(cloud)
    seen = seen[(known(seen) == known(places)).all(axis=1)]
    m = len(places)
    weights = np.ones(m)
    if len(seen) < _LEAST_SAMPLES or m < 4:
        return weights
    rest, off = np.full(m, np.inf), np.full(m, np.inf)
    for k in range(m):
        kept = np.arange(m) != k
        poses = fit_poses(places[kept], seen[:, kept])
        if known(poses.origin).all():
            expected = poses.origin + poses.matrix @ places[k]
            rest[k] = np.median(poses.rmsd)
            off[k] = np.median(np.linalg.norm(seen[:, k] - expected, axis=1))
    worst = int(np.argmin(rest))
    if rest[worst] < _SPOILT * np.median(np.delete(rest, worst)):
        weights[worst] = max(_LEAST_WEIGHT, (rest[worst] / off[worst]) ** 2)
    return weights


def order_of_places(
    places: NDArray[np.float64], cloud: NDArray[np.float64], worst: float, *, upright: bool
) -> NDArray[np.intp]:
    """Return the order of given places that fits a take's markers, (m,): place of each marker.

    The order given stays where it fits within `worst` and, if `upright`, is within a quarter turn
    of the places as given; else it is the best order that does so, if there is any.

    Args:
        places: (m, 3) as given [m].
        cloud: (n, m, 3) markers seen [m], NaN where not.
        worst: greatest misfit that counts as fitting [m].
        upright: whether the body stands forward, left and up at the take's start.
    """
    m = len(places)
    given = np.arange(m)
    seen = sample_of(cloud)
    seen = seen[known(seen).all(axis=1)]
    if not len(seen) or not 3 <= m <= _MOST_MARKERS or on_a_line(places):
        return given
    orders = [given, *_orders_by_distance(places, seen)]
    fits = [_fit_and_turn(places[order], seen) for order in orders]

    def acceptable(fit: tuple[float, float]) -> bool:
        return fit[0] <= worst and (fit[1] < _UPRIGHT_RAD or not upright)

    if acceptable(fits[0]):
        return given
    others = [i for i, fit in enumerate(fits) if acceptable(fit)]
    best = min((fits[i][0] for i in others), default=0.0)
    near = [i for i in others if fits[i][0] <= best + _SAME_FIT_M]
    return orders[min(near, key=lambda i: fits[i][1])] if near else given


def sample_of(cloud: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return evenly spread samples, (k, m, 3) [m], of those with three markers or all of them.

    Args:
        cloud: (n, m, 3) [m], NaN where not seen.
    """
    count = known(cloud).sum(axis=1)
    useful = np.flatnonzero(count >= min(3, cloud.shape[1]))
    spread = np.linspace(0, len(useful) - 1, min(_SAMPLES, len(useful)))
    return cloud[useful[np.rint(spread).astype(np.intp)]]


def _start(seen: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the (m, 3) markers most often seen together, in their most usual geometry."""
    patterns, count = np.unique(known(seen), axis=0, return_counts=True)
    for pattern in patterns[np.argsort(-count, kind="stable")]:
        shown = np.flatnonzero(pattern)
        together = seen[(known(seen) == pattern).all(axis=1)][:, shown]
        if len(shown) < 3:
            continue
        distances = np.linalg.norm(together[:, :, None] - together[:, None], axis=3)
        usual = np.median(distances, axis=0)
        start = together[np.argmin(np.abs(distances - usual).sum(axis=(1, 2)))]
        if not on_a_line(start):
            places = np.full(seen.shape[1:], np.nan)
            places[shown] = start - start.mean(axis=0)
            return places
    return None


def _orders_by_distance(
    places: NDArray[np.float64], seen: NDArray[np.float64]
) -> list[NDArray[np.intp]]:
    """Return the orders of places whose mutual distances fit those of the markers best."""
    usual = np.median(np.linalg.norm(seen[:, :, None] - seen[:, None], axis=3), axis=0)
    orders = np.array(list(itertools.permutations(range(len(places)))), dtype=np.intp)
    distances = scipy.spatial.distance.cdist(places, places)[orders[:, :, None], orders[:, None, :]]
    misfit = np.sqrt(np.mean((distances - usual) ** 2, axis=(1, 2)))
    return list(orders[misfit <= misfit.min() + _SAME_FIT_M])


def _fit_and_turn(places: NDArray[np.float64], seen: NDArray[np.float64]) -> tuple[float, float]:
    """Return the median misfit [m] and the angle of the mean pose at the start [rad]."""
    poses = fit_poses(places, seen)
    posed = known(poses.origin)
    if not posed.any():
        return np.inf, np.pi
    start = scipy.spatial.transform.Rotation.from_matrix(
        poses.matrix[posed][: max(1, len(seen) // 10)]
    )
    return float(np.median(poses.rmsd[posed])), float(start.mean().magnitude())
