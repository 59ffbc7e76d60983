"""The engine of the diagnosis on a rig that is written down: each kind of answer."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnose import paper
from tests.diagnose.paper import (
    CAUSES,
    NOISE_M,
    TERMS,
    PaperRig,
    cause,
    half_understood,
    measured,
)
from workbench.diagnose import Diagnosis, answer, diagnose, diagnosis
from workbench.diagnose.proof import Proof
from workbench.diagnose.search import Search
from workbench.diagnose.wording import digits
from workbench.errors import InputError


def found(rig: PaperRig, tmp_path: Path, seed: int = 0) -> Diagnosis:
    return diagnose(rig, tmp_path, seed=seed)


def names(diagnosis: Diagnosis) -> list[str]:
    return list(diagnosis.answer.causes)


@pytest.mark.parametrize("name", ["hardening", "creep", "wobble"])
def test_a_hidden_cause_is_named_with_its_size_and_proved(name: str, tmp_path: Path) -> None:
    amount = {"hardening": 0.01, "creep": 0.2, "wobble": 0.5}[name]
    diagnosis = found(measured(1, {name: amount}), tmp_path)
    assert diagnosis.answer.kind == "NAMED"
    assert names(diagnosis) == [name]
    quantity = diagnosis.quantities[name]["amount"]
    assert quantity.low < amount < quantity.high
    assert quantity.value == pytest.approx(amount, rel=0.1)
    assert diagnosis.held_out == ("run_3",)
    assert diagnosis.removed > 0.8
    assert diagnosis.proof is not None
    assert diagnosis.proof.extended.rmse == pytest.approx(1000 * NOISE_M, rel=0.1)
    assert diagnosis.adequate


def test_what_the_runs_held_out_speak_against_is_not_named(tmp_path: Path) -> None:
    creeping, still = measured(1, {"creep": 0.2}), measured(1)
    rig = replace(creeping, runs=(*creeping.runs[:3], still.runs[3]))
    diagnosis = found(rig, tmp_path)
    assert diagnosis.answer.kind == "SET"
    assert names(diagnosis) == ["creep"]
    assert "but on runs held out the extension errs by " in diagnosis.answer.reason
    assert diagnosis.answer.reason.endswith("mm, so no model is written")
    assert diagnosis.extended is None
    assert diagnosis.adequate is False
    assert diagnosis.as_json()["extended_model"] is None
    assert not list(tmp_path.rglob("*.json"))


def test_a_cause_that_is_not_all_that_is_wrong_is_told_so(tmp_path: Path) -> None:
    """What else a run held out shows is larger than what the extension makes up for."""
    diagnosis = found(half_understood(), tmp_path)
    assert diagnosis.answer.kind == "NAMED"
    assert names(diagnosis) == ["creep"]
    assert diagnosis.proof is not None
    told = diagnosis.proof
    print(told.base.rmse, told.extended.rmse, told.removed)
    assert 0 < told.removed < 0.5
    assert diagnosis.as_json()["adequate"] is False
    assert diagnosis.answer.reason.endswith(
        f"but on runs held out the extension still errs by {told.extended.rmse:.3g} of "
        f"{told.base.rmse:.3g} mm, where noise makes {digits(told.base.noise_floor)} mm, so "
        "something else is wrong as well, or instead"
    )


def test_little_that_is_left_is_enough_whatever_share_of_the_misfit_it_is(tmp_path: Path) -> None:
    told = found(measured(1, {"hardening": 0.01}), tmp_path).proof
    assert told is not None
    floor = told.base.noise_floor
    little = replace(told.base, by_run={"run_3": 1.03 * floor})
    more = replace(told.base, by_run={"run_3": 1.04 * floor})
    assert Proof(more, little).adequate
    assert not Proof(more, more).adequate
    assert Proof(replace(told.base, by_run={"run_3": 1.09 * floor}), more).adequate


def test_nothing_hidden_is_answered_as_clean(tmp_path: Path) -> None:
    answers = [found(measured(seed), tmp_path).answer.kind for seed in range(40)]
    assert answers.count("CLEAN") >= 39


def test_what_is_small_where_it_was_fitted_is_named_where_runs_held_out_show_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It grows with the square of a run's size: little in small runs, and much in a large one."""
    for module in (answer, diagnosis):
        monkeypatch.setattr(module, "LEAST_SIZE", 0.5)
    told = []
    for held_out in (0.06, 0.015):
        sizes = (0.018, 0.02, 0.022, held_out)
        monkeypatch.setattr(paper, "SIZES_M", sizes)
        one = found(replace(measured(1, {"hardening": 0.02}), sizes=sizes), tmp_path)
        (single,) = one.refits.singles
        assert single.size < 0.5
        assert one.refits.worth(single) > answer.LEAST_WORTH
        told.append((one.answer.kind, *one.answer.causes))
    assert told == [("NAMED", "hardening"), ("CLEAN",)]


