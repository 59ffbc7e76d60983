"""Process noise and inputs that a base without the cause had left are not what a cause keeps."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose.hidden import BASE, DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import HopperRig
from workbench.diagnose.fits import Fits
from workbench.fit import Hopper

K3 = 70.0
ASKED = (Asked("decay", 0.8, 3.0), Asked("clamped", 9.0, 3.0), Asked("clamped", 15.0, 3.0))


@pytest.mark.budget(40)
def test_a_cause_ends_where_it_does_from_the_truth_by_inputs_of_its_own() -> None:
    """With less noise at once, by the base's inputs, it ended 11 costlier, at three times more."""
    robot = truth(3, {"hinge_cubic_stiffness": {"k3": K3}}, off=0.05)
    fits = Fits(HopperRig(runs_of(robot, 3, ASKED), DOCUMENT, SHAPE), threads=1)
    base = fits.base()
    promise = next(one for one in fits.promises(base) if one.name == "hinge_cubic_stiffness")
    alone = fits.refit([promise.name], base, promise)
    assert alone is not None
    found = fits.weighed(alone)
    known = {name: robot.values[name] for name in BASE} | {f"{promise.name} k3": K3}
    best = fits.whole(found.names, known)
    print([(one.cost, one.estimator.noise) for one in (base, alone, found, best)])
    assert found.cost < best.cost + 2
    assert found.estimator.noise["beam"] < 0.05 * base.estimator.noise["beam"]
    before, after = base.estimator.system, found.estimator.system
    assert isinstance(before, Hopper)
    assert isinstance(after, Hopper)
    moved = [
        float(np.std(b - a))
        for a, b in zip(before.turned, after.turned, strict=True)
        if a is not None and b is not None
    ]
    assert len(moved) == 2
    assert max(moved) > 1e-4
