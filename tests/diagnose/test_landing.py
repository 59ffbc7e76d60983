"""Where a foot lands: a base without the cause bends the floor for it, and the cause is found."""

from __future__ import annotations

import pytest

from tests.diagnose.hidden import DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import HopperRig
from workbench.diagnose.fits import Fits
from workbench.diagnose.landing import LandingFits

ASKED = (Asked("decay", 0.8, 2.0), Asked("hop", 18.0, 3.5))
FORWARD = 0.008


@pytest.mark.budget(40)
def test_a_cause_for_which_the_base_bends_the_floor_is_found_from_the_stated_one() -> None:
    robot = truth(3, {"foot_cg": {"forward": FORWARD}}, off=0.0)
    rig = HopperRig(runs_of(robot, 3, ASKED), DOCUMENT, SHAPE)
    fits = Fits(rig, threads=1)
    still = fits.of(rig, fits.landing)
    hopping = LandingFits(fits, still, still.base())
    base = hopping.whole((), {})
    (mass,) = [p for p in rig.base if p.name == "foot_mass"]
    assert mass.number(base.values["foot_mass"]) < -2  # deviations, of a mass that is right
    promises = hopping.promises(base)
    print([(one.name, round(one.gain)) for one in promises[:4]])
    assert promises[0].name == "foot_cg"
    found = hopping.refit(["foot_cg"], base, promises[0])
    assert found is not None
    print(base.cost - found.cost, found.values)
    assert found.values["foot_cg forward"] == pytest.approx(FORWARD, abs=0.002)
    assert abs(mass.number(found.values["foot_mass"])) < 2
    assert base.cost - found.cost > 2 * promises[0].gain  # strong correction leaves little of it
    absent = next(one for one in promises if one.name == "friction_anisotropy")
    assert hopping.refit([absent.name], base, absent) is None

    ended = hopping.ended(found)
    noise, strong = ended.estimator.noise, ended.estimator.system.strong
    assert all(noise[group] >= 0.5 * strong[group] for group in ("hopping beam", "foot"))
    assert noise["beam"] == found.estimator.noise["beam"]
    error = hopping.deviations(ended)["foot_cg forward"]
    print(ended.values["foot_cg forward"], error)
    assert abs(ended.values["foot_cg forward"] - FORWARD) < 3 * error < FORWARD

    (hop,) = hopping.landing
    assert hopping.shows(hop, ["foot_cg"])
    assert not any(hopping.shows(run, ["foot_cg"]) for run in hopping.train if run != hop)
    assert 0 < hopping.samples(["foot_cg"]) < hopping.samples() == hopping.samples(["air_drag"])
