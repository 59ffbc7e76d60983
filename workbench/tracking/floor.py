"""The plane of the floor, fitted to the positions where the foot stood.

Appendix C subtracts 0.015 times the forward coordinate from the height. Here the slope is fitted
and reported with its error, and the motion stays as measured: contacts alone cannot distinguish a
sloping floor from tilted cameras.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.motion import FOOT, position
from workbench.noise import robust_sigma
from workbench.timeseries import TimeSeries
from workbench.tracking.missing import runs

__all__ = ["Floor", "fit_floor"]

_STANDING_M_S = 0.04  # a standing foot rocks at 0.03 m/s
_STANDING_S = 0.03  # the top of a hop is as slow for a sample or two only
_SPEED_OVER = 2  # samples to either side
_LEAST_CONTACTS = 5
_LEAST_SPREAD_M = 0.03
_LEAST_SIDEWAYS_M = 0.03
_INLIER_M = 1e-3  # scatter of the positions of a rocking foot


@dataclass(frozen=True)
class Floor:
    """The plane that the foot stands on.

    Args:
        slope_x_rad: rise forward.
        slope_x_error_rad: its standard error.
        slope_y_rad: rise to the left; None where the foot stays on one line.
        slope_y_error_rad: its standard error.
        contacts: number of positions where the foot stood.
        left_m: robust standard deviation of their heights about the plane.
    """

    slope_x_rad: float
    slope_x_error_rad: float
    slope_y_rad: float | None
    slope_y_error_rad: float | None
    contacts: int
    left_m: float


def fit_floor(motion: TimeSeries) -> Floor | None:
    """Fit a plane to the positions where the foot stood, robust against outliers.

    The foot stands where it is slower than 0.04 m/s for 0.03 s. Each such stretch gives one
    position, its median. The fit has the soft L1, then the Cauchy loss, with a scale of 1 mm.

    Args:
        motion: channels of `workbench.motion`, evenly sampled.

    Returns:
        The floor, or None where the foot stood at fewer than five positions or within 3 cm.
    """
    places = _places(motion)
    if len(places) < _LEAST_CONTACTS or np.ptp(places[:, 0]) < _LEAST_SPREAD_M:
        return None
    sideways = bool(np.ptp(places[:, 1]) >= _LEAST_SIDEWAYS_M)
    middle = np.median(places, axis=0)
    terms = np.column_stack([np.ones(len(places)), (places - middle)[:, : 2 if sideways else 1]])
    height = places[:, 2] - middle[2]
    found = np.zeros(terms.shape[1])
    for loss in ("soft_l1", "cauchy"):  # the second ignores outliers, but needs a start
        found = scipy.optimize.least_squares(
            lambda x: height - terms @ x, found, loss=loss, f_scale=_INLIER_M
        ).x
    sigma = float(robust_sigma(height - terms @ found, centred=True))
    spare = len(places) / max(1, len(places) - terms.shape[1])
    errors = sigma * np.sqrt(spare * np.diag(np.linalg.inv(terms.T @ terms)))
    slopes = np.arctan(found)
    return Floor(
        slope_x_rad=float(slopes[1]),
        slope_x_error_rad=float(errors[1]),
        slope_y_rad=float(slopes[2]) if sideways else None,
        slope_y_error_rad=float(errors[2]) if sideways else None,
        contacts=len(places),
        left_m=sigma,
    )


def _places(motion: TimeSeries) -> NDArray[np.float64]:
    """Return the positions where the foot stood, (m, 3) [m]."""
    foot, t = position(motion, FOOT), motion.times
    speed = np.full(len(t), np.nan)
    if len(t) <= 2 * _SPEED_OVER:
        return np.empty((0, 3))
    over = 2 * _SPEED_OVER
    moved = np.linalg.norm(foot[over:] - foot[:-over], axis=1)
    speed[_SPEED_OVER:-_SPEED_OVER] = moved / (t[over:] - t[:-over])
    speed[np.isnan(foot).any(axis=1)] = np.nan  # hidden itself, seen before and after
    least = max(2, round(_STANDING_S / float(np.median(np.diff(t)))))
    stretches = runs(np.nan_to_num(speed, nan=np.inf) < _STANDING_M_S)
    stood = [np.median(foot[a:b], axis=0) for a, b in stretches if b - a >= least]
    return np.array(stood).reshape(-1, 3)
