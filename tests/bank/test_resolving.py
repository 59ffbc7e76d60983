"""Ties: runs that are asked for are made by the case's own robot, and rounds are counted."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.bank import resolving
from benchmarks.bank.cases import Case, Made, draw_case, plan_of
from benchmarks.bank.make import further_runs, make_case
from benchmarks.bank.resolving import resolve, rounds_of, wrongly
from benchmarks.bank.tables import Reported, page
from workbench.errors import DataFault
from workbench.investigate import ProposedRun, minutes_of

pytestmark = pytest.mark.long  # a benchmark tests itself

ASKED = ProposedRun("decay", 0.4, 2.0, 1.0)
TRUE = "local_stiffness_loss"


@pytest.fixture(scope="module")
def made() -> Made:
    return make_case(Case(11, "null", "rod", "S", "A", reduced=True))


def test_further_runs_are_those_of_the_same_robot(made: Made) -> None:
    rng = np.random.default_rng(0)
    plans = [plan_of(ASKED, 7, rng), plan_of(ProposedRun("clamped", 11.0, 2.0, 1.0), 8, rng)]
    one, driven = further_runs(made, plans)
    assert (one.name, one.role, one.course.mode) == ("decay-7", "train", "decay")
    assert driven.course.steps[-1] == (0.5, 11.0)
    again, _ = further_runs(made, plans)
    assert np.array_equal(one.filmed.paths["top"], again.filmed.paths["top"], equal_nan=True)
    weaker = {TRUE: {"near_foot": 0.1}}
    label = dict(made.label) | {"effects": weaker}
    other, _ = further_runs(replace(made, label=label), plans)
    apart = other.filmed.paths["top"] - one.filmed.paths["top"]
    assert np.nanmax(np.abs(apart)) > 0.003
    later, _ = further_runs(replace(made, runs=(*made.runs, one)), plans)
    assert not np.array_equal(one.filmed.paths["top"], later.filmed.paths["top"], equal_nan=True)


class Answers:
    """Stands in for the diagnosis: says one thing after the other, and counts the runs it had."""

    def __init__(self, *said: Any) -> None:
        self.said, self.runs = list(said), list[int]()

    def __call__(self, made: Made) -> Any:
        self.runs.append(len(made.runs))
        said = self.said.pop(0)
        if isinstance(said, Exception):
            raise said
        kind, *causes = said
        return SimpleNamespace(
            kind=kind, causes=tuple(SimpleNamespace(name=name) for name in causes)
        )


def resolved(
    monkeypatch: pytest.MonkeyPatch, made: Made, *said: Any
) -> tuple[dict[str, Any], Answers]:
    answers = Answers(*said)
    proposal = SimpleNamespace(trials=(ASKED,), minutes=minutes_of([ASKED, ASKED]))
    tie = replace(made, label=dict(made.label) | {"effects": {TRUE: {"near_foot": 0.1}}})
    monkeypatch.setattr(resolving, "make_case", lambda case: tie)
    monkeypatch.setattr(resolving, "_diagnosed", answers)
    monkeypatch.setattr(resolving, "propose", lambda found, menu: proposal)
    monkeypatch.setattr(resolving, "_PLAIN", [ASKED])
    return resolve(draw_case(1500, "tie", 0)), answers


def test_rounds_go_on_until_one_cause_is_named(monkeypatch: pytest.MonkeyPatch, made: Made) -> None:
    tie = ("SET", TRUE, "rest_shape_drift")
    line, answers = resolved(
        monkeypatch, made, tie, tie, ("NAMED", TRUE), tie, tie, ("NAMED", "rest_shape_drift")
    )
    first = len(made.runs)
    assert answers.runs == [first + more for more in (0, 2, 4, 2, 4, 6)]
    assert (rounds_of(line, "proposed"), rounds_of(line, "random")) == (2, 4)
    assert (wrongly(line, "proposed"), wrongly(line, "random")) == (False, True)
    spent = [one["minutes"] for way in line["rounds"].values() for one in way]
    assert spent == [minutes_of([ASKED, ASKED])] * 5
    assert line["first"]["causes"] == [TRUE, "rest_shape_drift"]


def test_a_tie_that_stays_one_or_breaks_is_counted(
    monkeypatch: pytest.MonkeyPatch, made: Made
) -> None:
    tie = ("SET", TRUE, "rest_shape_drift")
    line, _ = resolved(monkeypatch, made, tie, tie, tie, tie, DataFault("all runs differ", []))
    assert [rounds_of(line, way) for way in ("proposed", "random")] == [4, 4]
    assert line["rounds"]["random"][-1]["why"] == "all runs differ"


def test_what_is_named_at_once_is_no_tie(monkeypatch: pytest.MonkeyPatch, made: Made) -> None:
    line, answers = resolved(monkeypatch, made, ("NAMED", TRUE))
    assert (line["rounds"], answers.runs) == ({"proposed": [], "random": []}, [len(made.runs)])


def test_the_page_holds_ties_against_their_bars() -> None:
    def line(generator: str, proposed: int, random: int) -> dict[str, Any]:
        sets = {"answer": "SET", "causes": [TRUE, "rest_shape_drift"]}
        rounds = {
            way: [sets] * (count - 1) + [{"answer": "NAMED", "causes": [TRUE]}]
            for way, count in (("proposed", proposed), ("random", random))
        }
        return {"label": {"generator": generator, "effects": {TRUE: {}}}, "rounds": rounds}

    ties = [line("twin", 1, 2), line("twin", 1, 3), line("rod", 3, 3)]
    text = page(Reported([], {}, [], ties, 0, [], [], {}))
    assert "| the twin | 2 of 2: 100% " in text
    assert "| 1.00 | 2.50 | 2.50 | at least 1.5, met |" in text
    assert "| 3.00 | 3.00 | 1.00 | at least 1.5, missed |" in text
