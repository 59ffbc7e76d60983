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
    print(base.cost - found.cost, found.prior, found.values, found.deviations)
    assert base.cost - found.cost > 65.4  # a fit that stopped where it had nothing yet gained 65.2
    names = [f"{promise.name} {part}" for part in ("near_foot", "middle", "near_top")]
    foot, middle, top = (found.values[name] for name in names)
    assert top - (foot + middle) / 2 == pytest.approx(LOSS, abs=0.01)
    for name, true in zip(names, (0.0, 0.0, LOSS), strict=True):
        assert abs(found.values[name] - true) < found.deviations[name] < 0.03
