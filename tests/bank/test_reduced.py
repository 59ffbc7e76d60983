"""The fixed draw of reduced cases, diagnosed; half come from an engine foreign to the twin.

The engine gets the runs alone. What it answers is judged by the label afterwards.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchmarks.bank.cases import Case
from benchmarks.bank.make import make_case
from benchmarks.bank.score import Judged, judge
from benchmarks.bank.write import measured
from tests.bank.reduced import CASES, SIZE
from workbench.diagnose import HopperRig, diagnose
from workbench.protocol import load_model, load_shape

REMOVED = 0.8  # of the removable error, by an extension of a cause of size 3
COUNT = {"single": 6, "pair": 1, "null": 2, "outside": 1}
PROCESSES = 2
"""Diagnosed at a time: much of a short case is algebra, which one core does."""

Told = tuple[Judged, str]
Answers = Mapping[Case, "Future[Told]"]


def answered(case: Case, folder: Path) -> Told:
    """Make a case, have its runs diagnosed, judge the answer, and return it with its reason."""
    made = make_case(case)
    model, shape = load_model("thesis", Path()), load_shape("thesis-initial", Path())
    rig = HopperRig(measured(made), model, shape.content, threads=1)
    found = diagnose(rig, folder)
    return judge(found.as_json(), made.label), found.answer.reason


@pytest.fixture(scope="module")
def answers(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Answers]:
    """Begin all cases that were asked for, the longest first, and return what they come to."""
    fresh = multiprocessing.get_context("spawn")
    asked = [case for case in map(_case_of, request.session.items) if case is not None]
    with ProcessPoolExecutor(PROCESSES, mp_context=fresh) as pool:
        yield {
            case: pool.submit(answered, case, tmp_path_factory.mktemp("answer"))
            for case in reversed(asked)
        }
        pool.shutdown(cancel_futures=True)


def _case_of(item: pytest.Item) -> Case | None:
    parameters: dict[str, Any] = getattr(getattr(item, "callspec", None), "params", {})
    case = parameters.get("case")
    return case if isinstance(case, Case) and item.path == Path(__file__) else None


def test_the_draw_has_all_kinds_of_cases_and_both_generators() -> None:
    blocks = [case.block for case in CASES]
    assert {block: blocks.count(block) for block in COUNT} == COUNT
    assert sum(case.generator == "rod" for case in CASES) == len(CASES) / 2
    assert len({case.causes[0] for case in CASES if case.block == "single"}) > len(CASES) / 3


@pytest.mark.long
@pytest.mark.parametrize("case", [CASES[0], CASES[3]], ids=lambda case: case.generator)
def test_the_causes_have_their_size(case: Case) -> None:
    sized = make_case(replace(case, amounts=())).label
    assert sized["sizes"][case.causes[0]] == pytest.approx(SIZE, rel=0.1)
    for cause, quantity, amount in case.amounts:
        assert sized["effects"][cause][quantity] == pytest.approx(amount, rel=0.02)


@pytest.mark.parametrize("case", CASES, ids=lambda case: "-".join((case.generator, case.block)))
def test_a_reduced_case_gets_the_right_answer(case: Case, answers: Answers) -> None:
    told, reason = answers[case].result()
    assert told.right, (
        f"{told.verdict} {', '.join(told.causes)} ({reason}); "
        f"true is {', '.join(case.causes) or 'nothing'}, right is {told.label['expected']}"
    )
    if case.block == "single":
        assert told.removed > REMOVED
        for (effect, quantity), (_, low, high) in told.parameters.items():
            truth = told.truth.get(effect, {}).get(quantity, 0.0)
            wide = (high - low) / 2
            assert low - wide < truth < high + wide
