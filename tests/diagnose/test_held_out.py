"""Runs held out are judged by how likely they are, given those that were fitted."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.diagnose.hidden import DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import HopperRig
from workbench.diagnose.fits import Fits
from workbench.diagnose.held_out import root_of, unseen
from workbench.fit import Estimator, ParameterVector
from workbench.fit.linear import eliminated

ASKED = (Asked("decay", 0.1, 2.0), Asked("decay", 0.15, 2.0))
LAST = Asked("decay", 0.9, 3.0, "held_out")


def log_det(jacobian: NDArray[np.float64]) -> float:
    return float(np.linalg.slogdet(jacobian.T @ jacobian)[1])


def test_what_is_unseen_costs_what_it_adds_to_a_fit_of_all() -> None:
    robot = truth(6, {}, off=0.15)  # stiffness and damping are learnt from the runs
    rig = HopperRig(runs_of(robot, 5, (*ASKED, LAST)), DOCUMENT, SHAPE)
    every = HopperRig(runs_of(robot, 5, (*ASKED, LAST._replace(role="train"))), DOCUMENT, SHAPE)
    fits, whole = Fits(rig, threads=1), Fits(every, threads=1)
    one = fits.base()
    both = whole.whole((), one.values)
    assert both.estimator.noise == one.estimator.noise
    added = both.cost + log_det(both.jacobian) - one.cost - log_det(one.jacobian)
    system = rig.system([2], one.estimator.vector.shared)
    last = Estimator.of(system, ParameterVector(system.parameters), one.estimator.noise, threads=1)
    (held,) = unseen(one, last)
    assert float(held.sum()) == pytest.approx(added, abs=1.5)


def test_a_run_held_out_has_the_process_noise_that_it_asks_for() -> None:
    """One of a robot whose root has play asks for more than those of one without."""
    robot, other = truth(6, {}, off=0.0), truth(6, {"root_play": {"gap": 0.002}}, off=0.0)
    runs, (apart,) = runs_of(robot, 5, ASKED), runs_of(other, 6, (LAST._replace(value=0.8),))
    fits = Fits(HopperRig([*runs, apart], DOCUMENT, SHAPE), threads=1)
    base = fits.base()
    given = fits.unseen(base)
    assert given.noise == base.estimator.noise
    (found,) = fits.judged(base)
    (one,) = unseen(base, given.with_noise(dict(given.noise) | {"beam": 30 * given.noise["beam"]}))
    print(float(found.sum()), float(one.sum()))
    assert found.sum() == pytest.approx(one.sum(), abs=20)  # 360 costlier by what is given


def test_what_runs_say_of_their_own_numbers_leaves_a_root_of_the_others() -> None:
    """Cameras ten times as good: the difference that is left is below what rounding takes."""
    own = np.array([True, False, False])
    jacobian = np.array([[1e9, 1e9, 1.0], [1e9, 1e9, 3.0], [0.0, 0.0, 2.0]])
    left = eliminated(jacobian.T @ jacobian, own)
    assert np.linalg.eigvalsh(left).min() < 0
    root = root_of(left)
    assert np.isfinite(root).all()
    assert np.linalg.eigvalsh(root.T @ root).min() >= 0
    assert (root.T @ root)[1, 1] == pytest.approx(left[1, 1], rel=0.01)


def test_a_base_is_fitted_again_from_where_what_frees_its_numbers_ended() -> None:
    """That has another prior for them, whose derivatives are not the base's."""
    rig = HopperRig(runs_of(truth(6, {}, off=0.15), 5, ASKED), DOCUMENT, SHAPE)
    fits = Fits(rig, threads=1)
    base, freeing = fits.base(), next(n for n in fits.candidates if fits.candidates.frees(n))
    promise = next(one for one in fits.promises(base) if one.name == freeing)
    freed = fits.refit([freeing], base, promise)
    assert freed is not None
    own, others = (one.jacobian[one.estimator.edges[-2] :] for one in (base, freed))
    assert not np.allclose(own, others)
    assert fits.again(base, freed).cost == pytest.approx(base.cost, abs=1.0)
