"""The closed loop on paper: ties end within two proposals, and sooner than by chance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnose.bench_paper import SIZE_M, alike, made, swings
from workbench.diagnose import Diagnosis, Proposal, Round, Trial, diagnose, investigate, propose
from workbench.diagnose.proposed import Separation

FIRST = (SIZE_M,) * 4
POWERS = (0, 1, 2)
MENU = swings(*np.linspace(0.014, 0.026, 13))
TIES = 12
Turns = list[Round[Diagnosis, Proposal]]
Choose = Callable[[Diagnosis, int], Proposal | None]


def best(found: Diagnosis, turn: int) -> Proposal | None:
    return propose(found, MENU)


def by_chance(found: Diagnosis, turn: int) -> Proposal | None:
    rng = np.random.default_rng([len(found.rig.runs), turn])
    trial = MENU[rng.integers(len(MENU))]
    return Proposal((trial,), 1.0, (Separation("a", "b", 1.0, 0.5),), 0.5)


def rounds(folder: Path, turn: int, choose: Choose, most: int) -> Turns:
    """Go round with one tie, whose true cause goes by its number."""
    truth = {f"grown_{POWERS[turn % len(POWERS)]}": 0.4}
    sizes: list[float] = list(FIRST)

    def run(proposal: Proposal) -> None:
        sizes.extend(trial.amount for trial in proposal.trials)

    def look(number: int) -> tuple[Diagnosis, Proposal | None]:
        rig = made(turn, truth, alike(*POWERS), sizes)
        found = diagnose(rig, folder / str(number))
        return found, choose(found, turn) if number <= most else None

    return list(investigate(None, run, look, budget=1e9))


@pytest.fixture(scope="module")
def proposed(tmp_path_factory: pytest.TempPathFactory) -> list[Turns]:
    folder = tmp_path_factory.mktemp("best")
    return [rounds(folder / str(turn), turn, best, 4) for turn in range(TIES)]


def needed(one: Turns) -> int:
    """Runs until one cause stands."""
    return len(one[-1].found.rig.runs) - len(FIRST)


def test_most_ties_end_within_two_proposals(proposed: list[Turns]) -> None:
    ended = [one[-1].found.answer.kind == "NAMED" and len(one) <= 3 for one in proposed]
    assert sum(ended) >= 0.8 * TIES
    for turn, one in enumerate(proposed):
        assert one[0].found.answer.kind == "SET"
        if one[-1].found.answer.kind == "NAMED":
            assert one[-1].found.answer.causes == (f"grown_{POWERS[turn % len(POWERS)]}",)
            assert one[-1].ended == "one cause stands"


def test_chance_needs_half_as_many_runs_more(proposed: list[Turns], tmp_path: Path) -> None:
    random = [rounds(tmp_path / str(turn), turn, by_chance, 8) for turn in range(TIES)]
    ours = sum(map(needed, proposed))
    assert sum(map(needed, random)) >= 1.5 * ours


def test_the_loop_ends_when_the_budget_does(tmp_path: Path) -> None:
    dear = Proposal((Trial("swing", 0.03, 600.0, 2.0),), 11.0, (), 0.9)
    found = diagnose(made(1, {"grown_1": 0.5}, alike(1, 2)), tmp_path)
    assert found.answer.kind == "SET"
    made_runs: list[Proposal] = []
    turns = list(investigate(dear, made_runs.append, lambda number: (found, dear), budget=30.0))
    assert len(made_runs) == 2
    assert [one.minutes for one in turns] == [11.0, 22.0]
    assert turns[0].ended is None
    assert turns[1].ended == "the next runs take about 11 min, and 8 min of the budget are left"


def test_the_loop_ends_where_nothing_is_proposed(tmp_path: Path) -> None:
    tie = diagnose(made(1, {"grown_1": 0.5}, alike(1, 2)), tmp_path / "a")
    clean = diagnose(made(1, {}, alike(1, 2)), tmp_path / "b")
    fault = replace(clean, answer=replace(clean.answer, kind="DATA_FAULT"))
    for found, words in (
        (fault, "the data are at fault: mend what the diagnosis tells, before more runs are made"),
        (tie, "no run that this bench can make tells apart what is left"),
        (clean, "nothing is left to find"),
    ):
        made_runs: list[Proposal] = []
        turns = list(investigate(None, made_runs.append, lambda number, f=found: (f, None), 30.0))
        assert made_runs == []
        assert [one.ended for one in turns] == [words]
