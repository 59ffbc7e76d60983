from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identify.robots import MODEL, SHAPE, changed, driven, dropped
from workbench.errors import InputError
from workbench.identify import identify_contact
from workbench.identify.contact import FRICTION, GROUND
from workbench.identify.excitation import first_slip, lands
from workbench.identify.kinked import slopes_over
from workbench.identify.problem import Problem
from workbench.sim import Condition, make_robot, sample_times, simulate

TRUE = {"ground_stiffness": 155.0, "ground_damping": 13.0, "friction_slide": 0.38,
        "friction_stick": 0.47}  # fmt: skip


@pytest.mark.long
def test_drops_tell_the_ground_whose_height_was_read_off_badly() -> None:
    true = changed(**TRUE)
    drops = [dropped(true, 0.01, 0.9), dropped(true, 0.03, 0.9)]
    drops = [replace(run, height=run.height + off)
             for run, off in zip(drops, (1e-3, -1e-3), strict=True)]  # fmt: skip
    model = changed(**TRUE | {"ground_stiffness": 140.0, "ground_damping": 15.0})
    found = identify_contact(drops, model, SHAPE, GROUND)
    assert found.values["ground_stiffness"] == pytest.approx(155.0, rel=0.02)
    assert found.values["ground_damping"] == pytest.approx(13.0, rel=0.03)
    for name, estimate in found.estimates.items():
        assert estimate.low < estimate.value < estimate.high, name
        assert estimate.half_width < 0.05 * TRUE[name], name
    assert found.misfit == pytest.approx(1.0, abs=0.1)
    assert found.warnings == ()


@pytest.mark.long
def test_the_first_hops_tell_both_levels_of_friction() -> None:
    true = changed(**TRUE)
    hop = driven(true, "hop", 18.5, 1.6)
    model = changed(**TRUE | {"friction_slide": 0.45, "friction_stick": 0.55})
    found = identify_contact([hop], model, SHAPE, FRICTION)
    assert found.values["friction_slide"] == pytest.approx(0.38, rel=0.02)
    assert found.values["friction_stick"] == pytest.approx(0.47, rel=0.02)
    assert not found.not_determined
    assert first_slip(hop) < found.windows["hop_18.5"] <= 1.6


def test_what_is_not_excited_is_said_and_not_fitted() -> None:
    still = driven(MODEL, "hop", 6.0, 1.5)
    found = identify_contact([still], MODEL, SHAPE)
    assert not found.estimates
    assert "never lands" in found.not_determined["ground_stiffness"]
    assert "never slips" in found.not_determined["friction_stick"]
    assert found.solution is None


def test_a_fall_that_never_ends_does_not_land() -> None:
    run = dropped(MODEL, 0.02, 1.0)
    assert lands(run)
    names = run.motion.names
    values = run.motion.values.copy()
    falling = -4.9 * np.maximum(run.motion.times, 0.0) ** 2
    values[:, names.index("foot_z_m")] = falling
    assert not lands(replace(run, motion=replace(run.motion, values=values)))


def test_friction_is_not_told_by_drops() -> None:
    drop = dropped(MODEL, 0.02, 0.9)
    found = identify_contact([drop], MODEL, SHAPE, FRICTION)
    assert set(found.not_determined) == set(FRICTION)


def test_the_first_slip_is_that_of_the_simulated_corners() -> None:
    hop = driven(MODEL, "hop", 18.5, 2.0)
    condition = Condition("hop", np.full(len(sample_times(2.0)), 18.5))
    assert np.isfinite(first_slip(hop))
    # the corners that slide, of a motor without lag: it starts about 0.05 s earlier
    motion = simulate(make_robot(MODEL.values(), SHAPE), condition).motion
    slid = motion.times[motion["corners_sliding"] > 0]
    assert first_slip(hop) == pytest.approx(slid[0], abs=0.2)


def test_a_cloud_s_slopes_are_those_of_small_steps_where_nothing_slips() -> None:
    runs = [driven(MODEL, "hop", 17.0, 0.5), driven(MODEL, "hop", 19.0, 0.5)]
    problem = Problem(runs, make_robot(MODEL.values(), SHAPE), ["ground_damping"])
    x = problem.start
    fine = problem.jacobian(x)
    wide = slopes_over(problem, x, fine, np.full(len(x), 1e-3)).jacobian
    assert np.abs(fine).max() > 10
    np.testing.assert_allclose(wide, fine, atol=0.02 * np.abs(fine).max())


def test_a_beam_s_parameter_is_refused() -> None:
    with pytest.raises(InputError, match=r"hinge_stiffness.*these are: ground_stiffness"):
        identify_contact([dropped(MODEL, 0.02, 0.9)], MODEL, SHAPE, ("hinge_stiffness",))


def test_runs_off_the_ground_are_refused() -> None:
    with pytest.raises(InputError, match=r"no run touches the ground.*protocols/drop\.yaml"):
        identify_contact([driven(MODEL, "clamped", 14.0, 0.6)], MODEL, SHAPE)
