"""Axes that are wrong are told by gravity, in flights that are on paper."""

from __future__ import annotations

import re

import numpy as np
import pytest

from workbench.motion import FOOT, ROTOR, TOP
from workbench.timeseries import TimeSeries
from workbench.tracking import Axes, Floor
from workbench.tracking.plausibility import fall, implausible

RATE = 120.0


def flights(down: tuple[float, float, float] = (0, 0, -1), flying: float = 9.81) -> TimeSeries:
    """Return six hops of 0.2 s with 0.15 s on the ground between, T swaying by 2 mm."""
    rng = np.random.default_rng(3)
    t = np.arange(round(6 * 0.35 * RATE)) / RATE
    u = np.maximum(t % 0.35 - 0.15, 0.0)
    height = flying / 2 * u * (0.2 - u)
    foot = -np.outer(height, down) + np.outer(0.1 * t, [1, 0, 0])
    top = foot + np.array([0.05, 0, 0.28]) + np.outer(0.002 * np.sin(12 * t), [1, 0, 0])
    columns: dict[str, np.ndarray] = {}
    for names, path in ((FOOT, foot), (TOP, top), (ROTOR, top + np.array([0.035, 0, 0]))):
        columns |= dict(zip(names, (path + rng.normal(0, 1e-4, path.shape)).T, strict=True))
    return TimeSeries.of(t, columns)


def middle(motion: TimeSeries) -> np.ndarray:
    return (motion.select(FOOT).values + motion.select(TOP).values) / 2


def test_flights_fall_with_gravity() -> None:
    motion = flights()
    found = fall(motion.times, middle(motion))
    assert found is not None
    np.testing.assert_allclose(found, [0.0, 0.0, -9.81], atol=0.3)
    assert implausible(motion, Axes(), None) == []


@pytest.mark.parametrize(
    ("down", "axes", "words"),
    [
        ((0, 1, 0), Axes(up="y", forward="-z"), "gravity points along export axis -x: try up: x."),
        ((-1, 0, 0), Axes(up="y", forward="x"), "gravity points along export axis -x: try up: x."),
        ((0, 0, 1), Axes(up="z", forward="x"), "gravity points along export axis z: try up: -z."),
        ((0.2, 0, -0.98), Axes(), "gravity in flight is tilted by 1[12] deg"),
    ],
)
def test_gravity_names_the_export_axis_that_is_up(
    down: tuple[float, float, float], axes: Axes, words: str
) -> None:
    warnings = implausible(flights(down), axes, None)
    assert any(re.search(words, warning) for warning in warnings), warnings


def test_shaking_that_is_no_flight_says_nothing() -> None:
    t = np.arange(1200) / RATE
    shaken = 9.81 / 17**2 * np.column_stack([np.cos(17 * t), 0 * t, np.sin(17 * t)])
    assert fall(t, shaken) is None  # as large as gravity all the time, in every direction
    assert fall(t, 0.5 * shaken) is None
    motion = flights(flying=5.0)
    assert fall(motion.times, middle(motion)) is None
    assert fall(t[:4], shaken[:4]) is None


def test_a_floor_that_is_steep_and_sure_is_told() -> None:
    steep, unsure = Floor(0.1, 0.01, None, None, 20, 1e-3), Floor(0.1, 0.05, None, None, 6, 1e-3)
    assert implausible(flights(), Axes(), steep) == [
        "the floor rises by 5.7 +- 0.6 deg forward; nothing was corrected. Check the cameras' "
        "ground plane and whether the floor is level."
    ]
    assert implausible(flights(), Axes(), unsure) == []
