"""Control charts: limits by the book, and a run that is out of them is found."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from tests.bundles import NOW, make_bundle
from workbench.catalogue import Query, beside_earlier, conditions, search, trends
from workbench.catalogue.trend import individuals

FLOW = [49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1]
"""The example of the NIST/SEMATECH e-Handbook, 6.3.2.2: mean 50.81, limits 45.8159 and 55.8041."""


def test_limits_are_those_of_the_handbook() -> None:
    limits = individuals(np.array(FLOW))
    assert limits is not None
    assert limits.centre == pytest.approx(50.81)
    assert (limits.lower, limits.upper) == pytest.approx((45.8159, 55.8041), abs=1e-4)
    assert individuals(np.array(FLOW[:4])) is None


def test_later_runs_are_judged_by_the_limits_of_the_first() -> None:
    drifting = np.concatenate([np.tile([1.0, 2.0], 13)[:25], np.full(9, 30.0)])
    assert individuals(drifting) == individuals(drifting[:25])


def test_a_jump_and_a_drift_of_one_condition_are_found(tmp_path: Path) -> None:
    root, day = tmp_path / "runs", timedelta(days=1)
    errors = [5.0, 5.4, 5.1, 5.3, 5.0, 5.5, 5.2, 9.0]
    for k, error in enumerate(errors):
        make_bundle(root, f"r{k}", NOW + k * day, error_mm=error, protocol="hop.yaml")
    make_bundle(root, "bad", NOW + 9 * day, status="failed", protocol="hop.yaml")
    make_bundle(root, "other", NOW + 9 * day, speed_rad_s=14.0, protocol="hop.yaml")
    found = conditions(search(root, Query(), pytest.fail).entries)
    assert sorted(map(len, found.values())) == [1, 8]
    usual = max(found, key=lambda one: len(found[one]))
    assert str(usual) == "hop at 17 rad/s, hop.yaml, thesis with thesis-initial"
    by_title = {trend.title: trend for trend in trends(found[usual])}
    twin = by_title["Error of the twin"]
    assert twin.values.tolist() == errors
    assert twin.signals.tolist() == 7 * [False] + [True]
    assert not by_title["Distance"].signals[:7].any()
    speed = by_title["Rotor speed, measured against asked for"]
    assert speed.values == pytest.approx(100 * (16.9 / 16.988 - 1))


def test_eight_in_a_row_on_one_side_are_a_signal(tmp_path: Path) -> None:
    root = tmp_path / "runs"
    errors = [5.0, 7.0] * 12 + [6.0] + 8 * [6.5]
    for k, error in enumerate(errors):
        make_bundle(root, f"r{k}", NOW + k * timedelta(hours=1), error_mm=error)
    (runs,) = conditions(search(root, Query(), pytest.fail).entries).values()
    signals = trends(runs)[0].signals
    assert np.flatnonzero(signals).tolist() == [len(errors) - 1]


def test_a_run_is_compared_with_the_last_ones_of_its_condition(tmp_path: Path) -> None:
    root, names = tmp_path / "runs", []
    for k, error in enumerate([5.0, 5.4, 5.1, 5.3, 5.2, 9.0]):
        names.append(
            make_bundle(root, f"r{k}", NOW + k * timedelta(days=1), error_mm=error).path.name
        )
    make_bundle(root, "other", NOW, speed_rad_s=14.0, error_mm=1.0)
    entries = search(root, Query(), pytest.fail).entries
    assert beside_earlier(entries, names[0]) == ""
    assert beside_earlier(entries, names[1]) == (
        "Beside the last run of the same condition: error of the twin 5.4 mm (before: 5.0 to 5.0), "
        "distance 213.0 mm (before: 213.0 to 213.0)."
    )
    assert beside_earlier(entries, names[5]) == (
        "Beside the last 5 runs of the same condition: error of the twin 9.0 mm (before: 5.0 to "
        "5.4), distance 213.0 mm (before: 213.0 to 213.0); outside the control limits: error of "
        "the twin."
    )
