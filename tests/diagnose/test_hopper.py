"""The robot as a rig: an effect hidden in the twin's own data is found, and the file proves it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.diagnose.hidden import DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import Diagnosis, HopperRig, Trial, diagnose, write_diagnosis
from workbench.protocol import ModelFile, load
from workbench.sim import Condition, make_robot, simulate

RUNS = (
    Asked("clamped", 13.0, 4.0),
    Asked("clamped", 15.0, 4.0),
    Asked("decay", 0.3, 4.0),
    Asked("decay", 0.8, 4.0),
    Asked("clamped", 14.5, 4.0, "held_out"),
    Asked("decay", 1.0, 4.0, "held_out"),
)
FEW_RUNS = (
    Asked("decay", 0.3, 2.0),
    Asked("decay", 0.8, 2.0),
    Asked("decay", 1.0, 2.0, "held_out"),
)


class Hidden(NamedTuple):
    """Runs of a robot that damps more the faster it bends, by some amount [N m s^2/rad^2]."""

    runs: tuple[Asked, ...]
    damping: float


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(Hidden(FEW_RUNS, 0.05), id="ring-downs"),
        pytest.param(Hidden(RUNS, 0.03), id="all", marks=pytest.mark.long),
    ],
)
def hidden(request: pytest.FixtureRequest) -> Hidden:
    return request.param


@pytest.fixture(scope="module")
def found(hidden: Hidden, tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    robot = truth(3, {"hinge_quadratic_damping": {"c": hidden.damping}})
    rig = HopperRig(runs_of(robot, 3, hidden.runs), DOCUMENT, SHAPE)
    return diagnose(rig, tmp_path_factory.mktemp("answer"))


def test_the_hidden_effect_is_found_with_its_size(found: Diagnosis, hidden: Hidden) -> None:
    assert found.answer.kind == "NAMED"
    assert found.answer.causes == ("hinge_quadratic_damping",)
    quantity = found.quantities["hinge_quadratic_damping"]["c"]
    assert quantity.low < hidden.damping < quantity.high
    assert quantity.value == pytest.approx(hidden.damping, rel=0.2)
    assert quantity.unit == "N m s^2/rad^2"


def test_the_extension_is_proved_on_runs_held_out(found: Diagnosis, hidden: Hidden) -> None:
    held = [f"{run.mode}_{run.value:g}" for run in hidden.runs if run.role == "held_out"]
    assert found.held_out == tuple(held)
    assert found.errors.rmse > 1.1 * found.errors.noise_floor
    assert found.removed > 0.7


def test_the_extended_model_is_a_file_that_the_twin_uses(found: Diagnosis) -> None:
    assert found.extended is not None
    model = load(found.extended.source, ModelFile).content
    assert model.effects[0].name == "hinge_quadratic_damping"
    assert model.effects[0].diagnosis == "diagnosis"
    assert model.effects[0].standard_errors["c"] > 0
    pulled = Condition("decay", np.zeros(240), pull=0.8)
    bare, extended = (
        simulate(make_robot(model.values(), SHAPE, model.increments, effects), pulled).motion
        for effects in ({}, model.quantities())
    )
    swing = [np.ptp(motion["top_x_m"][-60:]) for motion in (bare, extended)]
    assert swing[1] < swing[0]


def test_the_page_shows_the_worst_run_and_opens_it(found: Diagnosis, tmp_path: Path) -> None:
    assert found.extended is not None
    errors = found.errors.by_run
    assert errors[found.worst_held_out] == max(errors[name] for name in found.held_out)
    page = write_diagnosis(tmp_path / "page.html", found, {}, {}, moving=b"JPEG")
    text = page.read_text(encoding="utf-8")
    opens = f"workbench review {found.worst_held_out} --model {found.extended.source}"
    assert f"<pre>{opens}</pre>" in text
    assert "data:image/jpeg;base64,SlBFRw==" in text
    without = write_diagnosis(page, replace(found, extended=None), {}, {})
    text = without.read_text(encoding="utf-8")
    assert f"<pre>workbench review {found.worst_held_out}</pre>" in text
    assert "data:image" not in text


def test_the_answer_tells_rivals_and_what_these_runs_do_not_excite(found: Diagnosis) -> None:
    words = found.as_json()
    assert words["answer"] == "NAMED"
    assert words["causes"][0]["sentence"].startswith("the beam damps more the faster it bends")
    assert 0.9 < words["causes"][0]["weight"] <= 1
    assert words["rmse_mm"]["extended"] < words["rmse_mm"]["base"]
    assert "hinge_quadratic_damping" not in [rival["effect"] for rival in words["rivals"]]


@pytest.mark.long
def test_a_cause_that_throws_the_base_far_off_is_found(tmp_path: Path) -> None:
    """A cable: without it the base ends nine noise deviations off."""
    tether = {"pull": 0.12, "stiffness": 1.2}
    rig = HopperRig(runs_of(truth(4, {"tether": tether}), 4, RUNS), DOCUMENT, SHAPE)
    told: list[str] = []
    found = diagnose(rig, tmp_path, tell=told.append)
    assert found.refits.base.left > 2.0
    assert (found.answer.kind, found.answer.causes) == ("NAMED", ("tether",))
    assert any(text.startswith("fit 1 s with tether") for text in told)
    for name, value in tether.items():
        assert found.quantities["tether"][name].value == pytest.approx(value, rel=0.1)
    assert found.removed > 0.95


def test_only_as_much_of_a_hop_is_compared_as_its_start_foretells() -> None:
    hop = Asked("hop", 17.0, 6.0)
    rig = HopperRig(runs_of(truth(4, {}), 4, [hop, Asked("decay", 0.4, 2.0)]), DOCUMENT, SHAPE)
    assert 1.0 <= rig.runs[0].times[-1] <= 4.0
    assert rig.runs[1].times[-1] > 1.8


def test_a_shortened_hop_stays_short_with_more_runs_and_once_it_is_extended(tmp_path: Path) -> None:
    asked = [Asked("hop", 17.0, 6.0), Asked("decay", 0.4, 2.0)]
    whole = HopperRig(runs_of(truth(4, {}), 4, asked), DOCUMENT, SHAPE)
    assert [run.forgets for run in whole.runs] == [True, False]
    short = whole.shortened({0: 1.2})
    extended = short.extend(tmp_path / "model", {}, {"air_drag": {"c": (0.01, 0.001)}}, "it")
    more = short.with_trials([Trial("clamped", 11.0, 3.0, 1.0)])
    for rig in (short, extended, more):
        assert rig.runs[0].times[-1] == pytest.approx(1.2, abs=0.01)
        assert len(rig.predict([(0, {})])[0]) == len(rig.runs[0].times)
        assert len(rig.runs[1].times) == len(whole.runs[1].times)
    assert whole.runs[0].times[-1] > 1.3
