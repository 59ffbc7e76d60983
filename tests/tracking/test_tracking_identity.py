"""Exchanged markers are found and undone, and nothing else is touched."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from workbench.tracking import (
    Axes,
    BodyNames,
    RawPoints,
    Take,
    raw_points,
    read_take,
    write_motive,
    write_row,
)
from workbench.tracking.identity import untangle
from workbench.tracking.rigid_body import order_of_places

RECTANGLE = np.array([[120, -110, 12], [120, 110, 12], [-120, -110, 12], [-120, 110, 12]]) * 1e-3
SAME_SHAPE = [[3, 2, 1, 0], [1, 0, 3, 2], [2, 3, 0, 1]]
"""Exchanges after which a rectangle fits its places as well as before."""
OTHER_SHAPE = [[1, 0, 2, 3], [0, 2, 1, 3], [1, 2, 3, 0], [3, 0, 1, 2]]


def raw(take: Take, **options: Any) -> RawPoints:
    return raw_points(take, BodyNames(), Axes(), **options)


def exchanged(take: Take, name: str, slots: list[int], start: int, stop: int) -> Take:
    body = take.bodies[name]
    measured = body.measured.copy()
    measured[start:stop] = measured[start:stop][:, slots]
    return replace(take, bodies={**take.bodies, name: replace(body, measured=measured)})


def exchanged_between(take: Take, slots: list[int], start: int, stop: int) -> Take:
    """Return the take with the markers of T (0, 1) and Rotor (2, 3) in other slots for a while."""
    top, rotor = take.bodies["T"], take.bodies["Rotor"]
    both = np.concatenate([top.measured, rotor.measured], axis=1)
    both[start:stop] = both[start:stop][:, slots]
    bodies = {
        **take.bodies,
        "T": replace(top, measured=both[:, :2]),
        "Rotor": replace(rotor, measured=both[:, 2:]),
    }
    return replace(take, bodies=bodies)


def assert_same_paths(points: RawPoints, whole: RawPoints, within: float = 1e-9) -> None:
    for role, body in points.bodies.items():
        np.testing.assert_allclose(
            body.position, whole.bodies[role].position, atol=within, err_msg=role
        )


def wandering(seconds: float, turn: float, seed: int, noise: float = 2e-4) -> NDArray[np.float64]:
    """Return a rectangle that yaws by `turn` [rad] on its way, (n, 4, 3) [m], at 120 Hz."""
    n, rng = round(seconds * 120), np.random.default_rng(seed)
    matrix = Rotation.from_rotvec(np.outer(np.linspace(0, turn, n), [0, 0, 1])).as_matrix()
    path = np.cumsum(rng.normal(0, 2e-3, (n, 1, 3)), axis=0)
    return np.einsum("nij,mj->nmi", matrix, RECTANGLE) + path + rng.normal(0, noise, (n, 4, 3))


@pytest.mark.parametrize("slots", SAME_SHAPE + OTHER_SHAPE)
@pytest.mark.parametrize("placed", [True, False])
def test_an_exchange_within_the_foot_is_undone(
    hop: Any, foot_markers: Any, slots: list[int], placed: bool
) -> None:
    markers = foot_markers if placed else None
    points = raw(exchanged(hop.take, "Foot", slots, 400, 460), markers=markers)
    assert_same_paths(points, raw(hop.take, markers=markers))
    assert points.foot.pitch is not None
    assert np.abs(points.foot.pitch - hop.truth.pitch).max() < 4e-3
    assert points.warnings == (
        "'Foot': markers exchanged in 60 samples (1 stretches, the first at 3.333 s); undone",
    )


@pytest.mark.parametrize("slots", SAME_SHAPE)
def test_an_exchange_up_to_the_end_is_undone_from_the_shorter_side(slots: list[int]) -> None:
    cloud = wandering(8, 2.5, 1)
    mixed = cloud.copy()
    mixed[700:] = mixed[700:][:, slots]
    told = untangle(np.arange(len(cloud)) / 120, mixed)
    np.testing.assert_array_equal(told.cloud, cloud)
    assert np.flatnonzero(told.exchanged)[[0, -1]].tolist() == [700, 959]


def test_what_most_samples_have_counts_as_right() -> None:
    cloud = wandering(4, 1.0, 2)
    mixed = cloud.copy()
    for start, stop in ((0, 100), (200, 280)):
        mixed[start:stop] = mixed[start:stop][:, [3, 2, 1, 0]]
    told = untangle(np.arange(480) / 120, mixed)
    np.testing.assert_array_equal(told.cloud, cloud)
    assert np.flatnonzero(told.exchanged).tolist() == [*range(100), *range(200, 280)]


def test_a_quarter_turn_in_a_long_gap_is_no_exchange() -> None:
    # a slow full turn: after it every marker is where it was, a quarter turn before it none is
    cloud = wandering(4, 2 * np.pi + 0.6, 3)
    cloud[20:430, 1] = np.nan
    cloud[140:145] = wandering(4, 2 * np.pi + 0.6, 3)[140:145]
    times = np.arange(480) / 120
    assert untangle(times, cloud).cloud is cloud


@pytest.mark.parametrize("seed", [126, 1133])
def test_turning_bodies_with_many_gaps_come_back_untouched(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise, turn = rng.uniform(0, 6e-3), rng.uniform(-8, 8)
    cloud = wandering(4, turn, seed, noise)
    for _ in range(rng.integers(0, 15)):
        start = rng.integers(480)
        length = rng.integers(1, 100)
        cloud[start : start + length, rng.permutation(4)[: rng.integers(1, 5)]] = np.nan
    assert untangle(np.arange(480) / 120, cloud).cloud is cloud


def test_of_orders_that_fit_alike_the_one_that_turns_least_is_taken() -> None:
    cloud = wandering(2, 0.2, 4)
    given = RECTANGLE[[2, 1, 0, 3]]
    order = order_of_places(given, cloud, 3e-3, upright=False)
    np.testing.assert_array_equal(given[order], RECTANGLE)


def test_an_exchange_throughout_is_told_by_how_the_foot_stands(hop: Any, foot_markers: Any) -> None:
    take = exchanged(hop.take, "Foot", [3, 2, 1, 0], 0, len(hop.take))
    points = raw(take, markers=foot_markers)
    assert "in another order than the take's markers" in points.warnings[0]
    assert points.foot.pitch is not None
    assert np.abs(points.foot.pitch - hop.truth.pitch).max() < 4e-3


def test_an_exchange_that_begins_while_a_marker_is_hidden_is_undone(hop: Any) -> None:
    take = exchanged(hop.take, "Foot", [3, 2, 1, 0], 400, 460)
    foot = take.bodies["Foot"]
    measured = foot.measured.copy()
    measured[395:410, 1] = np.nan
    take = replace(take, bodies={**take.bodies, "Foot": replace(foot, measured=measured)})
    points = raw(take)
    assert np.abs(points.foot.position - raw(hop.take).foot.position).max() < 6e-4
    assert "exchanged in 60 samples" in points.warnings[0]


def test_one_visible_marker_in_the_others_slot_does_not_move_t(hop: Any) -> None:
    top = hop.take.bodies["T"]
    measured = top.measured.copy()
    measured[500:505, 0] = measured[500:505, 1]
    measured[500:505, 1] = np.nan
    take = replace(hop.take, bodies={**hop.take.bodies, "T": replace(top, measured=measured)})
    points = raw(take)
    assert np.abs(points.top.position - raw(hop.take).top.position).max() < 1e-3
    assert "'T': markers exchanged in 5 samples" in points.warnings[0]


@pytest.mark.parametrize(
    "slots", [[2, 1, 0, 3], [0, 3, 2, 1], [3, 1, 2, 0], [2, 3, 0, 1], [3, 2, 1, 0], [1, 2, 3, 0]]
)
def test_an_exchange_between_t_and_rotor_is_undone(hop: Any, slots: list[int]) -> None:
    points = raw(exchanged_between(hop.take, slots, 500, 560))
    assert_same_paths(points, raw(hop.take))
    assert points.warnings == (
        "'T' and 'Rotor': markers exchanged in 60 samples (1 stretches, the first at 4.167 s); "
        "undone",
    )


def test_several_exchanges_of_several_bodies_are_undone(hop: Any) -> None:
    take = hop.take
    for start in range(250, 950, 100):
        take = exchanged(take, "Foot", SAME_SHAPE[start // 100 % 3], start, start + 30)
        take = exchanged_between(take, [2, 3, 0, 1], start + 20, start + 45)
    points = raw(take)
    assert_same_paths(points, raw(hop.take))
    assert "in 210 samples (7 stretches" in points.warnings[0]
    assert "in 175 samples (7 stretches" in points.warnings[1]


@pytest.mark.parametrize("kind", ["row 1.0", "row 1.1", "motive 1.23", "motive 1.25"])
def test_exchanges_in_a_file_are_undone(hop: Any, tmp_path: Path, kind: str) -> None:
    flavour, version = kind.split()
    take = exchanged(hop.take, "Foot", [3, 2, 1, 0], 400, 460)
    take = exchanged_between(take, [2, 1, 0, 3], 500, 560)
    write = write_row if flavour == "row" else write_motive
    write(take, tmp_path / "x.csv", version)  # type: ignore[arg-type]
    points = raw(read_take(tmp_path / "x.csv"))
    assert_same_paths(points, raw(hop.take), 2e-6)
    assert len(points.warnings) == 2


def test_strays_beside_an_exchange_do_not_turn_the_rest_round(hop: Any, foot_markers: Any) -> None:
    take = exchanged(hop.take, "Foot", [3, 2, 1, 0], 400, 460)
    foot = take.bodies["Foot"]
    measured = foot.measured.copy()
    for at in (400, 459, 460):
        measured[at, 2] += [0.1, 0.2, -0.1]
    take = replace(take, bodies={**take.bodies, "Foot": replace(foot, measured=measured)})
    points = raw(take, markers=foot_markers)
    assert points.foot.pitch is not None
    good = np.delete(np.arange(len(take)), [400, 459, 460])
    assert np.abs(points.foot.pitch - hop.truth.pitch)[good].max() < 4e-3


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    noise=st.floats(0, 4e-3),
    turn=st.floats(-6, 6),
    gaps=st.integers(0, 12),
)
def test_a_good_take_comes_back_untouched(seed: int, noise: float, turn: float, gaps: int) -> None:
    cloud, rng = wandering(4, turn, seed, noise), np.random.default_rng(seed)
    for _ in range(gaps):
        start, length = rng.integers(len(cloud)), rng.integers(1, 80)
        cloud[start : start + length, rng.permutation(4)[: rng.integers(1, 5)]] = np.nan
    told = untangle(np.arange(len(cloud)) / 120, cloud)
    assert told.cloud is cloud
    assert not told.exchanged.any()


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), noise=st.floats(1e-5, 1e-3))
def test_t_and_rotor_with_gaps_come_back_untouched(seed: int, noise: float) -> None:
    rng, times = np.random.default_rng(seed), np.arange(600) / 120
    speed, phase = rng.uniform(5, 25), rng.uniform(0, 6)
    top = np.column_stack([0.02 * np.sin(speed * times), 0 * times, 0.01 * np.cos(speed * times)])
    angle = speed * times + phase
    rotor = top + 0.035 * np.column_stack([np.cos(angle), 0 * times, -np.sin(angle)])
    sides = np.array([[0, 0.02, 0], [0, -0.02, 0]])
    cloud = np.concatenate([top[:, None] + sides, rotor[:, None] + sides * 0.5], axis=1)
    cloud += rng.normal(0, noise, cloud.shape)
    for _ in range(10):
        start = rng.integers(len(cloud))
        cloud[start : start + rng.integers(1, 60), rng.integers(4)] = np.nan
    for part, partly in ((cloud[:, :2], True), (cloud[:, 2:], True), (cloud, False)):
        assert untangle(times, part, partly=partly).cloud is part


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), turn=st.floats(-6, 6))
def test_any_exchange_in_a_noisy_take_is_undone(seed: int, turn: float) -> None:
    cloud, rng = wandering(4, turn, seed, 1e-3), np.random.default_rng(seed)
    mixed = cloud.copy()
    start = rng.integers(1, 300)
    stop = start + rng.integers(1, 180)
    mixed[start:stop] = mixed[start:stop][:, rng.permutation(4)]
    np.testing.assert_array_equal(untangle(np.arange(480) / 120, mixed).cloud, cloud)


@pytest.mark.parametrize("start", range(8, 14))
def test_an_exchange_is_found_wherever_it_starts(start: int) -> None:
    times = np.arange(40) / 120.0
    right = RECTANGLE + np.linspace(0, 0.1, 40)[:, None, None]
    cloud = right.copy()
    cloud[start : start + 4] = cloud[start : start + 4][:, SAME_SHAPE[0]]
    found = untangle(times, cloud)
    np.testing.assert_array_equal(found.cloud, right)
    assert np.flatnonzero(found.exchanged).tolist() == [start, start + 1, start + 2, start + 3]
