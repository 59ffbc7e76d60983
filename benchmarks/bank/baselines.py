"""Three dumb engines, which a diagnosis must beat on the same cases.

They get more than they could find themselves: the base fit of the real engine and its neighbourhood
of all causes. `single` names the one cause that fits the training runs best, always. `bic` adds
causes as long as the Bayesian information criterion falls, counting every sample. `sindy` looks for
terms in the acceleration that the base leaves (Brunton, Proctor, Kutz 2016, through `pysindy`) and
names the cause whose term is the largest.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from workbench.diagnose import Diagnosis
from workbench.diagnose.minimum import prior_of, step_from
from workbench.motion import ROTOR_ANGLE

__all__ = ["NAMES", "TERMS", "bic", "plain_answers", "sindy", "single"]

Array = NDArray[np.float64]
NAMES = ("single", "bic", "sindy")
_MOST = 6  # causes that BIC may add
_WINDOW, _ORDER = 15, 3  # of the smoothing: an eighth of a second
_DROPPED = 0.015  # of the accelerations' root mean square: what sparse regression drops
_SMALLEST = 0.05  # of the same: no term is worth a name

TERMS: Mapping[str, str] = {
    "place": "hinge_stiffness",
    "place^3": "hinge_cubic_stiffness",
    "rate": "hinge_damping",
    "rate |rate|": "hinge_quadratic_damping",
    "sign of rate": "hinge_coulomb_friction",
    "once a turn": "rotor_unbalance",
    "twice a turn": "speed_ripple",
    "time": "speed_drift",
    "constant": "rest_shape_drift",
}
"""Term of the library -> the cause that it speaks for."""


def plain_answers(found: Diagnosis) -> dict[str, dict[str, object]]:
    """Return what each says of a case that was diagnosed, as `workbench diagnose --json` would."""
    return {"single": single(found), "bic": bic(found), "sindy": sindy(found)}


def single(found: Diagnosis) -> dict[str, object]:
    """Name the cause whose release lowers the misfit of the training runs most."""
    gains = {name: _gain(found, (name,)) for name in found.refits.base.near.heard}
    return _named([max(gains, key=lambda name: gains[name])])


def bic(found: Diagnosis) -> dict[str, object]:
    """Name all causes that lower the criterion one after the other; none is CLEAN."""
    near, lowest = found.refits.base.near, 0.0
    chosen: tuple[str, ...] = ()
    for _ in range(_MOST):
        more = [(*chosen, name) for name in near.heard if name not in chosen]
        told = [_criterion(found, causes) for causes in more]
        if min(told, default=0.0) >= lowest:
            break
        chosen, lowest = more[int(np.argmin(told))], min(told)
    return _named(chosen)


def sindy(found: Diagnosis) -> dict[str, object]:
    """Name the cause of the largest term in the acceleration that the base leaves."""
    features, targets = (np.vstack(parts) for parts in zip(*_accelerations(found), strict=True))
    sizes = np.sqrt(np.mean(features**2, axis=0)) + 1e-12
    weights = _sparse(features / sizes, targets)
    share = np.sqrt(np.sum(weights**2, axis=0)) / np.sqrt(np.mean(targets**2) + 1e-30)
    if share.max() < _SMALLEST:
        return _named([])
    return _named([list(TERMS.values())[int(np.argmax(share))]])


def _sparse(features: Array, targets: Array) -> Array:
    """Return the coefficients of each target, (targets, features), small ones dropped."""
    pysindy = import_module("pysindy")  # only who runs the bank has it
    scale = float(np.sqrt(np.mean(targets**2))) or 1.0
    optimizer = pysindy.STLSQ(threshold=_DROPPED, alpha=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it tells when it drops all terms
        optimizer.fit(features, targets / scale)
    return np.atleast_2d(optimizer.coef_) * scale


def _accelerations(found: Diagnosis) -> Iterator[tuple[Array, Array]]:
    """Yield terms (n, t) and the acceleration of T that the base leaves (n, 2), run by run."""
    linear, rig = found.refits.base.fit.linear, found.rig
    asked = [(k, found.layout.values(linear.z, k)) for k in linear.runs]
    for (k, _), predicted in zip(asked, rig.predict(asked, np.inf), strict=True):
        run = rig.runs[k]
        at = [run.channels.index(name) for name in ("top_x_m", "top_z_m")]
        seen: NDArray[np.bool_] = np.all(run.valid[:, at], axis=1)
        if seen.sum() < 2 * _WINDOW:
            continue
        step = float(run.times[1] - run.times[0])
        place = _filled(run.times, run.values[:, at], seen)
        left = _filled(run.times, (run.values - predicted)[:, at], seen)
        rate, left = _smooth(place, step, 1), _smooth(left, step, 2)
        place = _smooth(place, step, 0)
        angle = np.zeros(len(place))
        if ROTOR_ANGLE in run.channels:
            column = run.channels.index(ROTOR_ANGLE)
            angle = _filled(run.times, run.values[:, [column]], run.valid[:, column])[:, 0]
        yield _library(run.times, place - place.mean(axis=0), rate, angle), left


def _smooth(values: Array, step: float, derivative: int) -> Array:
    smooth = savgol_filter(values, _WINDOW, _ORDER, deriv=derivative, delta=step, axis=0)
    return np.asarray(smooth, dtype=np.float64)


def _library(times: Array, place: Array, rate: Array, angle: Array) -> Array:
    """Return the terms along the way on which T swings most, (n, terms) in the order of `TERMS`."""
    way = np.linalg.svd(place, full_matrices=False)[2][0]
    x, v = place @ way, rate @ way
    return np.column_stack([
        x, x**3, v, v * np.abs(v), np.sign(v), np.cos(angle), np.cos(2 * angle),
        times - times.mean(), np.ones(len(x)),
    ])  # fmt: skip


def _filled(times: Array, values: Array, seen: NDArray[np.bool_]) -> Array:
    """Return values with straight lines where they were not seen."""
    return np.column_stack([np.interp(times, times[seen], column[seen]) for column in values.T])


def _gain(found: Diagnosis, causes: tuple[str, ...]) -> float:
    linear, layout = found.refits.base.fit.linear, found.layout
    prior = prior_of(layout, causes)
    return step_from(layout, linear.z, linear.curvature, linear.gradient, prior).gain


def _criterion(found: Diagnosis, causes: tuple[str, ...]) -> float:
    """Return the criterion beside that of the base alone."""
    gained = _gain(found, causes) - _gain(found, ())
    count = len(found.layout.quantities(causes))
    return count * np.log(found.refits.base.near.samples) - 2 * gained


def _named(causes: Sequence[str]) -> dict[str, object]:
    return {
        "answer": "NAMED" if causes else "CLEAN",
        "causes": [{"effect": name, "parameters": {}} for name in causes],
    }