def test_two_causes_are_both_named(tmp_path: Path) -> None:
    diagnosis = found(measured(2, {"wobble": 0.5, "creep": 0.2}), tmp_path)
    assert diagnosis.answer.kind == "NAMED"
    assert sorted(names(diagnosis)) == ["creep", "wobble"]


@pytest.mark.parametrize(("amounts", "added"), [
    ({"wobble": 0.5, "creep": 0.2}, [{"wobble", "creep"}]),
    ({"wobble": 0.5}, []),
])  # fmt: skip
def test_runs_held_out_speak_for_a_second_cause_that_is_there(
    amounts: dict[str, float], added: list[set[str]], tmp_path: Path
) -> None:
    refits = found(measured(2, amounts), tmp_path).refits
    search = Search(refits.problem, refits.base, lambda text: None)
    for name in ("wobble", "creep", "hardening"):
        search.take_up(
            [replace(refits.singles[0], causes=("wobble", name)[: 1 + (name != "wobble")])]
        )
    single, pairs = search.found(1)[0], search.found(2)
    assert [set(one.causes) for one in pairs] != []
    told = diagnosis._adding(refits, (3,), single, pairs)
    assert [set(one.causes) for one in told] == added


def test_causes_that_look_the_same_are_answered_as_a_set(tmp_path: Path) -> None:
    rig = replace(measured(3, {"wobble": 0.5}), causes=(*CAUSES, cause("wobble_again")))
    diagnosis = found(rig, tmp_path)
    assert diagnosis.answer.kind == "SET"
    assert sorted(names(diagnosis)) == ["wobble", "wobble_again"]
    assert "cannot be told apart by these runs" in diagnosis.answer.reason


def test_all_of_many_that_look_the_same_are_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten of them hide each other: none is worth much, and yet the base leaves too much."""
    alike = [f"wobble_{k}" for k in range(9)]
    for name in alike:
        monkeypatch.setitem(TERMS, name, TERMS["wobble"])
    causes = (*CAUSES, *(cause(name) for name in alike))
    diagnosis = found(replace(measured(1, {"wobble": 0.2}), causes=causes), tmp_path)
    print(diagnosis.refits.base.left, [(one.causes, one.worth) for one in diagnosis.refits.scores])
    assert diagnosis.answer.kind == "SET"
    assert len(names(diagnosis)) == 8
    assert set(names(diagnosis)) <= {"wobble", *alike}
    assert "may be there, but" in diagnosis.answer.reason


def test_what_no_cause_explains_is_answered_with_none(tmp_path: Path) -> None:
    times = np.arange(600) / 100
    stranger = 1e-3 * np.sign(np.sin(23 * times)) * np.sin(2 * times)
    diagnosis = found(measured(4, stranger=stranger), tmp_path)
    assert diagnosis.answer.kind == "NONE"
    assert names(diagnosis) == []
    assert "no known cause explains" in diagnosis.answer.reason
    assert diagnosis.extended is None


def test_a_base_that_is_far_off_is_never_clean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What sets in at the end shows in no window that the base follows, and forty hide each other.

    Their clutter together explains all, none of them is worth a refit by what it promises there.
    """
    late = [f"late_{k}" for k in range(40)]
    for name in late:
        monkeypatch.setitem(TERMS, name, lambda t, a: 1e-3 * (t / 6) ** 40)
    causes = (*CAUSES, *(cause(name) for name in late))
    diagnosis = found(replace(measured(9, {late[0]: 5.0}), causes=causes), tmp_path)
    assert diagnosis.refits.base.left > 1
    assert diagnosis.answer.kind == "SET"
    assert len(names(diagnosis)) > 3
    assert set(names(diagnosis)) <= set(late)
    assert diagnosis.removed > 0.8


def test_a_base_that_is_far_off_is_none_where_nothing_explains_it(tmp_path: Path) -> None:
    late = 5e-3 * (np.arange(600) / 600) ** 40
    diagnosis = found(measured(9, stranger=late), tmp_path)
    left = diagnosis.refits.base.left
    assert left > 1
    assert diagnosis.answer.kind == "NONE"
    assert f"are left of {left:.2f}, and no known cause explains them" in diagnosis.answer.reason
    assert "All of it is in" not in diagnosis.answer.reason


def forgetful(seed: int, amounts: dict[str, float]) -> PaperRig:
    """Return a rig whose second run goes its own way after two seconds."""
    rig = measured(seed, amounts)
    run = rig.runs[1]
    away = 0.01 * np.maximum(run.times - 2.0, 0.0) * np.sin(7 * run.times)
    return replace(
        rig, runs=(rig.runs[0], replace(run, values=run.values + away[:, None]), *rig.runs[2:])
    )


