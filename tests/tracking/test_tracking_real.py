"""The numbers of three measured exports, computed elsewhere by separately written code."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench.tracking import Take, quality, read_take
from workbench.tracking.body_position import locate_body
from workbench.tracking.identity import untangle
from workbench.tracking.missing import gaps
from workbench.tracking.take import known

A = "a_rowformat_v1.1_rigidbody.csv"
B = "b_motive_1.21_quality_unlabeled.csv"
C = "c_motive_1.23_three_bodies_gaps.csv"


@pytest.fixture(scope="module")
def expected(real_exports: Path) -> dict[str, Any]:
    return json.loads((real_exports / "expected_numbers.json").read_text())


@pytest.fixture(scope="module")
def takes(real_exports: Path) -> dict[str, Take]:
    return {name: read_take(real_exports / name) for name in (A, B, C)}


@pytest.mark.parametrize("name", [A, B, C])
def test_the_quality_report_has_the_known_numbers(
    name: str, takes: dict[str, Take], expected: dict[str, Any]
) -> None:
    report, told = quality(takes[name]), expected[name]
    assert report["format"] == told["flavour"]
    assert report["version"] == told["version"]
    assert report["frames"] == told["frames"]
    assert report["rate_hz"] == told.get("rate", 120.0)
    assert report["first_time_s"] == pytest.approx(told["first_time"], abs=1e-9)
    assert report["last_time_s"] == pytest.approx(told["last_time"], abs=1e-9)
    assert report["warnings"] == []
    assert list(report["bodies"]) == list(told["bodies"])
    for body, numbers in told["bodies"].items():
        mean = numbers.get("mean_position", numbers.get("mean_model_centroid_tracked"))
        found = report["bodies"][body]
        assert [found[key] for key in ("missing", "gaps", "longest_gap")] == [
            numbers[key] for key in ("missing", "gaps", "longest_gap")
        ]
        assert [round(x, 7) for x in found["mean_position_m"]] == mean


@pytest.mark.parametrize("name", [A, B, C])
def test_the_bytes_and_the_indices_are_the_known_ones(
    name: str, takes: dict[str, Take], expected: dict[str, Any]
) -> None:
    take, told = takes[name], expected[name]
    assert take.sha256 == told["sha256_uncompressed"]
    assert (take.indices[0], take.indices[-1]) == (told["first_index"], told["last_index"])
    assert set(np.diff(take.indices)) == {1}


def test_row_format_gives_visible_markers_and_nan_rows(
    takes: dict[str, Take], expected: dict[str, Any]
) -> None:
    take, told = takes[A], expected[A]
    (body,) = take.bodies.values()
    visible = known(body.measured).sum(axis=1) + known(take.cloud.position).sum(axis=1)
    assert {str(k): v for k, v in Counter(visible.tolist()).items()} == told[
        "visible_markers_histogram"
    ]
    nan_rows = (~known(body.measured)).sum(axis=0).tolist()
    assert nan_rows == told["bodies"][body.name]["cloud_marker_nan_rows"]
    loose = set(take.cloud.names.flat) - {""}
    assert len(loose) + len(body.marker_names) == told["distinct_marker_names"]


def test_row_format_gives_poses_and_the_first_centroid(
    takes: dict[str, Take], expected: dict[str, Any]
) -> None:
    (body,) = takes[A].bodies.values()
    told = expected[A]["bodies"][body.name]
    mean = np.mean(body.position[body.seen], axis=0)
    assert mean.round(7).tolist() == told["mean_pose_position_tracked"]
    assert body.centroid_solved[0].round(7).tolist() == told["first_row_model_centroid"]


def test_every_marker_of_the_motive_file_has_the_known_numbers(
    takes: dict[str, Take], expected: dict[str, Any]
) -> None:
    take = takes[B]
    paths: dict[str, np.ndarray] = {}
    for body in take.bodies.values():
        for k in range(3):
            paths[f"Rigid Body Marker|{body.name}_{k + 1}"] = body.solved[:, k]
            paths[f"Marker|{body.name}:Marker{k + 1}"] = body.measured[:, k]
    for k in range(take.cloud.position.shape[1]):
        paths[f"Marker|{take.cloud.names[0, k]}"] = take.cloud.position[:, k]
    assert paths.keys() == expected[B]["markers"].keys()
    for name, told in expected[B]["markers"].items():
        seen = known(paths[name])
        count, longest = gaps(seen)
        assert (int((~seen).sum()), count, longest) == (
            told["missing"],
            told["gaps"],
            told["longest_gap"],
        )
        if told["mean_position"] is not None:
            assert paths[name][seen].mean(axis=0).round(7).tolist() == told["mean_position"]


def test_the_point_of_the_row_file_does_not_jump_when_markers_drop_out(
    takes: dict[str, Take],
) -> None:
    take = takes[A]
    (body,) = take.bodies.values()  # markers 4 and 5 are visible half of the time each
    told = locate_body(body.name, take.times, untangle(take.times, body.measured).cloud, None)
    assert told is not None
    assert known(told.position)[body.seen].all()
    turn = Rotation.from_quat(body.quaternion[body.seen], scalar_first=True).inv()

    def wander(points: np.ndarray) -> float:
        """Return how far points get from their usual place in the tracker's own pose [m]."""
        local = turn.apply((points - body.position)[body.seen])
        return float(np.linalg.norm(local - np.median(local, axis=0), axis=1).max())

    centroid = np.ma.masked_invalid(body.measured).mean(axis=1).filled(np.nan)
    assert wander(centroid) > 10e-3
    assert wander(told.position) < 1.5e-3
    assert told.strays.sum() == 0


def test_the_quaternion_turns_the_definition_into_the_model_markers(
    takes: dict[str, Take], real_exports: Path
) -> None:
    line = next(
        text
        for text in (real_exports / A).read_text().splitlines()
        if text.startswith("rigidbody,")
    )
    definition = np.array(line.split(",")[4:], dtype=float).reshape(-1, 3)
    (body,) = takes[A].bodies.values()
    turn = Rotation.from_quat(body.quaternion[0], scalar_first=True)
    model = turn.apply(definition) + body.position[0]
    # the order of the markers is not the definition's, and one of the five sits elsewhere
    apart = np.linalg.norm(model[:, None] - body.solved[0][None], axis=2).min(axis=1)
    assert np.sort(apart)[3] < 2e-3
