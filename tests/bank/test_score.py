"""Scores of made-up answers, worked out by hand."""

from __future__ import annotations

import math
from typing import Any

import pytest

from benchmarks.bank.cases import Block, Case
from benchmarks.bank.expected import expected
from benchmarks.bank.score import BARS, Judged, confusion, judge, scores, wilson
from benchmarks.bank.tables import Reported, Turned, page

TRUE = {"root_play": {"gap": 0.001}}


def label(block: Block, effects: dict[str, Any], size: float = 1.0, kind: str = "") -> dict:
    causes = tuple(effects)
    case = Case(1, block, "rod", "S", "A", causes, (size,) * len(causes), kind)
    return {"block": block, "generator": "rod", "effects": effects, "kind": kind,
            "drawn_sizes": list(case.sizes), "expected": expected(case)}  # fmt: skip


def answer(verdict: str, *causes: str, confidence: float = 0.95, **more: Any) -> dict:
    reported = {"gap": {"value": 0.0011, "interval90": [0.0009, 0.0013], "unit": "rad"}}
    listed = [{"effect": c, "confidence": confidence, "parameters": reported} for c in causes]
    return {"answer": verdict, "causes": listed, "seconds": 60.0} | more


def score(name: str, *judged: Judged) -> float:
    return {one.name: one.value for one in scores(judged)}[name]


def test_every_score_has_a_bar_and_every_bar_a_score() -> None:
    assert [one.name for one in scores([])] == list(BARS)


def test_wilson_is_the_textbook_s() -> None:
    """Newcombe 1998, table I: 81 of 263 at 95 % is 0.2553 to 0.3662."""
    assert wilson(81, 263, 0.95) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 0) == (0.0, 1.0)


def test_a_single_cause_has_to_be_named_alone() -> None:
    truth = label("single", TRUE)
    right, wrong = (
        judge(answer("NAMED", "root_play"), truth),
        judge(answer("NAMED", "tether"), truth),
    )
    both = judge(answer("NAMED", "root_play", "tether"), truth)
    hedged = judge(answer("SET", "root_play", "tether"), truth)
    assert score("top-1 name, size 1", right, wrong, both, hedged) == 0.25
    assert score("named and wrong", right, wrong, both, hedged) == 0.5
    assert score("mean set size, size 1", right, hedged) == 1.5


def test_a_fault_of_the_data_with_a_name_is_a_name() -> None:
    tilt = label("single", {"camera_tilt": {"gap": 0.0011}})
    tilt["expected"] = {
        "answers": ["NAMED", "DATA_FAULT"],
        "listed": ["camera_tilt"],
        "named": ["camera_tilt"],
    }
    right, wrong, mute = (
        judge(answer("DATA_FAULT", *causes), tilt)
        for causes in (("camera_tilt",), ("length_scale",), ())
    )
    assert score("top-1 name, size 1", right, wrong, mute) == pytest.approx(1 / 3)
    assert score("named and wrong", right, wrong, mute) == pytest.approx(1 / 3)
    assert score("90 % interval coverage", right) == 1.0
    null = label("null", {})
    alarm = judge(answer("DATA_FAULT", "length_scale"), null)
    assert score("false alarm on nulls", alarm, judge(answer("DATA_FAULT"), null)) == 0.5


def test_a_small_cause_may_stand_in_a_set() -> None:
    small = label("single", TRUE, size=0.3)
    listed, missing = (
        judge(answer("SET", "tether", "root_play"), small),
        judge(answer("CLEAN"), small),
    )
    assert score("truth in set, size 0.3", listed, missing) == 0.5
    assert listed.right


def test_a_null_that_is_named_is_a_false_alarm() -> None:
    null = label("null", {})
    named, clean = judge(answer("NAMED", "tether"), null), judge(answer("CLEAN"), null)
    listed = judge(answer("SET", "tether"), null)
    assert score("false alarm on nulls", named, clean, listed) == pytest.approx(1 / 3)
    assert score("nulls CLEAN", named, clean, listed) == pytest.approx(1 / 3)


def test_a_pair_needs_both_and_no_third() -> None:
    pair = label("pair", TRUE | {"tether": {"pull": 0.1}})
    whole, half = (
        judge(answer("NAMED", "tether", "root_play"), pair),
        judge(answer("NAMED", "tether"), pair),
    )
    third = judge(answer("NAMED", "tether", "root_play", "air_drag"), pair)
    assert score("pairs: both named", whole, half, third) == pytest.approx(1 / 3)
    assert score("pairs: no false name", whole, half, third) == pytest.approx(2 / 3)


def test_what_is_outside_the_library_must_stay_unnamed() -> None:
    outside = label("outside", {"magnet": {"force": 1.0}})
    none, named = judge(answer("NONE"), outside), judge(answer("NAMED", "tether"), outside)
    listed = judge(answer("SET", "tether"), outside)
    partial = judge(answer("PARTIAL", "tether"), outside)
    assert score("outside: NONE or PARTIAL", none, named, listed, none) == 0.5
    assert score("outside: NONE or PARTIAL", none, named, partial, none) == 0.75
    assert score("outside: named", none, named, listed, none) == 0.25


