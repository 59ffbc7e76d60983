"""Points and poses of bodies while markers are hidden, astray or off the body's point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from workbench.errors import InputError
from workbench.tracking import (
    Axes,
    BodyNames,
    RawBody,
    RawPoints,
    SampleStatus,
    Take,
    raw_points,
    read_take,
    write_motive,
    write_row,
)

PLACE = np.array([0.31, -0.22, 0.05])  # of the foot in the room, as in conftest


def raw(take: Take, **options: Any) -> RawPoints:
    return raw_points(take, BodyNames(), Axes(), **options)


def with_measured(
    take: Take, name: str, change: Callable[[NDArray[np.float64]], object], **options: Any
) -> Take:
    """Return the take with one body's measured markers (n, m, 3) changed in place by a function."""
    body = take.bodies[name]
    measured = body.measured.copy()
    change(measured)
    changed = replace(body, measured=measured, **options)
    return replace(take, bodies={**take.bodies, name: changed})


def hidden(take: Take, name: str, marker: int, start: int, stop: int) -> Take:
    def change(measured: NDArray[np.float64]) -> None:
        measured[start:stop, marker] = np.nan

    return with_measured(take, name, change)


def error(body: RawBody, truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance from the truth, (n,) [m]."""
    return np.linalg.norm(body.position - PLACE - truth, axis=1)


def wide_top(take: Take, truth: NDArray[np.float64]) -> Take:
    """Return the take with T's markers 30 mm to either side."""
    noise = np.random.default_rng(3).normal(0, 2e-4, (len(take), 2, 3))
    side = np.array([[0, 0.03, 0], [0, -0.03, 0]])
    cloud = Axes().points_to_export(truth[:, None] + PLACE + side + noise)

    def change(measured: NDArray[np.float64]) -> None:
        measured[:] = cloud

    return with_measured(take, "T", change)


@pytest.mark.parametrize("marker", [0, 1])
def test_t_does_not_jump_when_one_of_its_markers_is_hidden(hop: Any, marker: int) -> None:
    take = hidden(wide_top(hop.take, hop.truth.top), "T", marker, 500, 505)
    top = raw(take).top
    naive = np.nanmean(take.bodies["T"].measured, axis=1)
    jump = Axes().points_to_bench(naive) - PLACE - hop.truth.top
    assert np.linalg.norm(jump[500:505], axis=1).min() > 0.029
    assert error(top, hop.truth.top).max() < 1e-3
    assert np.flatnonzero(top.bridged).tolist() == [500, 501, 502, 503, 504]
    assert (top.missing == SampleStatus.SEEN).all()
    assert "5 samples from some of them (error 0." in top.source


@pytest.mark.parametrize("kind", ["row 1.0", "row 1.1", "motive 1.21", "motive 1.25"])
def test_a_hidden_marker_in_a_file_moves_neither_foot_nor_t(
    hop: Any, tmp_path: Path, kind: str
) -> None:
    flavour, version = kind.split()
    take = hidden(hidden(hop.take, "T", 1, 500, 505), "Foot", 2, 600, 640)
    write = write_row if flavour == "row" else write_motive
    write(take, tmp_path / "x.csv", version)  # type: ignore[arg-type]
    points = raw(read_take(tmp_path / "x.csv"))
    assert error(points.top, hop.truth.top).max() < 1e-3
    step = np.linalg.norm(np.diff(points.foot.position - PLACE - hop.truth.foot, axis=0), axis=1)
    assert step.max() < 1.5e-3  # the naive centroid steps by 54 mm
    assert points.warnings == ()


def test_a_long_loss_of_one_marker_is_carried_on_for_a_tenth_of_a_second(hop: Any) -> None:
    take = hidden(wide_top(hop.take, hop.truth.top), "T", 0, 500, 600)
    top = raw(take).top
    assert np.flatnonzero(top.bridged).tolist() == [*range(500, 512), *range(588, 600)]
    assert (top.missing[512:588] == SampleStatus.BLANK).all()
    assert np.nanmax(error(top, hop.truth.top)) < 1.2e-3


def test_a_body_that_turns_its_markers_fast_is_carried_on_less_far(hop: Any) -> None:
    arm = np.array(
        [0.02 * np.cos(hop.truth.angle), 0 * hop.truth.angle, -0.02 * np.sin(hop.truth.angle)]
    )
    cloud = hop.truth.rotor[:, None] + PLACE + np.stack([arm.T, -arm.T], axis=1)

    def change(measured: NDArray[np.float64]) -> None:
        measured[:] = Axes().points_to_export(cloud)
        measured[600:612, 1] = np.nan

    rotor = raw(with_measured(hop.take, "Rotor", change)).rotor
    assert np.isnan(rotor.position[600:612, 0]).all()  # 1.7 rad between samples that show both
    assert np.nanmax(error(rotor, hop.truth.rotor)) < 1e-6


def test_a_body_that_the_tracker_calls_lost_is_seen_where_a_marker_carries_it(hop: Any) -> None:
    take = hidden(hop.take, "T", 0, 500, 504)
    top = take.bodies["T"]
    missing = top.missing.copy()
    missing[500:504] = SampleStatus.LOST
    take = replace(take, bodies={**take.bodies, "T": replace(top, missing=missing)})
    assert (raw(take).top.missing[498:506] == SampleStatus.SEEN).all()
    assert error(raw(take).top, hop.truth.top).max() < 1e-3


def test_the_foot_keeps_its_point_while_two_of_four_markers_are_hidden(hop: Any) -> None:
    take = hidden(hidden(hop.take, "Foot", 0, 700, 704), "Foot", 3, 700, 704)
    foot = raw(take).foot
    assert foot.bridged[700:704].all()
    # the learned point is the markers' centroid, 12 mm above the foot's centre
    off = foot.position - raw(hop.take).foot.position
    assert np.abs(off[700:704]).max() < 2e-3


def test_a_body_is_learned_though_no_sample_shows_all_its_markers(hop: Any) -> None:
    foot = hop.take.bodies["Foot"]
    fifth = foot.measured[:, :3].mean(axis=1, keepdims=True)
    measured = np.concatenate([foot.measured, fifth], axis=1)
    whole = measured.mean(axis=1)
    measured[::2, 3] = np.nan
    measured[1::2, 4] = np.nan
    five = replace(
        foot,
        measured=measured,
        solved=np.full_like(measured, np.nan),
        marker_names=(*foot.marker_names, "Marker 5"),
    )
    told = raw(replace(hop.take, bodies={**hop.take.bodies, "Foot": five})).foot
    assert np.abs(told.position - Axes().points_to_bench(whole)).max() < 6e-4
    assert told.source.startswith("centroid of the rigid body that the take shows, fitted")


def test_a_marker_that_no_pose_reaches_is_left_out_and_told_of(hop: Any) -> None:
    def change(measured: NDArray[np.float64]) -> None:
        measured[::2, 0] = np.nan  # so that two kinds of samples share two markers only
        measured[1::2, 3] = np.nan

    foot = raw(with_measured(hop.take, "Foot", change)).foot
    assert "rigid body that the take shows (3 of its 4 markers)" in foot.source
    off = foot.position - raw(hop.take).foot.position
    assert np.abs(off - np.median(off, axis=0)).max() < 3e-3


def test_one_marker_astray_is_left_out_and_the_others_place_the_foot(
    hop: Any, foot_markers: Any
) -> None:
    def change(measured: NDArray[np.float64]) -> None:
        measured[300:310, 2] += [0.0, 0.03, 0.04]

    points = raw(with_measured(hop.take, "Foot", change), markers=foot_markers)
    assert error(points.foot, hop.truth.foot).max() < 1e-3
    assert points.warnings == ()


def test_samples_that_fit_no_rigid_body_are_glitches(hop: Any) -> None:
    def change(measured: NDArray[np.float64]) -> None:
        measured[300:304, 2] += [0.0, 0.03, 0.04]
        measured[300:304, 1] -= [0.05, 0.0, 0.02]

    points = raw(with_measured(hop.take, "Foot", change))
    assert np.flatnonzero(points.foot.missing == SampleStatus.GLITCH).tolist() == [
        300,
        301,
        302,
        303,
    ]
    assert np.isnan(points.foot.position[300:304]).all()
    assert points.foot.residual[300:304].min() > 5e-3
    assert points.warnings == (
        "the markers of 'Foot' do not fit the rigid body in 4 samples (misfit above 3.0 mm); "
        "these samples are left out",
    )


def test_the_residual_is_that_of_the_noise(new_hop: Any) -> None:
    points = raw(new_hop(noise_m=3e-4).take)
    # 12 coordinates less 6 of the pose leave the root of a half per axis, times root 3
    usual = 3e-4 * np.sqrt(3 * (12 - 6) / 12)
    assert np.sqrt(np.mean(points.foot.residual**2)) == pytest.approx(usual, rel=0.05)
    assert "median misfit 0.3" in points.foot.source


def test_a_wobbling_marker_counts_less(hop: Any, foot_markers: Any) -> None:
    rng = np.random.default_rng(1)

    def change(measured: NDArray[np.float64]) -> None:
        measured[:, 3] += rng.normal(0, 2e-3, measured[:, 3].shape)

    points = raw(with_measured(hop.take, "Foot", change), markers=foot_markers)
    plain = 2e-3 / 4 * np.sqrt(3)  # the error that a mean of four equal markers would have
    assert np.sqrt(np.mean(error(points.foot, hop.truth.foot) ** 2)) < 0.3 * plain


@pytest.mark.parametrize("order", [(1, 0, 2, 3), (2, 3, 0, 1), (3, 2, 1, 0), (1, 3, 0, 2)])
def test_places_in_another_order_are_put_right(
    hop: Any, foot_markers: Any, order: tuple[int, ...]
) -> None:
    places = [foot_markers["Foot"][i] for i in order]
    points = raw(hop.take, markers={"Foot": places})
    right = ", ".join(str(order.index(i) + 1) for i in range(4))
    assert points.warnings == (
        "the marker places of 'Foot' are in another order than the take's markers; used are the "
        f"places number {right}, in this order",
    )
    assert error(points.foot, hop.truth.foot).max() < 1e-3
    assert points.foot.pitch is not None
    assert np.abs(points.foot.pitch - hop.truth.pitch).max() < 4e-3


def test_offset_along_the_line_of_two_markers_is_taken_off(hop: Any) -> None:
    truth = hop.truth.rotor
    side = np.array([[0, 0.03, 0], [0, 0.01, 0]])

    def change(measured: NDArray[np.float64]) -> None:
        measured[:] = Axes().points_to_export(truth[:, None] + PLACE + side)

    take = with_measured(hop.take, "Rotor", change)
    for places in ([[0, 30, 0], [0, 10, 0]], [[0, 10, 0], [0, 30, 0]]):
        points = raw(take, markers={"Rotor": places})
        assert error(points.rotor, truth).max() < 1e-9
    assert points.warnings == ("markers of 'Rotor': their places fit the other way round; used so",)


def test_offset_across_a_line_in_the_plane_of_motion_is_taken_off(hop: Any) -> None:
    truth, tilt = hop.truth.top, 0.4 * np.sin(hop.truth.angle)
    places = np.array([[15, 0, 12], [-15, 0, 8]])
    turn = Rotation.from_rotvec(np.outer(tilt, [0, 1, 0])).as_matrix()
    cloud = truth[:, None] + PLACE + np.einsum("nij,mj->nmi", turn, places * 1e-3)

    def change(measured: NDArray[np.float64]) -> None:
        measured[:] = Axes().points_to_export(cloud)

    points = raw(with_measured(hop.take, "T", change), markers={"T": places})
    assert error(points.top, truth).max() < 1e-9
    assert points.warnings == ()
    assert "rotation about y assumed" in points.top.source
    assert points.top.pitch is not None
    np.testing.assert_allclose(points.top.pitch, tilt, atol=1e-9)


def test_places_must_be_as_many_as_markers(hop: Any) -> None:
    with pytest.raises(InputError, match="markers of 'T': 3 places are given, the take has 2"):
        raw(hop.take, markers={"T": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]})
