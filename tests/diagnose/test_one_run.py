"""A cause that rests on one run is not named: that run is at fault, or nobody knows yet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnose import paper
from tests.diagnose.paper import CAUSES, PaperRig, cause, measured, oscillation
from workbench.diagnose import diagnose
from workbench.diagnose.one_run import carriers


@pytest.fixture(autouse=True)
def short_lived(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cause that shows at the greatest amplitude only, and strongly there."""
    monkeypatch.setitem(
        paper.TERMS, "late_wobble", lambda t, a: 1e-3 * (a > 0.025) * np.sin(11 * t)
    )


def only_in(rig: PaperRig, k: int, amounts: Mapping[str, float]) -> PaperRig:
    """Return a rig of which one run has causes that no other has."""
    run, values = rig.runs[k], {"omega": 5.0, "decay": 0.1}
    size = paper.SIZES_M[k]
    added = oscillation(run.times, size, values, amounts) - oscillation(run.times, size, values, {})
    runs = list(rig.runs)
    runs[k] = replace(run, values=run.values + added[:, None])
    return replace(rig, runs=tuple(runs))


@pytest.mark.parametrize("k", [0, 1, 2])
def test_what_one_run_alone_has_is_never_named(k: int, tmp_path: Path) -> None:
    for seed, amount in ((1, 0.05), (2, 0.1), (3, 0.3)):
        found = diagnose(only_in(measured(seed), k, {"creep": amount}), tmp_path / str(seed))
        assert found.answer.kind in ("DATA_FAULT", "NONE", "CLEAN"), amount
        assert found.answer.causes == ()
        assert found.extended is None
        if found.answer.kind != "CLEAN":
            assert f"run_{k}" in found.answer.reason


def test_a_run_that_carries_what_the_others_exclude_is_at_fault(tmp_path: Path) -> None:
    found = diagnose(only_in(measured(1), 1, {"creep": 0.1}), tmp_path)
    assert found.answer.kind == "DATA_FAULT"
    assert "creep rests on run_1 alone" in found.answer.reason
    assert "the data of run_1 are at fault" in found.answer.reason
    (rival, *_) = found.answer.rivals
    assert (rival.name, rival.why_not) == (
        "creep", "it rests on run_1 alone, and the other runs exclude it",
    )  # fmt: skip


def test_a_stranger_in_one_run_is_traced_to_it(tmp_path: Path) -> None:
    rig = measured(4)
    runs = list(rig.runs)
    odd = 1e-3 * np.sign(np.sin(23 * runs[2].times)) * np.sin(2 * runs[2].times)
    runs[2] = replace(runs[2], values=runs[2].values + odd[:, None])
    found = diagnose(replace(rig, runs=tuple(runs)), tmp_path)
    assert found.answer.kind == "NONE"
    assert "All of it is in run_2: the other runs leave 0." in found.answer.reason


def test_a_stranger_in_all_runs_is_traced_to_none(tmp_path: Path) -> None:
    times = np.arange(600) / 100
    stranger = 1e-3 * np.sign(np.sin(23 * times)) * np.sin(2 * times)
    found = diagnose(measured(4, stranger=stranger), tmp_path)
    assert found.answer.kind == "NONE"
    assert "All of it" not in found.answer.reason


def test_a_cause_that_one_run_alone_excites_may_be_there(tmp_path: Path) -> None:
    rig = replace(measured(5, {"late_wobble": 0.3}), causes=(*CAUSES, cause("late_wobble")))
    rig = replace(rig, causes=tuple(one for one in rig.causes if one.name != "wobble"))
    found = diagnose(rig, tmp_path)
    assert found.answer.kind == "SET"
    assert found.answer.causes == ("late_wobble",)
    assert "late_wobble rests on run_2 alone" in found.answer.reason
    assert "Repeat that run" in found.answer.reason
    assert found.answer.weights["late_wobble"] < 0.5


def test_a_cause_that_all_runs_share_rests_on_none(tmp_path: Path) -> None:
    found = diagnose(measured(1, {"creep": 0.2}), tmp_path)
    assert found.answer.kind == "NAMED"
    assert carriers(found.answer.best) == []
    assert found.answer.weights["creep"] > 0.99


def test_a_cause_that_the_others_confirm_keeps_its_name_with_less_confidence(
    tmp_path: Path,
) -> None:
    found = diagnose(measured(1, {"hardening": 0.01}), tmp_path)
    (carrier,) = carriers(found.answer.best)
    assert carrier.run == 2  # the greatest amplitude
    assert carrier.confirmed < carrier.without < 6
    assert found.answer.kind == "NAMED"
    assert 0.5 < found.answer.weights["hardening"] < 0.95
    assert "hardening rests on run_2 for the most part: it is worth" in found.answer.reason


def test_a_real_cause_is_named_beside_a_run_that_has_one_of_its_own(tmp_path: Path) -> None:
    rig = only_in(measured(2, {"creep": 0.3}), 0, {"wobble": 0.5})
    found = diagnose(rig, tmp_path)
    assert found.answer.causes == ("creep",)
    assert found.answer.kind in ("NAMED", "DATA_FAULT")