def test_a_part_of_the_misfit_that_is_named_is_a_name() -> None:
    outside = label("outside", {"magnet": {"force": 1.0}})
    named = judge(answer("PARTIAL", "tether"), outside)
    assert score("outside: named", named) == 1


def test_causes_of_hops_alone_are_counted_by_themselves_as_well() -> None:
    drag = label("single", TRUE)
    slips = label("single", {"sole_adhesion": {"force": 0.1}})
    judged = judge(answer("NAMED", "root_play"), drag), judge(answer("CLEAN"), slips)
    assert score("top-1 name, size 1", *judged) == 0.5
    assert score("top-1 name, size 1, shows in hops alone", *judged) == 0


def test_a_tie_is_a_set_of_both() -> None:
    tie = {
        **label("tie", TRUE),
        "expected": {"answers": ["SET"], "listed": ["root_play", "tether"], "named": ["root_play"]},
    }
    assert judge(answer("SET", "root_play", "tether"), tie).right
    assert not judge(answer("SET", "root_play"), tie).right
    assert not judge(answer("NAMED", "root_play"), tie).right


def test_a_sensor_s_fault_may_be_told_or_named() -> None:
    fault = label("sensor", {}, kind="wrong_scale")
    assert judge(answer("DATA_FAULT"), fault).right
    assert judge(answer("NAMED", "length_scale"), fault).right
    assert not judge(answer("NAMED", "hinge_cubic_stiffness"), fault).right


def test_numbers_come_with_their_errors_and_intervals() -> None:
    truth = label("single", TRUE, size=3.0)
    reported = judge(
        answer("NAMED", "root_play", rmse_mm={"base": 2.0, "extended": 2.1}, removable_removed=0.9),
        truth,
    )
    assert score("parameter error, size 3", reported) == pytest.approx(0.1)
    assert score("90 % interval coverage", reported) == 1.0
    assert score("removable error removed, size 3", reported) == 0.9
    assert score("harm", reported) == 1.0
    assert score("slowest case [s]", reported) == 60.0


def test_confidence_is_held_against_what_was_right() -> None:
    truth = label("single", TRUE)
    sure = [judge(answer("NAMED", "root_play"), truth)] * 3
    sure += [judge(answer("NAMED", "tether"), truth)]
    assert score("confidence off (ECE)", *sure) == pytest.approx(0.20)
    assert score("stated 90 % right, are right", *sure) == 0.75


def test_nothing_counted_is_no_number() -> None:
    assert math.isnan(score("top-1 name, size 3"))


def test_an_answer_without_verdict_is_refused() -> None:
    with pytest.raises(ValueError, match="answer 'MAYBE' is none of NAMED, SET"):
        judge({"answer": "MAYBE"}, label("null", {}))


def test_the_page_shows_scores_confusion_and_failures() -> None:
    judged = [
        judge(answer("NAMED", "tether"), label("single", TRUE)),
        judge(answer("SET", "tether"), label("null", {})),
    ]
    assert confusion(judged) == {"root_play": {"tether": 1}, "null": {"SET": 1}}
    plain = {"single": [judge(answer("NAMED", "root_play"), label("single", TRUE))]}
    off = {"value": 0.01, "interval90": [0.009, 0.011], "unit": "rad"}
    opposite = answer("NAMED") | {"causes": [{"effect": "root_play", "parameters": {"gap": off}}]}
    right, wrong = (
        judge(answer("NAMED", "root_play"), label("single", TRUE)),
        judge(opposite, label("single", TRUE)),
    )
    turned = [Turned("root_play", [right], [wrong])]
    text = page(Reported(judged, plain, turned, [], 3, ["case 9: no rest"], [4, 5], {"ab": 2}))
    assert "seeds 4, 5: 3 cases drawn, 2 judged. What" in text
    assert "| root_play | tether 1 |" in text
    assert "at least 0.8, missed" in text
    assert "- case 9: no rest" in text
    sizes = "| top-1 name, size 1 | the independent engine | 0 of 1: 0% (0% to 73%) | 1 of 1: 100%"
    assert sizes in text
    assert "| root_play | 1 | 1 of 1 | 1 of 1 | 1 of 1 | 0 of 1 |" in text


def test_the_page_lists_seeds_in_a_row_by_the_first_and_the_last() -> None:
    text = page(Reported([], {}, [], [], 0, [], [9, 3, 4, 5, 7, 10], {}))
    assert "seeds 3 to 5, 7, 9, 10: 0 cases drawn" in text


def test_intervals_that_always_hold_the_truth_are_too_wide() -> None:
    right = judge(answer("NAMED", "root_play"), label("single", TRUE))
    text = page(Reported([right], {}, [], [], 1, [], [4], {"ab": 1}))
    row = next(line for line in text.splitlines() if line.startswith("| 90 % interval coverage"))
    assert row.endswith(
        "| no case | 0.85 to 0.95 | 1 of 1: 100% (27% to 100%) | 0.8 to 0.96, missed |"
    )


def test_time_and_memory_are_the_worst_of_all_cases() -> None:
    one = judge(answer("CLEAN"), label("null", {}), {"screening": 20.0, "peak": 500.0})
    other = judge(answer("CLEAN"), label("null", {}), {"screening": 70.0, "peak": 400.0})
    assert score("slowest screening [s]", one, other) == 70.0
    assert score("most memory [MB]", one, other) == 500.0
