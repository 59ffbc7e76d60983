"""Fronts of two goals: found, drawn together, and honest about the missing package."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numpy.typing import NDArray
from pymoo.indicators.hv import Hypervolume

from tests.optimize.contract import beam
from workbench.errors import InputError
from workbench.optimize import (
    Evaluation,
    Generation,
    History,
    Pareto,
    ParetoOptions,
    Space,
    Trial,
    search,
)


def trade(candidates: NDArray[np.float64]) -> list[Evaluation]:
    """Return the first of Zitzler's problems (ZDT1): the front is g = 1 - sqrt(f)."""
    far = 1 + 9 * candidates[:, 1:].mean(axis=1)
    first = candidates[:, 0]
    second = far * (1 - np.sqrt(first / far))
    return [Evaluation((float(a), float(b))) for a, b in zip(first, second, strict=True)]


def of(*rows: tuple[tuple[float, ...], str | None]) -> History:
    trials = tuple(Trial(np.full(2, k), Evaluation(f, {}, why)) for k, (f, why) in enumerate(rows))
    return History(("a", "b"), (Generation(trials, len(trials), 1.0),))


def test_a_known_front_is_approached() -> None:
    size = 6
    names = tuple(f"x{k}" for k in range(size))
    space = Space(names, np.zeros(size), np.ones(size), np.full(size, 0.5))
    history = search("zdt1", Pareto(space, 0, options=ParetoOptions(40)), trade,
                     evaluations=3000, penalty=(9.0, 9.0))  # fmt: skip
    worth = np.array([trial.evaluation.fitness for trial in history.front()])
    # the true front's volume to (1.1, 1.1) is 0.21 + 2/3
    volume = Hypervolume(ref_point=np.array([1.1, 1.1]))(worth)
    assert volume is not None
    assert 0.95 * (0.21 + 2 / 3) < volume < 0.21 + 2 / 3
    assert np.median(worth[:, 1] - (1 - np.sqrt(worth[:, 0]))) < 0.02


def test_a_front_has_none_that_another_beats() -> None:
    history = of(
        ((3.0, 1.0), None), ((1.0, 3.0), None), ((2.0, 2.0), None), ((2.0, 2.5), None),
        ((0.0, 0.0), "fell"), ((2.0, 2.0), None),
    )  # fmt: skip
    assert [t.evaluation.fitness for t in history.front()] == [(1.0, 3.0), (2.0, 2.0), (3.0, 1.0)]
    assert history.front()[1].candidate[0] == 2.0  # the first of two equal ones
    assert of(((1.0, 1.0), "fell")).front() == ()


def test_one_goal_s_front_is_the_best() -> None:
    assert [t.evaluation.fitness for t in of(((2.0,), None), ((1.0,), None)).front()] == [(1.0,)]


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pymoo", None)
    with pytest.raises(InputError, match=r"pymoo; pip install hopping-workbench\[pareto\]"):
        Pareto(beam(), 0)


def test_another_version_s_path_is_refused() -> None:
    algorithm = Pareto(beam(), 0)
    algorithm.tell(algorithm.ask(), np.ones((24, 2)))
    state = algorithm.state()
    state["told"][0][0][3][5] += 1e-9
    with pytest.raises(InputError, match="searches otherwise than the one that wrote"):
        Pareto(beam(), 0).restore(state)


def test_telling_before_asking_is_refused() -> None:
    with pytest.raises(InputError, match="told before it was asked for"):
        Pareto(beam(), 0).tell(np.zeros((24, 16)), np.ones((24, 2)))


def test_options_without_a_search_are_refused() -> None:
    with pytest.raises(InputError, match="population size 1 is at least 2"):
        ParetoOptions(population_size=1)
