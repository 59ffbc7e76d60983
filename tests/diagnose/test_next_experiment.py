"""The next experiment: the run that tells is chosen, one that does not is not, as promised."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnose.bench_paper import SIZE_M, BenchRig, alike, made, swings
from tests.diagnose.paper import CAUSES, NOISE_M, TERMS, cause, measured
from workbench.diagnose import Diagnosis, Trial, diagnose, minutes_of, propose

FIRST = (SIZE_M,) * 4


def sizes_of(trials: Sequence[Trial]) -> list[float]:
    return [trial.amount for trial in trials]


@pytest.fixture(scope="module")
def tied(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """Two causes that runs of one size cannot tell apart."""
    rig = made(1, {"grown_1": 0.5}, alike(1, 2))
    found = diagnose(rig, tmp_path_factory.mktemp("tied"))
    assert found.answer.kind == "SET"
    return found


def test_the_trial_that_separates_is_chosen(tied: Diagnosis) -> None:
    proposal = propose(tied, swings(0.019, 0.02, 0.03, 0.021))
    assert proposal is not None
    assert sizes_of(proposal.trials) == [0.03]
    assert proposal.chance > 0.9
    assert {(one.truth, one.rival) for one in proposal.separations} == {
        ("grown_1", "grown_2"), ("grown_2", "grown_1"),
    }  # fmt: skip
    assert proposal.minutes == minutes_of(2 * proposal.trials)  # one run names no cause


def test_a_trial_that_separates_nothing_is_no_proposal(tied: Diagnosis) -> None:
    assert propose(tied, swings(0.02)) is None
    assert propose(tied, swings(0.02, 0.0201, 0.0199)) is None
    assert propose(tied, []) is None


def test_the_run_that_was_proposed_ends_the_tie(tied: Diagnosis, tmp_path: Path) -> None:
    proposal = propose(tied, swings(0.02, 0.03))
    assert proposal is not None
    more = made(1, {"grown_1": 0.5}, alike(1, 2), (*FIRST, *sizes_of(proposal.trials)))
    found = diagnose(more, tmp_path)
    assert found.answer.kind == "NAMED"
    assert found.answer.causes == ("grown_1",)


def test_of_two_that_tell_alike_the_shorter_is_chosen(tied: Diagnosis) -> None:
    long, short = Trial("swing", 0.06, 900.0, 2.0), Trial("swing", 0.06, 6.0, 2.0)
    for menu in ([long, short], [short, long]):
        proposal = propose(tied, menu)
        assert proposal is not None
        assert proposal.trials == (short,)


def test_what_a_rival_can_imitate_separates_nothing(tmp_path: Path) -> None:
    """At 0.06 m one cause does what another phase of the start does: far apart, nothing told."""

    def bent(t: np.ndarray, a: float) -> np.ndarray:
        phase = 0.03 * a * np.exp(-0.1 * t) * np.sin(5 * t) if a > 0.05 else 0.0
        return 1e-3 * np.sin(11 * t) + phase

    TERMS["bent"] = bent
    found = diagnose(made(2, {"grown_0": 0.5}, (*alike(0), cause("bent"))), tmp_path)
    assert found.answer.kind == "SET"
    assert isinstance(found.rig, BenchRig)
    rig = found.rig.with_trials(swings(0.06))
    straight, other = (
        rig.predict([(4, {f"{name}.amount": 0.5})])[0] for name in ("grown_0", "bent")
    )
    assert np.sqrt(np.sum((straight - other) ** 2)) / NOISE_M > 10
    assert propose(found, swings(0.06)) is None


def test_the_chance_that_is_told_is_the_chance_that_comes_true(tmp_path: Path) -> None:
    """A trial of middling worth, many times over: the share of rivals dismissed is as foretold."""
    told, came = [], []
    for seed in range(24):
        causes = alike(1, 2)
        found = diagnose(made(seed, {"grown_1": 0.5}, causes), tmp_path / f"a{seed}")
        proposal = propose(found, swings(0.0228))
        assert found.answer.kind == "SET"
        assert proposal is not None
        told.append(next(one.chance for one in proposal.separations if one.truth == "grown_1"))
        after = made(seed, {"grown_1": 0.5}, causes, (*FIRST, 0.0228))
        came.append(diagnose(after, tmp_path / f"b{seed}").answer.causes == ("grown_1",))
    spread = np.sqrt(np.mean(told) * (1 - np.mean(told)) / len(told))
    assert 0.2 < np.mean(told) < 0.8
    assert abs(np.mean(came) - np.mean(told)) < 3 * spread


def test_a_clean_answer_proposes_what_the_runs_could_not_show(tmp_path: Path) -> None:
    """A cause that only large swings have: runs of 0.02 m cannot show it."""
    TERMS["late"] = lambda t, a: 1e-2 * np.sin(11 * t) if a > 0.05 else 0 * t
    found = diagnose(made(3, {}, (*CAUSES[:2], cause("late"))), tmp_path)
    assert found.answer.kind == "CLEAN"
    proposal = propose(found, swings(0.02, 0.06))
    assert proposal is not None
    assert sizes_of(proposal.trials) == [0.06]
    assert [(one.truth, one.rival) for one in proposal.separations] == [("late", "none of them")]
    assert propose(found, swings(0.02)) is None


def test_nothing_is_proposed_where_one_cause_stands(tmp_path: Path) -> None:
    found = diagnose(made(4, {"creep": 0.2}, CAUSES), tmp_path)
    assert found.answer.kind == "NAMED"
    assert propose(found, swings(0.01, 0.06)) is None


def test_a_rig_that_cannot_imagine_runs_gets_no_proposal(tmp_path: Path) -> None:
    rig = replace(measured(3, {"wobble": 0.5}), causes=(*CAUSES, cause("wobble_again")))
    found = diagnose(rig, tmp_path)
    assert found.answer.kind == "SET"
    assert propose(found, swings(0.06)) is None
