"""The numbers of a read-back under names with units."""

from __future__ import annotations

import math

import numpy as np

from workbench.as_built.cost import Cost
from workbench.as_built.deviation import Deviation
from workbench.photo import AsBent

__all__ = ["numbers_of"]


def numbers_of(bent: AsBent, deviation: Deviation, cost: Cost | None) -> dict[str, object]:
    """Return what a beam as it was bent comes to, under names with units, for the command line."""
    found: dict[str, object] = {
        "angles_rad": bent.angles.tolist(),
        "uncertainty_rad": None if bent.uncertainty is None else bent.uncertainty.tolist(),
        "deviation_deg": np.degrees(deviation.difference).tolist(),
        "foot_seen": bent.foot_seen,
        "correct": [
            {"joint": k, "deg": -math.degrees(deviation.difference[k])} for k in deviation.correct
        ],
        "tip_error_mm": (1000 * deviation.tip_error).tolist(),
        "reading": bent.notes,
    }
    if cost is not None:
        found["distance"] = {
            "omega_rad_s": cost.omega,
            "target_m": cost.target,
            "bent_m": cost.bent,
            "around_target_m": cost.around_target.tolist(),
            "around_bent_m": cost.around_bent.tolist(),
            "change_m": cost.change,
            "change_error_m": cost.change_error,
            "falls": cost.falls,
        }
    return found
