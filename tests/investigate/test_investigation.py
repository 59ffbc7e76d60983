"""The closed loop of runs and diagnoses: when it goes on, and why it ends."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from workbench.investigate import Proposal, ProposedRun, investigate


def found(kind: str) -> Any:
    """A diagnosis with an answer of a kind."""
    return SimpleNamespace(kind=kind)


def test_the_loop_ends_when_the_budget_does() -> None:
    costly = Proposal((ProposedRun("swing", 0.03, 600.0, 2.0),), 11.0, (), 0.9)
    made: list[Proposal] = []
    looked = found("SET"), costly
    turns = list(investigate(costly, made.append, lambda number: looked, budget=30.0))
    assert len(made) == 2
    assert [one.minutes for one in turns] == [11.0, 22.0]
    assert turns[0].ended is None
    assert turns[1].ended == "the next runs take about 11 min, and 8 min of the budget are left"


def test_the_loop_ends_where_nothing_is_proposed() -> None:
    for kind, words in (
        (
            "DATA_FAULT",
            "the data are at fault: mend what the diagnosis names, before more runs are made",
        ),
        ("SET", "no run that this bench can make distinguishes the causes that remain"),
        ("CLEAN", "nothing remains to be found"),
    ):
        made: list[Proposal] = []
        turns = list(investigate(None, made.append, lambda number, k=kind: (found(k), None), 30.0))
        assert made == []
        assert [one.ended for one in turns] == [words]
