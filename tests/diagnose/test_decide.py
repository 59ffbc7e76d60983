"""The decision: what seconds that vote make of fitted hypotheses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy

from workbench.diagnose.decide import Kind, Scored, Shown, decide, versus
from workbench.diagnose.diagnosis import both
from workbench.diagnose.rules import RULES

SECONDS, SAMPLES = 40, 9600


def scored(
    *names: str, gain: float = 0.0, held: float | None = None, lack: float = 0.1, seed: int = 0,
    scatter: float = 1.0,
) -> Scored:  # fmt: skip
    """A hypothesis that lowers the cost by so much, spread over all seconds."""
    rng = np.random.default_rng([seed, len(names)])
    blocks = np.full(SECONDS, -gain / SECONDS) + scatter * rng.normal(size=SECONDS)
    blocks += (-gain - blocks.sum()) / SECONDS
    there = gain / 4 if held is None else held
    runs = (np.full(10, -there / 10), np.full(10, -there / 10))
    return Scored(names, 0.0, blocks, runs, lambda: lack)


BASE = scored(lack=20.0, scatter=0.0)


def test_a_cause_that_all_seconds_prefer_is_named() -> None:
    found = decide(BASE, [scored("a", gain=800), scored("b", gain=300, lack=20)], SAMPLES, RULES)
    assert (found.kind, found.best.names) == ("NAMED", ("a",))
    assert found.explained == pytest.approx(1 - 0.1 / 20)
    assert found.reason.startswith("a: every other cause leaves clearly more unexplained")


def test_two_causes_that_explain_the_same_are_a_set() -> None:
    alike = [scored("a", gain=800), scored("b", gain=798, seed=1)]
    found = decide(BASE, alike, SAMPLES, RULES)
    assert found.kind == "SET"
    assert {name for one in found.alike for name in one.names} == {"a", "b"}
    assert "cannot be separated" in found.reason


def test_what_runs_held_out_refuse_is_not_named() -> None:
    found = decide(BASE, [scored("a", gain=800, held=-50)], SAMPLES, RULES)
    assert (found.kind, found.best.names) == ("NONE", ())


def test_what_explains_all_that_is_missing_is_held_to_what_may_be_there() -> None:
    """That something is missing is known then; seconds of large motion alone can show it."""
    tried = scored("a", gain=800, held=-3)  # in each of two runs
    scattered = scored("a", gain=800, scatter=85.0)
    assert RULES.apart < versus(scattered, BASE).sure < RULES.sure
    for one in (tried, scattered):
        assert decide(BASE, [one], SAMPLES, RULES).kind == "NAMED"
        part = replace(one, misses=lambda: 5.0)
        assert decide(BASE, [part], SAMPLES, RULES).kind == "NONE"
        assert decide(scored(scatter=0.0), [one], SAMPLES, RULES).kind != "NAMED"


def test_a_gain_of_one_second_alone_is_no_cause() -> None:
    one = scored("a", scatter=0.0)
    blocks = one.blocks.copy()
    blocks[3] = -800.0
    lucky = Scored(("a",), 0.0, blocks, scored("a", gain=40).held, lambda: 0.1)
    assert versus(lucky, BASE).sure < RULES.sure
    assert decide(BASE, [lucky], SAMPLES, RULES).kind == "NONE"


def test_a_gain_too_small_for_so_many_samples_leaves_a_whole_model_clean() -> None:
    whole = scored(scatter=0.0)
    little = scored("a", gain=0.5 * RULES.size * SAMPLES)
    found = decide(whole, [little], SAMPLES, RULES)
    assert (found.kind, found.best.names) == ("CLEAN", ())


def test_what_the_seconds_leave_to_chance_is_no_suspect() -> None:
    whole = scored(scatter=0.0)
    gain = 1.5 * RULES.practical(SAMPLES)
    for scatter, kind in ((6.0, "NAMED"), (10.5, "SET"), (14.0, "CLEAN")):
        one = scored("a", gain=gain, scatter=scatter)
        print(versus(one, whole))
        assert decide(whole, [one], SAMPLES, RULES).kind == kind


def test_a_sure_gain_that_runs_held_out_leave_open_is_no_clean_model() -> None:
    whole, gain = scored(scatter=0.0), 1.5 * RULES.practical(SAMPLES)
    for held, kind in ((3.0, "NAMED"), (-3.0, "SET"), (-5.0, "CLEAN")):  # in each of two runs
        found = decide(whole, [scored("a", gain=gain, held=held)], SAMPLES, RULES)
        assert found.kind == kind
    left_open = decide(whole, [scored("a", gain=gain, held=-3.0)], SAMPLES, RULES)
    assert left_open.reason == "a may be there, but the runs held out do not confirm it"
    alone = [replace(one, held=()) for one in (whole, scored("a", gain=gain))]
    unjudged = decide(alone[0], alone[1:], SAMPLES, RULES)
    assert unjudged.reason == "a may be there, but no run that could confirm it is held out"


def test_what_is_left_beside_a_cause_is_told() -> None:
    part = decide(BASE, [scored("a", gain=800, lack=5)], SAMPLES, RULES)
    assert part.kind == "PARTIAL"
    assert "a explains 75 % of what the model misses" in part.reason
    alike = [scored("a", gain=800, lack=5), scored("b", gain=798, seed=1, lack=5)]
    either = decide(BASE, alike, SAMPLES, RULES)
    assert (either.kind, len(either.alike)) == ("PARTIAL", 2)
    assert "a or another like it explains 75 %" in either.reason
    most = decide(BASE, [scored("a", gain=800, lack=1.5)], SAMPLES, RULES)
    assert most.kind == "NAMED"
    assert most.reason.endswith("with it the model misses 1.50 times what a whole one may still")
    for lack, share in ((19, 5), (12, 40)):
        none = decide(BASE, [scored("a", gain=800, lack=lack)], SAMPLES, RULES)
        assert (none.kind, none.missing) == ("NONE", 20)
        assert none.reason.startswith("the model misses 20.0 times what a whole one may")
        assert none.reason.endswith(f"a would explain {share} %")


def test_a_pair_is_taken_where_it_adds_and_is_no_rival_of_its_other_order() -> None:
    single, pair = scored("a", gain=800), scored("a", "b", gain=1600, seed=2)
    found = decide(BASE, [single, pair], SAMPLES, RULES)
    assert (found.kind, found.best.names) == ("NAMED", ("a", "b"))
    less = scored("a", "b", gain=810, seed=2)
    assert decide(BASE, [single, less], SAMPLES, RULES).best.names == ("a",)


def test_a_third_cause_is_taken_where_it_adds_a_share_of_what_two_do() -> None:
    tried = [scored("a", gain=800), scored("a", "b", gain=1600, seed=2)]
    found = decide(BASE, [*tried, scored("a", "b", "c", gain=2000, seed=3)], SAMPLES, RULES)
    assert (found.kind, found.best.names) == ("NAMED", ("a", "b", "c"))
    assert found.reason.startswith("a, b and c: every other cause")
    trifle = scored("a", "b", "c", gain=1750, seed=2)
    assert trifle.cost < tried[1].cost - RULES.practical(SAMPLES)
    assert decide(BASE, [*tried, trifle], SAMPLES, RULES).best.names == ("a", "b")
    alone = scored("a", "b", "c", gain=2000, seed=3)  # without two that hold there is no third
    assert decide(BASE, [tried[0], alone], SAMPLES, RULES).best.names == ("a",)


def test_two_others_take_the_place_of_one_where_they_are_surely_ahead() -> None:
    single = scored("a", gain=800)
    surely = scored("b", "c", gain=830, seed=0)
    found = decide(BASE, [single, surely], SAMPLES, RULES)
    assert (found.kind, found.best.names) == ("NAMED", ("b", "c"))
    perhaps = scored("b", "c", gain=810, seed=3, scatter=8.0)
    found = decide(BASE, [single, perhaps], SAMPLES, RULES)
    assert found.kind == "SET"
    assert {name for one in found.alike for name in one.names} == {"a", "b", "c"}
    behind = scored("b", "c", gain=804, seed=3, scatter=8.0)  # no more than one number more gains
    assert decide(BASE, [single, behind], SAMPLES, RULES).kind == "NAMED"


def test_a_number_far_off_is_paid_for_in_full_where_noise_repeats_itself() -> None:
    one, other = scored("a", gain=800), scored("a", gain=790)
    far = Scored(one.names, 30.0, one.blocks, one.held, one.misses)
    assert versus(other.over(9.0), far.over(9.0)).gain == pytest.approx(30 - 10 / 9)


def test_what_the_runs_do_not_prefer_to_the_base_is_no_alternative() -> None:
    one = scored("a", gain=800)
    wild = scored("b", gain=-3000.0, scatter=3000.0)  # so scattered that it is not surely behind
    assert versus(one, wild).sure < RULES.apart
    assert decide(BASE, [one, wild], SAMPLES, RULES).kind == "NAMED"


def test_noise_that_repeats_itself_counts_less() -> None:
    one = scored("a", gain=800)
    less = versus(one.over(9.0), BASE.over(9.0))
    assert less.gain == pytest.approx(versus(one, BASE).gain / 9)
    assert less.held == pytest.approx(versus(one, BASE).held / 9)
    assert less.sure == pytest.approx(versus(one, BASE).sure)


def test_a_cause_that_one_run_alone_supports_is_not_named() -> None:
    one = scored("a", gain=800)
    little = tuple(run / 100 for run in one.held)
    base = replace(BASE, by_run={"first": 0.0, "second": 0.0})
    lonely = Scored(
        one.names, 0.0, one.blocks, little, lambda: 0.1, {"first": -798.0, "second": -2.0}
    )
    found = decide(base, [lonely], SAMPLES, RULES)
    assert found.kind == "SET"
    assert found.reason == "a may be there, but first alone supports it; repeat that run"
    confirmed = replace(lonely, held=one.held)  # a run held out that supports it is another
    assert decide(base, [confirmed], SAMPLES, RULES).kind == "NAMED"
    shared = Scored(
        one.names, 0.0, one.blocks, one.held, lambda: 0.1, {"first": -700.0, "second": -100.0}
    )
    assert decide(base, [shared], SAMPLES, RULES).kind == "NAMED"


def test_a_cause_is_named_where_only_what_comes_beside_it_cannot_be_separated() -> None:
    single = scored("a", gain=800, lack=0.8)
    pairs = [scored("a", "b", gain=1000), scored("a", "c", gain=998, seed=1)]
    found = decide(BASE, [single, *pairs], SAMPLES, RULES)
    assert (found.kind, found.best.names) == ("NAMED", ("a",))
    assert found.reason.endswith("beside it b or c, which these runs cannot separate")
    lacking = scored("a", gain=800, lack=3.0)
    assert decide(BASE, [lacking, *pairs], SAMPLES, RULES).kind == "SET"


def test_a_number_far_beyond_its_tolerance_needs_no_gain_of_a_practical_size() -> None:
    base = replace(scored(scatter=0.0), prior=54.0)  # other numbers do the same, far off theirs
    freed = replace(scored("a", gain=-4.0, held=-0.6), prior=19.0, frees=frozenset({"a"}))
    found = decide(base, [freed], SAMPLES, RULES)
    assert (found.kind, found.best.names) == ("NAMED", ("a",))
    assert decide(base, [replace(freed, frees=frozenset())], SAMPLES, RULES).kind == "CLEAN"
    assert decide(base, [replace(freed, prior=40.0)], SAMPLES, RULES).kind == "CLEAN"
    refused = scored("a", gain=-4.0, held=-20.0)
    refused = replace(refused, prior=19.0, frees=frozenset({"a"}))
    assert decide(base, [refused], SAMPLES, RULES).kind == "CLEAN"


@pytest.mark.parametrize(("numbers", "kind"), [(1, "SET"), (4, "CLEAN")])
def test_many_numbers_gain_more_by_chance(numbers: int, kind: str) -> None:
    few = 600  # samples, of which a gain of 9 is of a practical size
    ripple = replace(scored("a", gain=11.4, held=0.8), numbers=numbers)
    assert decide(scored(scatter=0.0), [ripple], few, RULES).kind == kind


def test_as_rare_a_gain_is_greater_where_more_numbers_are_released() -> None:
    assert RULES.no_chance(1) == pytest.approx(RULES.least_gain)
    assert scipy.stats.chi2.sf(RULES.no_chance(4), 4) == pytest.approx(
        scipy.stats.chi2.sf(RULES.least_gain, 1)
    )


def test_no_cause_is_named_beside_one_that_the_seconds_prefer_to_it() -> None:
    weak, strong = scored("a", gain=300, held=6), scored("b", gain=800, held=-6)
    found = decide(BASE, [weak, strong], SAMPLES, RULES)
    assert (found.kind, found.best.names) == ("SET", ("a",))
    assert found.reason == "a, b cannot be separated by these runs"


def test_a_pair_that_gains_less_than_one_of_its_causes_is_not_taken() -> None:
    refused = scored("a", gain=1500, held=-300)  # by the runs held out
    other = scored("b", gain=500, seed=1)
    for gain, names in ((900, ("b",)), (1600, ("a", "b"))):
        pair = scored("a", "b", gain=gain, seed=2)
        assert decide(BASE, [refused, other, pair], SAMPLES, RULES).best.names == names


@pytest.mark.parametrize(("lack", "kind"), [(0.4, "NAMED"), (1.2, "NONE")])
def test_what_explains_all_is_not_hidden_by_the_noise_that_the_base_asks_for(
    lack: float, kind: str
) -> None:
    without, cause = scored(gain=-300, lack=5), scored("a", gain=-10, held=0, lack=lack)
    base = replace(scored(lack=5, scatter=0.0), again=lambda: without)
    hidden = replace(scored("a", gain=30, held=-5, lack=lack), again=lambda: cause)
    assert hidden.cost > base.cost - RULES.practical(SAMPLES)
    found = decide(base, [hidden], SAMPLES, RULES)
    assert found.kind == kind
    assert found.missing == (lack if kind == "NAMED" else 5)


def test_runs_that_cannot_show_a_cause_have_no_vote() -> None:
    """Of three runs held out one has a landing; chance lifts the others by less than nothing."""
    base = scored(scatter=0.0)
    base = replace(base, held=(*base.held, np.zeros(10)))
    held = (np.full(10, 0.01), np.full(10, 0.02), np.full(10, -1.4))
    every = replace(scored("a", gain=800), held=held)
    assert decide(base, [every], SAMPLES, RULES).kind == "SET"
    landed = replace(every, shown={"a": Shown(SAMPLES, (False, False, True))})
    assert versus(landed, base).runs == versus(base, landed).runs + 1 == 1
    assert decide(base, [landed], SAMPLES, RULES).kind == "NAMED"
    unseen = replace(every, shown={"a": Shown(SAMPLES, (False, False, False))})
    assert versus(unseen, base).runs == 0
    beside = replace(scored("a", "b", gain=900), held=held, shown=landed.shown)
    assert versus(beside, landed).runs == 0.0, "b is what they differ in, and every run shows that"


def test_a_gain_is_of_a_practical_size_for_the_samples_that_can_show_it() -> None:
    base = scored(scatter=0.0)
    little = scored("a", gain=0.5 * RULES.size * SAMPLES)
    assert decide(base, [little], SAMPLES, RULES).kind == "CLEAN"
    few = replace(little, shown={"a": Shown(SAMPLES // 4, (True, True))})
    assert decide(base, [few], SAMPLES, RULES).kind == "NAMED"


@pytest.mark.parametrize(
    ("robot", "drive", "answer"),
    [
        ("CLEAN", "CLEAN", "CLEAN"),
        ("NAMED", "CLEAN", "NAMED"),
        ("NAMED", "SET", "SET"),
        ("NONE", "CLEAN", "NONE"),
        ("NONE", "NAMED", "PARTIAL"),
        ("NONE", "SET", "PARTIAL"),
        ("PARTIAL", "SET", "PARTIAL"),
    ],
)
def test_what_is_left_in_robot_or_drive_makes_the_answer_partial(
    robot: Kind, drive: Kind, answer: Kind
) -> None:
    assert both({robot, drive}) == both({drive, robot}) == answer
