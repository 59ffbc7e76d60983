"""A cause's own numbers have a prior: what runs do not tell apart stays where it is likely."""

from __future__ import annotations

import pytest

from tests.diagnose.hidden import DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import HopperRig
from workbench.diagnose.fits import Fits

LOSS = -0.05
ASKED = (Asked("decay", 0.3, 3.0), Asked("decay", 0.8, 3.0), Asked("clamped", 9.0, 3.0))


def test_a_strip_softer_in_one_part_is_not_fitted_as_softer_in_all() -> None:
    """Softer in all three parts is less stiffness: without a prior near_top ended at -0.082."""
    robot = truth(3, {"local_stiffness_loss": {"near_top": LOSS}})
    fits = Fits(HopperRig(runs_of(robot, 3, ASKED), DOCUMENT, SHAPE), threads=1)
    base = fits.base()
    promise = next(one for one in fits.promises(base) if one.name == "local_stiffness_loss")
    found = fits.refit([promise.name], base, promise)
    assert found is not None
    print(base.cost - found.cost, found.prior, found.values)
    assert base.cost - found.cost > 50
    parts = {key: found.values[f"{promise.name} {key}"] for key in ("near_foot", "middle")}
    assert parts == pytest.approx(dict.fromkeys(parts, 0.0), abs=0.015)
    assert found.values[f"{promise.name} near_top"] == pytest.approx(LOSS, abs=0.01)
