from __future__ import annotations

import json
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from tests.identify.robots import MODEL, NOISE_M, SHAPE, changed, driven, dropped
from workbench.errors import InputError
from workbench.identify import PointError, validate
from workbench.identify.validation import NOT_VALIDATED

TRUE = {"hinge_stiffness": 9.2, "friction_slide": 0.3, "ground_damping": 11.0}


@pytest.mark.parametrize("mode", ["clamped", "hop"])
def test_the_true_model_removes_what_is_removable(mode: str) -> None:
    true = changed(**TRUE)
    run = driven(true, mode, 18.5, 1.5, role="held_out")
    (one,) = validate([run], MODEL, true, SHAPE).runs
    assert [point.point for point in one.points] == (["foot", "T"] if mode == "hop" else ["T"])
    for point in one.points:
        assert point.noise_mm == pytest.approx(1000 * NOISE_M * np.sqrt(2), rel=0.15)
        assert point.fitted_mm == pytest.approx(point.noise_mm, rel=0.15)
        assert point.stated_mm > 2 * point.noise_mm
        assert point.removed > 0.9


def test_a_worse_model_removes_less_than_nothing() -> None:
    run = dropped(MODEL, 0.02, 0.6, role="held_out")
    pooled = validate(
        [run], changed(ground_damping=13.0), changed(ground_damping=5.0), SHAPE
    ).pooled
    assert pooled is not None
    assert pooled.fitted_mm > pooled.stated_mm


def test_where_the_stated_model_is_right_nothing_is_removable() -> None:
    run = driven(MODEL, "clamped", 14.0, 0.8, role="held_out")
    found = validate([run], MODEL, MODEL, SHAPE)
    assert found.as_json()["removable_removed"] is None
    assert str(found).splitlines()[-1].endswith("none")


def test_pooled_errors_weigh_by_samples() -> None:
    few = PointError("T", 3.0, 1.0, 0.5, 20.0, 100)
    assert few.removed == pytest.approx(0.8)
    assert few.as_json()["stated_percent"] == pytest.approx(15.0)
    assert few.as_json()["fitted_over_noise"] == pytest.approx(2.0)


def test_no_held_out_run_validates_nothing_and_says_so() -> None:
    found = validate([], MODEL, MODEL, SHAPE)
    assert str(found) == NOT_VALIDATED
    assert found.as_json() == {"held_out_runs": [], "validated": False, "why": NOT_VALIDATED}


def test_a_run_that_a_fit_saw_is_refused() -> None:
    run = dropped(MODEL, 0.02, 0.6, role="train")
    with pytest.raises(InputError, match=r"drop_20mm has role train.*held_out only"):
        validate([run], MODEL, MODEL, SHAPE)


def test_the_answer_is_json() -> None:
    run = dropped(MODEL, 0.02, 0.6, role="held_out")
    found = json.loads(
        json.dumps(validate([run], changed(ground_damping=9.0), MODEL, SHAPE).as_json())
    )
    assert found["held_out_runs"] == ["drop_20mm"]
    assert set(found["rmse_mm"]) == {"noise_floor", "stated", "fitted"}


def test_a_run_of_no_known_role_or_mode_is_refused() -> None:
    run = dropped(MODEL, 0.02, 0.6)
    with pytest.raises(InputError, match=r"no role named 'heldout'; did you mean 'held_out'\?"):
        replace(run, role=cast(Any, "heldout"))
    with pytest.raises(InputError, match=r"no mode named 'drp'; did you mean 'drop'\?; there are"):
        replace(run, mode=cast(Any, "drp"))
