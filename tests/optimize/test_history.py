"""The table of a search says what happened."""

from __future__ import annotations

import numpy as np

from tests.optimize.contract import NAMES, three
from workbench.optimize import History


def test_the_table_tells_best_mean_and_failures_of_each_generation() -> None:
    columns = three().columns()
    assert columns["best"].tolist() == [99.0, 98.6, 102.0]
    assert columns["best so far"].tolist() == [99.0, 98.6, 98.6]
    assert columns["failures"].tolist() == [1, 1, 3]
    assert columns["evaluated"].tolist() == [2, 2, 2]
    np.testing.assert_allclose(columns["mean"], [99.25, 99.0, np.nan])
    lines = three().table().splitlines()
    assert " ".join(lines[0].split()) == "best mean best so far failures evaluated seconds"
    assert lines[2].split() == ["2", "98.6", "99", "98.6", "1", "2", "0.50"]


def test_a_history_sums_up_what_it_cost() -> None:
    history = three()
    assert (history.asked, history.evaluated, history.seconds) == (9, 6, 1.5)
    assert history.best.evaluation.fitness[0] == 98.6
    assert history.generations[2].failures == ("fell", "crashed", "fell")


def test_an_empty_history_has_an_empty_table() -> None:
    assert len(History(NAMES).table().splitlines()) == 1
    assert History(NAMES).columns()["best so far"].shape == (0,)
