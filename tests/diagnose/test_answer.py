"""How far one cause is behind another where chance, or what nothing explains, moves their costs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.diagnose.answer import APART, LEAST_WORTH, alike, believable, decide
from workbench.diagnose.hypotheses import Refits

RUNS, SAMPLES = 5, 1000
TIMES = np.arange(SAMPLES) / 100


def fitted(residuals: list[NDArray[np.float64]]) -> Any:
    """Return a hypothesis with one cause that leaves some residuals."""
    cost = sum(float(one @ one) for one in residuals) / 2
    return SimpleNamespace(
        causes=("it",), cost=cost, near=SimpleNamespace(unexplained=lambda _: residuals)
    )


def named(foreign: float, reach: float = APART) -> tuple[int, int]:
    """Return in how many of 200 robots one of two causes is named: the true one, the false one.

    They part by 0.08 of the noise in 5 runs of 1000 samples: the true one is 16 ahead, give or take
    5.7 by noise.

    Args:
        foreign: noise deviations of a swing that neither explains.
        reach: of the cost, by which a rival must be behind.
    """
    count = [0, 0]
    for seed in range(200):
        rng = np.random.default_rng(seed)
        left = [rng.standard_normal(SAMPLES) + foreign * swing(rng) for _ in range(RUNS)]
        true, false = fitted(left), fitted([one + 0.08 * swing(rng) for one in left])
        both = sorted((true, false), key=lambda one: one.cost)
        refits: Any = SimpleNamespace(with_as_many=lambda _, both=both: both, misjudged=0.0)
        if len(alike(refits, both[0], reach)) == 1:
            count[both[0] is false] += 1
    return count[0], count[1]


def swing(rng: np.random.Generator) -> NDArray[np.float64]:
    """Return a swing of root mean square one that is the same through a run, of any phase."""
    path = np.sin(2 * np.pi * 3.0 * TIMES + rng.uniform(0, 2 * np.pi))
    return path / np.sqrt(np.mean(path**2))


def test_where_noise_alone_is_left_a_difference_counts_whole() -> None:
    true, false = named(0.0)
    print(true, false)
    assert true > 180
    assert false == 0


def test_what_neither_explains_lets_neither_be_named() -> None:
    """A swing of 0.8 moves their difference by a hundred, as often to one side as to the other."""
    true, false = named(0.8)
    print(true, false)
    assert false < 10


@pytest.mark.parametrize("draws", [25_000, pytest.param(100_000, marks=pytest.mark.long)])
def test_a_second_cause_is_not_believed_because_five_runs_agree_by_chance(draws: int) -> None:
    rng = np.random.default_rng(0)
    pulls = rng.standard_normal((draws, RUNS))  # of each run, for or against it
    spread = pulls - pulls.mean(axis=1, keepdims=True)
    gained = RUNS * pulls.mean(axis=1) ** 2 / (spread**2).sum(axis=1) * (RUNS - 1) / 2
    worth = np.array([believable(float(one), 1e6, RUNS) for one in gained])
    assert np.mean(gained > LEAST_WORTH) > 0.01
    assert np.mean(worth > LEAST_WORTH) < 3e-4


def test_a_gain_counts_whole_where_noise_alone_moves_it_or_many_runs_tell_the_scatter() -> None:
    assert believable(20.0, 1.0, RUNS) == 20.0
    assert believable(20.0, 30.0, RUNS) < LEAST_WORTH < believable(20.0, 1.05, RUNS)
    assert abs(believable(20.0, 30.0, 10_000) - 20.0) < 0.1
    assert believable(-3.0, 30.0, RUNS) == -3.0
    assert believable(5e4, 1.001, 100) > 1e3


def judged(cost: float, alone: float, *causes: str) -> Any:
    """Return a hypothesis by its costs: with the clutter of all others, and of its fit alone."""
    layout = SimpleNamespace(numerics=("mesh",))
    near = SimpleNamespace(layout=layout, unexplained=lambda _: [np.zeros(3)], samples=9, silent=())
    runs = SimpleNamespace(runs=range(RUNS))
    fit = SimpleNamespace(cost=alone, linear=runs, apart=lambda other, samples: 1.0)
    return SimpleNamespace(causes=causes, cost=cost, fit=fit, near=near, left=0.3, beyond=0.0)


def refits(base: Any, singles: tuple[Any, ...], pairs: tuple[Any, ...] = ()) -> Any:
    return Refits(cast(Any, None), base, singles, pairs, (), 0.0, 0.0)


def test_costs_are_believed_as_far_as_those_of_nested_models_agree() -> None:
    base, play = judged(1000, 1500), judged(960, 1400, "play")
    assert refits(base, (play,)).misjudged == 0
    drag = judged(1150, 1100, "drag")  # cheaper by itself, dearer with its clutter
    assert refits(base, (play, drag)).misjudged == 150
    assert refits(base, (play,), (judged(990, 1390, "play", "drag"),)).misjudged == 30
    assert refits(base, (play, judged(1150, 1600, "drag"))).misjudged == 0  # did not arrive
    assert refits(base, (play, judged(1150, 1100, "mesh"))).misjudged == 0


def test_what_is_cheaper_by_itself_is_a_rival_where_costs_contradict_each_other() -> None:
    base, play = judged(1000, 1500), judged(960, 1400, "play")
    drag, slack = judged(1150, 1100, "drag"), judged(1150, 1500, "slack")
    contradicted = refits(base, (play, drag, slack))
    assert alike(contradicted, play, APART) == [play, drag]
    assert refits(base, (play, slack)).misjudged == 150


@pytest.mark.parametrize(
    ("worth", "off", "why"),
    [
        (40, 30, "play: every other cause leaves clearly more unexplained"),
        (40, 34, "play may be there, worth 40.0, but the fits contradict each other by 34.0, so a "
                 "mixture may do as well"),
        (6, 0, "play may be there, but so small a misfit may also be a mixture"),
    ],
)  # fmt: skip
def test_a_cause_that_is_not_sure_is_a_set_with_the_reason(
    worth: float, off: float, why: str
) -> None:
    base, play = judged(1000, 1500), judged(1000 - worth, 1400, "play")
    layout = SimpleNamespace(numerics=(), causes={"play": SimpleNamespace(group="hinge")})
    pair = judged(1000 - worth + off, 1399, "play", "drag")
    found = decide(refits(base, (play,), (pair,) if off else ()), cast(Any, layout))
    assert found.reason == why
    assert found.kind == ("NAMED" if worth > LEAST_WORTH + off else "SET")
    assert found.causes == ("play",)


def second(*added: int, off: float = 200.0, gain: float = 50.0) -> Any:
    """Return the answer where two pairs are cheaper than a cause, and fits contradict each other.

    Args:
        added: indices of the pairs that runs held out speak for.
        off: of the costs, by what another cause shows.
        gain: of the first pair over the cause.
    """
    base, play = judged(1000, 1500), judged(600, 1400, "play")
    drag = judged(1000 + off, 1450, "drag")
    pairs = judged(600 - gain, 900, "play", "drag"), judged(604 - gain, 950, "play", "slack")
    every = {name: SimpleNamespace(group="hinge") for name in ("play", "drag", "slack")}
    layout = SimpleNamespace(numerics=(), causes=every)
    asked: list[Any] = []

    def adding(single: Any, more: Any) -> list[Any]:
        asked.append((single, tuple(more)))
        return [more[k] for k in added]

    found = decide(refits(base, (play, drag), pairs), cast(Any, layout), adding=adding)
    assert not asked or asked == [(play, pairs)]
    return found, bool(asked)


def test_runs_held_out_tell_a_second_cause_where_fits_contradict_each_other() -> None:
    found, asked = second(0)
    assert asked
    assert (found.kind, found.causes) == ("NAMED", ("play", "drag"))
    assert found.weights == {"play": 1.0, "drag": 1.0}
    assert found.reason == (
        "play and drag: every other cause leaves clearly more unexplained, in runs held out as well"
    )


def test_two_second_causes_that_runs_held_out_speak_for_are_a_set() -> None:
    found, _ = second(0, 1)
    assert (found.kind, set(found.causes)) == ("SET", {"play", "drag", "slack"})


@pytest.mark.parametrize("added", [(), (1,)])
def test_a_second_cause_that_runs_held_out_do_not_speak_for_is_not_named(added: Any) -> None:
    found, asked = second(*added)
    assert asked
    assert (found.kind, found.causes) == ("NAMED", ("play",))


def test_runs_held_out_are_not_asked_for_what_the_runs_fitted_do_not_show() -> None:
    found, asked = second(0, gain=LEAST_WORTH)
    assert not asked
    assert found.causes == ("play",)


def test_no_second_cause_is_sought_where_the_first_is_not_sure() -> None:
    found, asked = second(0, off=400.0)
    assert not asked
    assert found.kind == "SET"


@pytest.mark.parametrize(("left", "causes"), [(3.0, ("play", "drag")), (0.9, ("play",))])
def test_how_runs_scatter_does_not_matter_where_one_cause_misses_them_by_far(
    left: float, causes: tuple[str, ...]
) -> None:
    base, play, both = (
        judged(1000, 1500), judged(960, 1400, "play"), judged(900, 1000, "play", "drag")
    )  # fmt: skip
    play.left, both.left = left, 0.1
    both.near.unexplained = lambda _: [np.full(3, 30.0)]
    play.near.unexplained = lambda _: [np.full(3, 31.0)]
    hinge = SimpleNamespace(group="hinge")
    layout = SimpleNamespace(numerics=(), causes={"play": hinge, "drag": hinge})
    found = decide(refits(base, (play,), (both,)), cast(Any, layout))
    assert (found.kind, found.causes) == ("NAMED", causes)
