"""What is learnt of answers that are kept: how often each kind is right."""

from __future__ import annotations

import json
from typing import Any

import pytest

from benchmarks.bank.learn import LEARNT, learn, learnt
from benchmarks.bank.score import judge
from tests.conftest import ROOT
from workbench.diagnose.confidence import Confidence, confidence_in

KEPT = ROOT / "docs" / "reference" / "bank"


def judged(verdict: str, causes: list[str], truth: list[str]) -> Any:
    label = {
        "effects": {name: {"size": 1.0} for name in truth},
        "expected": {"answers": ["NAMED" if truth else "CLEAN"], "listed": truth, "named": truth},
        "drawn_sizes": [1.0],
    }
    answer = {"answer": verdict, "causes": [{"effect": name} for name in causes]}
    return judge(answer, label)


def test_a_set_is_right_where_it_holds_the_truth_and_a_name_where_it_is_true() -> None:
    found = learnt(
        [
            judged("NAMED", ["a"], ["a"]),
            judged("NAMED", ["b"], ["a"]),
            judged("SET", ["b", "a"], ["a"]),
            judged("SET", ["b", "c"], ["a"]),
            judged("PARTIAL", ["a"], ["a"]),
            judged("PARTIAL", ["b"], ["a"]),
            judged("CLEAN", [], []),
            judged("CLEAN", [], ["a"]),
        ]
    )
    assert found == {"CLEAN": [1, 2], "NAMED": [1, 2], "PARTIAL": [1, 2], "SET": [1, 2]}


def test_the_file_is_what_the_kept_answers_of_its_seeds_say() -> None:
    text = LEARNT.read_text(encoding="utf-8")
    assert learn(KEPT, json.loads(text)["seeds"]) == text


def test_confidence_is_never_certain_and_of_few_answers_none() -> None:
    named = confidence_in("NAMED")
    assert named is not None
    assert 0.5 < named.share < 1
    assert named.sentence.startswith(f"of {named.count} answers NAMED to hidden causes, ")
    assert Confidence("SET", 3, 5).sentence.endswith("3 hold the true cause")
    assert Confidence("NAMED", 0, 0).share == pytest.approx(0.5)
    learnt_of = json.loads(LEARNT.read_text(encoding="utf-8"))["answers"]
    assert confidence_in("PARTIAL") is None or learnt_of["PARTIAL"][1] >= 5
