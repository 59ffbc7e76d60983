"""Which hypotheses are refitted, and which race: where a neighbourhood misled, and only there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.diagnose.paper import TERMS, cause, measured
from workbench.diagnose import hypotheses, judging, solve
from workbench.diagnose import search as searching
from workbench.diagnose.judging import DEARER
from workbench.diagnose.layout import Layout
from workbench.diagnose.minimum import prior_of
from workbench.diagnose.noise import noise_of
from workbench.diagnose.problem import Problem
from workbench.diagnose.screen import Neighbourhood, Score
from workbench.diagnose.search import FAR, Search
from workbench.diagnose.solve import fit

BASE = 1000.0


class Paper(Search):
    """Fits arrive at costs that are given, and races are written down."""

    def __init__(self, reached: Mapping[tuple[str, ...], float]) -> None:
        base: Any = SimpleNamespace(cost=BASE, left=0.9, fit=SimpleNamespace(linear=None))
        super().__init__(problem=None, base=base, tell=lambda text: None)  # pyright: ignore
        self.reached, self.raced = reached, list[tuple[str, ...]]()

    def race(
        self, scores: Sequence[Score], begin: NDArray[np.float64] | None = None, after: float = 0.0
    ) -> None:
        """Write down who races."""
        self.raced += [score.causes for score in scores]

    def _refit(self, causes: tuple[str, ...]) -> Any:
        found = SimpleNamespace(causes=causes, cost=self.reached[causes], left=0.8)
        self.best[causes] = found  # pyright: ignore[reportArgumentType]
        return found


def promised(cost: float, *causes: str) -> Score:
    return Score(causes, cost, BASE - cost, 1.0, np.zeros(1))


def test_rivals_race_with_one_that_fell_short() -> None:
    search = Paper({("mass",): 800.0, ("play",): 700.0})
    short, kept, rival = promised(200, "mass"), promised(680, "play"), promised(850, "cable")
    search.refit([short, kept], [short, kept, rival])
    assert search.raced == [("mass",), ("play",), ("cable",)]


def test_nobody_races_where_promises_are_kept() -> None:
    search = Paper({("mass",): 320.0})
    search.refit([promised(300, "mass")], [promised(850, "cable")])
    assert search.raced == []


def test_what_promised_less_than_another_reached_does_not_race() -> None:
    search = Paper({("mass", "cable"): 150.0, ("mass", "play"): 900.0, ("play", "cable"): 900.0})
    search.refit(
        [promised(100, "mass", "cable"), promised(300, "mass", "play"),
         promised(120, "play", "cable")]
    )  # fmt: skip
    assert search.raced == [("play", "cable")]


def test_what_stopped_on_its_way_goes_on_where_it_explains_as_much(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search, went_on = Paper({}), list[tuple[str, ...]]()
    monkeypatch.setattr(search, "_fit_anew", lambda causes, z, damping: went_on.append(causes))
    search.base.fit.cost = BASE  # pyright: ignore[reportAttributeAccessIssue]
    for name, cost, arrived in [
        ("mass", 200.0, True), ("play", 220.0, False), ("cable", 700.0, False)
    ]:  # fmt: skip
        fit = SimpleNamespace(cost=cost, arrived=arrived, z=np.zeros(1), damping=0.0)
        search.best[name,] = SimpleNamespace(causes=(name,), cost=cost, fit=fit)  # pyright: ignore
    search.arrive(1)
    assert went_on == [("play",)]


def swings(seed: int, **amounts: float) -> Problem:
    rig = measured(seed, amounts)
    return Problem(rig, Layout(rig), noise_of(rig.runs, (0, 1, 2)), (0, 1, 2))


def test_a_release_takes_the_whole_difference_over_from_its_number() -> None:
    problem = swings(3)
    layout = problem.layout
    (number,), (release,) = layout.replaced(("stiffness", "creep")), layout.of_cause["stiffness"]
    assert layout.unknowns[number].name == "omega"
    z = np.zeros(len(layout))
    z[number], z[release] = 1.2, -0.3
    there = layout.taken_over(z, ("creep", "stiffness"))
    assert there[number] == 0.0
    assert there[release] != z[release]
    for before, after in zip(problem.predictions(z), problem.predictions(there), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-12)
    np.testing.assert_array_equal(layout.taken_over(z, ("creep",)), z)


def test_a_number_and_its_release_do_not_move_together() -> None:
    layout = swings(3).layout
    (number,), (release,) = layout.replaced(("stiffness",)), layout.of_cause["stiffness"]
    assert number in prior_of(layout).free
    assert number in prior_of(layout, ("creep",)).free
    free = prior_of(layout, ("stiffness",)).free
    assert release in free
    assert number not in free


def test_a_release_of_two_numbers_holds_both_where_they_are() -> None:
    rig = measured(3, {})
    layout = Layout(replace(rig, causes=(cause("rate", replaces=("omega", "decay")),)))
    numbers = layout.replaced(("rate",))
    assert [layout.unknowns[i].name for i in numbers] == ["omega", "decay"]
    z = np.zeros(len(layout))
    z[numbers] = 1.2, -0.3
    np.testing.assert_array_equal(layout.taken_over(z, ("rate",)), z)
    assert not set(numbers) & set(prior_of(layout, ("rate",)).free)


def test_a_refit_does_not_end_dearer_than_what_it_adds_to() -> None:
    problem = swings(5, hardening=0.3, wobble=2.0)
    base, *_ = hypotheses._base(problem)
    search = Search(problem, base, lambda text: None)
    for name in problem.layout.causes:
        assert search._refit((name,)).fit.cost <= base.fit.cost
    single = search.found(1)[0]
    pair = search._refit((*single.causes, "creep"))
    assert pair.fit.cost <= single.fit.cost


def test_a_base_that_stopped_on_its_way_is_no_gain_of_a_cause() -> None:
    problem = swings(5)
    base, *_ = hypotheses._base(problem)
    z = base.fit.z.copy()
    z[problem.layout.base] += 0.05
    stopped = fit(problem, z, prior_of(problem.layout), linear=base.fit.linear, trials=0)
    misjudged = replace(judging.judged(problem, (), stopped), cost=base.cost + 50.0)
    search = Search(problem, misjudged, lambda text: None)
    scores = [promised(BASE - 1.0, "creep")]
    creep = search._fit_anew(("creep",), base.fit.z)
    assert search.base.cost - creep.cost > 20
    search.doubt_base(scores)
    assert search.base.fit.cost == pytest.approx(base.fit.cost, abs=0.5)
    assert search.best["creep",].size < creep.size / 5
    again = search.base
    search.doubt_base(scores)
    assert search.base is again


def test_the_base_begins_again_with_its_own_number_where_the_cause_is_its_release(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = swings(5)
    base, *_ = hypotheses._base(problem)
    search = Search(problem, base, lambda text: None)
    released = search._refit(("stiffness",))
    (number,) = problem.layout.replaced(("stiffness",))
    assert released.fit.z[number] == 0.0 != base.fit.z[number]
    begun = list[float]()

    def seen(problem: Problem, z: NDArray[np.float64], *rest: Any) -> Any:
        begun.append(sum(float(part @ part) for part in problem.residuals(z)) / 2)
        return solve.renewed(problem, z, *rest)

    monkeypatch.setattr(searching, "renewed", seen)
    search._fit_base_anew(released)
    assert begun == [pytest.approx(base.fit.cost, rel=0.2)]


def test_a_cause_is_judged_from_where_the_base_s_clutter_led_if_that_is_cheaper() -> None:
    problem = swings(5)
    base, *_ = hypotheses._base(problem)
    samples, prior = problem.samples(), prior_of(problem.layout, ("creep",))
    z = base.fit.z.copy()
    z[problem.layout.base] += 0.05
    stopped = fit(problem, z, prior, linear=base.fit.linear, trials=0)
    blind = [0 * jacobian for jacobian in stopped.linear.jacobians]
    stopped = replace(stopped, linear=stopped.linear.with_jacobians(blind))
    alone = judging.with_clutter(problem, ("creep",), stopped, samples)
    led = judging.with_clutter(problem, ("creep",), stopped, samples, [base])
    assert alone.lowest(("creep",)) > base.fit.cost + 50
    assert led.lowest(("creep",)) < base.fit.cost


def test_clutter_that_would_explain_the_noise_is_tried_and_not_believed() -> None:
    problem = swings(3)
    layout, samples = problem.layout, problem.samples()
    linear = problem.linear(np.zeros(len(layout)), np.arange(len(layout)))
    found = fit(problem, linear.z, prior_of(layout), linear=linear)
    lie, (column,) = [], layout.of_cause["wobble"]
    for jacobian, residual in zip(found.linear.jacobians, found.residuals, strict=True):
        lie.append(jacobian.copy())
        lie[-1][:, column] += residual
    false = replace(found, linear=found.linear.with_jacobians(lie))
    believed = Neighbourhood(layout, false.linear, samples)
    assert believed.lowest(()) < found.cost - 1.5 * judging._FORETOLD
    tried = judging.with_clutter(problem, (), false, samples)
    assert abs(tried.lowest(()) - found.cost) < judging._FORETOLD / 4
    honest = judging.with_clutter(problem, (), found, samples)
    assert honest.linear is found.linear


def test_a_cause_more_is_judged_again_where_it_made_things_dearer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = swings(5)
    base, *_ = hypotheses._base(problem)
    layout, samples = problem.layout, problem.samples()
    z = base.fit.z.copy()
    z[layout.base] += 0.05
    stopped = fit(problem, z, prior_of(layout, ("creep",)), linear=base.fit.linear, trials=0)
    lie, (column,) = [], layout.of_cause["wobble"]
    for jacobian, residual in zip(stopped.linear.jacobians, stopped.residuals, strict=True):
        lie.append(0 * jacobian)
        lie[-1][:, column] += residual
    false = replace(stopped, linear=stopped.linear.with_jacobians(lie))
    assert Neighbourhood(layout, false.linear, samples).lowest(("creep",)) < base.cost
    led = judging._led

    def stuck(*args: Any) -> Neighbourhood:
        """Lead nowhere from its own place, which promised more."""
        if args[3:]:
            return led(*args)
        blind = [0 * jacobian for jacobian in stopped.linear.jacobians]
        return Neighbourhood(layout, stopped.linear.with_jacobians(blind), samples)

    monkeypatch.setattr(judging, "_led", stuck)
    assert judging.judged(problem, ("creep",), false).cost > base.cost + 50
    assert judging.judged(problem, ("creep",), false, [base]).cost < base.cost + DEARER


def test_what_contradicts_one_of_fewer_causes_is_judged_again() -> None:
    search = Search(problem := swings(5), hypotheses._base(problem).base, lambda text: None)
    search._refit(("creep",))
    search._refit(("wobble",))
    dear = replace(search.best["creep",], cost=search.base.cost + 50.0)
    kept = replace(search.best["wobble",], cost=search.base.cost + DEARER / 2)
    search.best |= {dear.causes: dear, kept.causes: kept}
    assert judging.contradiction(dear, [search.base]) == pytest.approx(50.0)
    search.reconcile()
    assert search.best["creep",].cost < search.base.cost + DEARER
    assert search.best["wobble",] is kept


@pytest.mark.parametrize(("trials", "arrived"), [(2, False), (24, True)])
def test_a_fit_tells_whether_it_arrived(trials: int, arrived: bool) -> None:
    problem = swings(3, hardening=0.08)
    layout = problem.layout
    begin = np.zeros(len(layout))
    begin[layout.base] = 2.5
    found = fit(problem, begin, prior_of(layout, ("hardening",)), trials=trials)
    assert found.arrived == arrived


def test_all_race_where_those_that_were_promised_much_explain_little(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = swings(3, creep=0.2)
    base, *_ = hypotheses._base(problem)
    search = Search(problem, base, lambda text: None)
    assert search.unexplained
    laps = list[tuple[list[str], float]]()
    whole = search._lap

    def lap(running: Sequence[Any], until: float, linear: Any) -> Any:
        laps.append(([one.causes[0] for one in running], until))
        return whole(running, until, linear)

    monkeypatch.setattr(search, "_lap", lap)
    search.race([base.near.score(("wobble",))])
    search.race_others(base.near, 2.5)
    assert laps[0] == (["wobble"], 1.0)
    others, until = laps[-1]
    assert until == 5.0
    assert others[0] == "creep"
    assert set(others) == set(problem.layout.of_cause) - {"wobble"}
    assert search.found(1)[0].causes == ("creep",)
    assert not search.unexplained


def test_those_that_tie_in_a_race_arrive_all(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = swings(3, creep=0.2)
    base, *_ = hypotheses._base(problem)
    search = Search(problem, base, lambda text: None)
    behind = {"creep": 100.0, "wobble": 108.0, "scale": 109.0, "hardening": 150.0}

    def lap(running: Sequence[Any], until: float, linear: Any) -> Any:
        told = [replace(one, excess=behind[one.causes[0]]) for one in running]
        return sorted(told, key=lambda one: one.excess)

    monkeypatch.setattr(search, "_lap", lap)
    search.race([base.near.score((name,)) for name in behind])
    assert {one.causes[0] for one in search.found(1)} == {"creep", "wobble", "scale"}


def test_a_second_cause_is_sought_where_the_first_still_follows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What sets in late is none of the first seconds, and bends the fit of whole runs."""
    monkeypatch.setitem(TERMS, "late", lambda t, a: 1e-3 * (t / 6) ** 8)
    rig = measured(3, {"creep": 2.0, "late": 4.0})
    rig = replace(rig, causes=(*rig.causes, cause("late")))
    problem = Problem(rig, Layout(rig), noise_of(rig.runs, (0, 1, 2)), (0, 1, 2))
    base, *_ = hypotheses._base(problem)
    search = Search(problem, base, lambda text: None)
    assert search.close_to(("creep",)) is None
    search.race([base.near.score(("creep",))])
    single = search.found(1)[0]
    assert single.left > FAR
    near, until = search.close_to(("creep",)) or pytest.fail("creep follows no lap")
    assert until == 5.0
    added = [name for name in near.heard if name != "creep"]
    assert min(added, key=lambda name: near.lowest(("creep", name))) == "late"
    search.race(hypotheses._beside(near, "creep"), near.z, until)
    assert search.found(2)[0].causes == ("creep", "late")
    assert not search.unexplained
