"""The fixed draw of reduced cases, diagnosed; half come from an engine foreign to the twin.

The engine gets the runs alone. What it answers is judged by the label afterwards.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.bank.cases import Case
from tests.bank.make import make_case
from tests.bank.reduced import CASES
from tests.bank.score import judge
from tests.bank.write import measured
from workbench.diagnose import HopperRig, diagnose
from workbench.protocol import load_model, load_shape

REMOVED = 0.8  # of the removable error, by an extension of a cause of size 3
COUNT = {"single": 6, "pair": 1, "null": 2, "outside": 1}


def test_the_draw_has_all_kinds_of_cases_and_both_generators() -> None:
    blocks = [case.block for case in CASES]
    assert {block: blocks.count(block) for block in COUNT} == COUNT
    assert sum(case.generator == "rod" for case in CASES) == len(CASES) / 2
    assert len({case.causes[0] for case in CASES if case.block == "single"}) > len(CASES) / 3


@pytest.mark.parametrize("case", CASES, ids=lambda case: "-".join((case.generator, case.block)))
def test_a_reduced_case_gets_the_right_answer(case: Case, tmp_path: Path) -> None:
    made = make_case(case)
    model, shape = load_model("thesis", Path()), load_shape("thesis-initial", Path())
    found = diagnose(HopperRig(measured(made), model, shape.content), tmp_path)
    told = judge(found.as_json(), made.label)
    assert told.right, (
        f"{told.verdict} {', '.join(told.causes)} ({found.answer.reason}); "
        f"true is {', '.join(case.causes) or 'nothing'}, right is {made.label['expected']}"
    )
    if case.block == "single":
        assert told.removed > REMOVED
        for (effect, quantity), (_, low, high) in told.parameters.items():
            truth = told.truth.get(effect, {}).get(quantity, 0.0)
            wide = high - low
            assert low - wide < truth < high + wide