def test_a_run_that_forgets_is_compared_for_as_long_as_the_base_follows_it(tmp_path: Path) -> None:
    rig = forgetful(9, {"wobble": 0.5})
    assert found(rig, tmp_path / "strict").answer.kind == "NONE"
    runs = (rig.runs[0], replace(rig.runs[1], forgets=True), rig.runs[2],
            replace(rig.runs[3], forgets=True))  # fmt: skip
    diagnosis = found(replace(rig, runs=runs), tmp_path / "forgiving")
    assert diagnosis.answer.kind == "NAMED"
    assert names(diagnosis) == ["wobble"]
    ends = [float(run.times[-1]) for run in diagnosis.rig.runs]
    assert ends == pytest.approx([5.99, 1.0, 5.99, 1.0], abs=0.011)
    assert [name for name, _ in diagnosis.shortened] == ["run_1", "run_3"]
    assert [end for _, end in diagnosis.shortened] == pytest.approx([1.0, 1.0], abs=0.011)
    assert diagnosis.extended is not None
    assert len(diagnosis.extended.runs[1].times) == len(diagnosis.rig.runs[1].times)


def test_a_run_that_forgets_is_compared_whole_where_a_cause_explains_it(tmp_path: Path) -> None:
    rig = measured(9, {"creep": 2.0})
    runs = tuple(replace(run, forgets=True) for run in rig.runs)
    diagnosis = found(replace(rig, runs=runs), tmp_path)
    assert diagnosis.refits.far
    assert names(diagnosis) == ["creep"]
    assert [len(run.times) for run in diagnosis.rig.runs] == [600] * 4


def test_a_sensor_s_cause_is_a_fault_of_the_data(tmp_path: Path) -> None:
    diagnosis = found(measured(5, {"scale": 0.05}), tmp_path)
    assert diagnosis.answer.kind == "DATA_FAULT"
    assert names(diagnosis) == ["scale"]


def test_a_base_number_beyond_its_tolerance_is_a_cause(tmp_path: Path) -> None:
    diagnosis = found(measured(6, {"stiffness": 0.05}), tmp_path)
    assert names(diagnosis) == ["stiffness"]
    inside = found(measured(6, {"stiffness": 0.002}), tmp_path)
    assert inside.answer.kind == "CLEAN"


def test_the_same_seed_gives_the_same_answer(tmp_path: Path) -> None:
    told = []
    for folder in ("a", "b"):
        diagnosis = found(measured(7, {"creep": 0.1}), tmp_path / folder, seed=3)
        words = diagnosis.as_json() | {"seconds": 0, "extended_model": ""}
        told.append(json.dumps(words))
    assert told[0] == told[1]


def test_runs_that_cannot_be_judged_are_refused(tmp_path: Path) -> None:
    rig = measured(8)
    fitted = tuple(replace(run, role="train") for run in rig.runs)
    with pytest.raises(InputError, match="0 with role held_out; a diagnosis needs at least 2"):
        found(replace(rig, runs=fitted), tmp_path)


def test_noise_that_remembers_is_no_cause(tmp_path: Path) -> None:
    """Camera noise with a memory of 0.8 from sample to sample raises no alarm."""
    found_all = [found(remembered(seed), tmp_path) for seed in range(20)]
    assert [one.answer.kind for one in found_all].count("CLEAN") >= 19


def test_a_slow_cause_below_such_noise_is_listed(tmp_path: Path) -> None:
    """Whitened it is a sixth of the noise; its size, and that of its clutter, is what cameras see.

    Were clutter of a twentieth of the whitened noise granted, half of these were called clean.
    """
    listed = sum(
        "creep" in names(found(remembered(k, {"creep": 0.04}), tmp_path)) for k in range(20)
    )
    assert listed >= 18


def remembered(seed: int, amounts: dict[str, float] | None = None) -> PaperRig:
    """Return a rig whose cameras' noise has a memory of 0.8."""
    rig, rng = measured(100 + seed), np.random.default_rng(seed)
    values = {f"{name}.amount": amount for name, amount in (amounts or {}).items()}
    runs = []
    for k, run in enumerate(rig.runs):
        noise = remembering(rng, len(run.times) + len(run.rest))
        seen = rig.predict([(k, values)])[0] + noise[: len(run.times), None]
        runs.append(replace(run, values=seen, rest=noise[len(run.times) :, None]))
    return replace(rig, runs=tuple(runs))


def remembering(rng: np.random.Generator, count: int, memory: float = 0.8) -> np.ndarray:
    noise = np.empty(count)
    noise[0] = rng.standard_normal()
    fresh = rng.standard_normal(count) * np.sqrt(1 - memory**2)
    for k in range(1, count):
        noise[k] = memory * noise[k - 1] + fresh[k]
    return NOISE_M * noise


def test_a_mixture_of_small_causes_is_not_named_by_one_of_them(tmp_path: Path) -> None:
    """Each adds about 0.05 noise deviations, which the engine grants every cause unasked."""
    named = 0
    for seed in range(20):
        rng = np.random.default_rng([seed, 9])
        sizes = {"creep": 0.004, "wobble": 0.02, "hardening": 2e-4, "scale": 0.001}
        amounts = {name: size * rng.normal() for name, size in sizes.items()}
        named += found(measured(200 + seed, amounts), tmp_path / str(seed)).answer.kind != "CLEAN"
    assert named <= 1
