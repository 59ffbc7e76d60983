"""Each effect of the independent engine acts where and as it should."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from benchmarks.bank.amounts import ABSORBED, AMOUNTS, OUTSIDE_AMOUNTS, direction
from benchmarks.bank.courses import Course
from benchmarks.bank.rod import Motion, Rod, swing
from benchmarks.bank.rod_effects import EFFECTS, OUTSIDE, perform

pytestmark = pytest.mark.long  # a benchmark tests itself

Bare = Callable[[Course], Motion]
CLAMPED = Course("clamped", 1.0, ((0.0, 12.0),))
HOP = Course("hop", 1.5, ((0.0, 18.0),))
ONLY_ON_THE_GROUND = ("foot_mass", "foot_cg", "ground_stiffness", "ground_damping",
                      "ground_hunt_crossley", "friction_level", "friction_anisotropy",
                      "sole_adhesion", "rounded_sole")  # fmt: skip
SMALL = {"hinge_stiffness": "share", "root_stiffness": "share", "hinge_damping": "share",
         "speed_scale": "share", "speed_offset": "offset", "time_offset": "late",
         "top_mass": "mass", "foot_mass": "mass", "ground_stiffness": "share",
         "ground_damping": "share", "friction_level": "share"}  # fmt: skip


@pytest.fixture(scope="module")
def bare(rod: Rod) -> Bare:
    """What the robot does without an effect, each course once."""
    return cache(lambda course: swing(rod, course))


def amounts(name: str) -> dict[str, float]:
    if name in SMALL:
        return {SMALL[name]: 0.01}
    if name == "dropped_frames":
        return {"share": 0.05, "seed": 1.0}
    return direction(name, np.random.default_rng(0))


def test_every_effect_has_an_amount_or_is_absorbed() -> None:
    assert set(EFFECTS) == set(AMOUNTS) | set(ABSORBED)
    assert set(OUTSIDE) == set(OUTSIDE_AMOUNTS)


@pytest.mark.parametrize("name", [*EFFECTS, *OUTSIDE])
def test_an_effect_moves_the_runs_that_show_it(rod: Rod, bare: Bare, name: str) -> None:
    for course, acts in ((CLAMPED, name not in ONLY_ON_THE_GROUND), (HOP, True)):
        without, moved = bare(course), perform(rod, {name: amounts(name)}, course)
        count = min(len(without.top), len(moved.top))
        off = max(
            float(np.abs(moved.top[:count] - without.top[:count]).max()),
            float(np.abs(moved.times[:count] - without.times[:count]).max()),
        )
        assert (off > 1e-6) if acts else (off < 1e-12)


@pytest.mark.parametrize("name", [*EFFECTS, *OUTSIDE])
def test_an_effect_of_nothing_changes_nothing(rod: Rod, bare: Bare, name: str) -> None:
    kept = ("time", "yields", "room", "forward", "up", "seed") if name in OUTSIDE else ()
    nothing = {k: v if k in kept else 0.0 for k, v in amounts(name).items()}
    short = HOP._replace(duration=0.3)
    assert np.array_equal(perform(rod, {name: nothing}, short).top, bare(short).top)


def test_a_pulling_tether_holds_t_where_a_pull_does(rod: Rod) -> None:
    pulled = swing(rod, Course("decay", 0.1, pull=0.2)).top[0]
    tied = perform(rod, {"tether": {"pull": 0.2}}, Course("clamped", 0.1)).top[0]
    assert tied == pytest.approx(pulled, abs=1e-9)


def test_a_set_of_the_root_turns_the_strip_as_a_whole(rod: Rod) -> None:
    """Weightless, T turns about the root by the set's angle."""
    light = Rod(dict(rod.values) | {"gravity": 0.0}, rod.angles, rod.length)
    before = swing(light, Course("clamped", 0.05)).top[0]
    after = perform(light, {"rest_shape_drift": {"root": 0.1}}, Course("clamped", 0.05)).top[0]
    root = np.array([light.values["beam_root"], 0.0])
    c, s = np.cos(0.1), np.sin(0.1)
    turned = root + np.array([[c, s], [-s, c]]) @ (before - root)
    assert after == pytest.approx(turned, abs=1e-9)


def test_droop_is_the_motor_s_torque_times_the_slope(rod: Rod) -> None:
    """Slow turns of a stiff robot: gravity asks for m g r cos of the angle."""
    stiff = {"hinge_stiffness": 950.0, "root_stiffness": 1200.0}
    still = Rod(dict(rod.values) | stiff, rod.angles, rod.length, modes=3)
    course = Course("clamped", 8.0, ((0.0, 3.0),))
    motion = perform(still, {"motor_droop": {"slope": 2.0}}, course)
    steady = slice(240, None)
    speed = np.gradient(motion.rotor_angle, motion.times)[steady]
    cosine = np.cos(motion.rotor_angle[steady])
    amplitude = 2 * np.mean((speed - speed.mean()) * cosine)
    v = still.values
    lever = (v["rotor_mass"] + v["rotor_arm_mass"] / 2) * v["rotor_radius"]
    assert amplitude == pytest.approx(2.0 * 9.81 * lever, rel=0.05)


def test_ripple_is_a_share_of_the_speed_against_the_world(rod: Rod) -> None:
    stiff = {"hinge_stiffness": 950.0, "root_stiffness": 1200.0}
    still = Rod(dict(rod.values) | stiff, rod.angles, rod.length, modes=3)
    motion = perform(still, {"speed_ripple": {"cos_1": 0.1}}, Course("clamped", 8.0, ((0.0, 5.0),)))
    steady = slice(240, None)
    speed = np.gradient(motion.rotor_angle, motion.times)[steady]
    cosine = np.cos(motion.rotor_angle[steady])
    assert np.polyfit(cosine, speed, 1) == pytest.approx([0.5, 5.0], rel=0.03)


def test_friction_in_the_strip_ends_a_swing_that_viscous_damping_does_not(rod: Rod) -> None:
    course = Course("decay", 8.0, pull=0.2)
    viscous = swing(rod, course).top[-120:, 0]
    rubbing = perform(rod, {"hinge_coulomb_friction": {"torque": 2e-3}}, course).top[-120:, 0]
    assert np.ptp(rubbing) < 0.1 * np.ptp(viscous)


def test_a_stiffening_strip_rings_faster_at_greater_amplitude(rod: Rod) -> None:
    def turns(pull: float, k3: float) -> int:
        top = perform(rod, {"hinge_cubic_stiffness": {"k3": k3}}, Course("decay", 8.0, pull=pull))
        path = top.top[:, 0] - top.top[-600:, 0].mean()
        return int(np.count_nonzero(np.diff(np.sign(path))))

    assert turns(0.6, 600.0) > turns(0.6, 0.0)


@pytest.mark.parametrize("most", [0.05, pytest.param(0.2, marks=pytest.mark.long)])
def test_more_dropped_frames_are_lost_earlier_and_one_by_one(rod: Rod, most: float) -> None:
    whole = len(swing(rod, CLAMPED).times)
    lost = [
        whole - len(perform(rod, {"dropped_frames": {"share": s, "seed": 534.0}}, CLAMPED).times)
        for s in np.linspace(0, most, round(1000 * most) + 1)
    ]
    assert lost[0] == 0
    assert lost[-1] == pytest.approx(most * whole, abs=1)
    assert set(np.diff(lost)) <= {0, 1}
