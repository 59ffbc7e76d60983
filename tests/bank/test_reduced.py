"""The fixed draw of reduced cases, diagnosed; most come from an engine foreign to the twin.

The engine gets the runs alone, as they are stored. What it answers is judged by the label
afterwards.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

from benchmarks.bank.amounts import AMOUNTS
from benchmarks.bank.cases import Block, Case, plans
from benchmarks.bank.make import robot_of, sizing_of
from benchmarks.bank.score import Judged, judge
from benchmarks.bank.stored import read_made
from benchmarks.bank.write import measured
from tests.bank.reduced import CASES, FURTHER, SMALL_DRAW
from workbench.diagnose import HopperRig, diagnose
from workbench.schemas import load_model, load_shape

REMOVED = 0.8  # of the removable error, by an extension, also of a cause of little size
BUDGET_S: dict[Block, float] = dict.fromkeys(("single", "null", "pair", "outside"), 60.0)
"""Processor time that a diagnosis may take in the first tier [s]."""
COUNT = {"single": 4, "pair": 1, "null": 1, "outside": 1}


def answered(case: Case, folder: Path) -> tuple[Judged, str]:
    """Have the stored runs of a case diagnosed, and return the judged answer with its reason."""
    made = read_made(case)
    model, shape = load_model("thesis", Path()), load_shape("thesis-initial", Path())
    rig = HopperRig(measured(made), model, shape.content)
    found = diagnose(rig, folder, threads=1)
    return judge(found.as_json(), made.label), found.reason


def test_the_draw_has_all_kinds_of_cases_and_both_generators() -> None:
    blocks = [case.block for case in SMALL_DRAW]
    assert {block: blocks.count(block) for block in COUNT} == COUNT
    assert sum(case.generator == "rod" for case in SMALL_DRAW) >= len(SMALL_DRAW) / 2
    singles = {case.causes for case in SMALL_DRAW if case.block == "single"}
    assert len(singles) == COUNT["single"]


@pytest.mark.long
@pytest.mark.parametrize("case", [SMALL_DRAW[0], SMALL_DRAW[3]], ids=lambda case: case.generator)
def test_the_causes_have_their_size(case: Case) -> None:
    ((cause, quantity, amount),), (size,) = case.amounts, case.sizes
    runs = plans(case.protocols, case.rng(2), case.reduced)
    sizing = sizing_of(case, robot_of(case), runs, AMOUNTS[cause].shown)
    given, found = sizing.scale(cause, lambda part: {quantity: amount * part / size}, size, size)
    assert given == {quantity: pytest.approx(amount)}
    assert found == pytest.approx(size, rel=0.1)


SLOW = (1, 2, 9)
"""Cases of the small draw that miss much, and are fitted by both meshes: 56 to 100 s of a core."""


def on_its_own(case: Case) -> ParameterSet:
    """Return a case that any worker may take, whatever else of this module it has."""
    marks = [pytest.mark.xdist_group(case.name), pytest.mark.budget(BUDGET_S[case.block])]
    long = case in FURTHER or case.seed in SLOW
    return pytest.param(case, marks=[*marks, pytest.mark.long] if long else marks)


@pytest.mark.parametrize(
    "case",
    [on_its_own(case) for case in CASES],
    ids=lambda case: "-".join((case.generator, case.block, *case.causes)),
)
def test_a_reduced_case_gets_the_right_answer(case: Case, tmp_path: Path) -> None:
    told, reason = answered(case, tmp_path)
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
