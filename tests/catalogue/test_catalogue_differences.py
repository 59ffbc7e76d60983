"""Only what differs is told, by its path, with its unit."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import pytest

from tests.bundles import NOW, make_bundle, note, remarked
from workbench.bundle import Bundle
from workbench.catalogue import ABSENT, differences


@pytest.fixture
def first(tmp_path: Path) -> Bundle:
    return make_bundle(tmp_path)


def second(tmp_path: Path, **facts: object) -> Bundle:
    return make_bundle(tmp_path, "hop-b", NOW + timedelta(1), **facts)


def told(a: Bundle, b: Bundle) -> list[tuple[object, ...]]:
    return [(d.section, d.path, d.a, d.b, d.unit) for d in differences(a, b)]


def test_a_run_repeated_from_the_same_inputs_differs_in_nothing(
    first: Bundle, tmp_path: Path
) -> None:
    assert told(first, second(tmp_path)) == []


def test_numbers_words_and_results_differ_with_their_units(first: Bundle, tmp_path: Path) -> None:
    other = second(
        tmp_path, voltage_V=4.98, mode="clamped", versions={"workbench": "0.2.0"},
        twin={"distance_m": 0.25, "hop_height_m": 0.018, "speed_rad_s": 16.9}, status="failed",
    )  # fmt: skip
    assert told(first, remarked(other)) == [
        ("asked", "mode", "hop", "clamped", ""),
        ("asked", "voltage_V", 4.52, 4.98, "V"),
        ("software", "workbench", "0.1.0", "0.2.0", ""),
        ("results", "status", "complete", "failed", ""),
        ("results", "twin.distance_m", 0.248, 0.25, "m"),
        ("remarks", "verdict", "none", "good", ""),
        ("remarks", "tags", ABSENT, "paper", ""),
    ]


def test_nested_keys_are_paths_and_named_things_go_by_their_names(
    first: Bundle, tmp_path: Path
) -> None:
    other = second(tmp_path)
    first.write_document("model", "effects: [{name: tether, parameters: {force: 0.1}}]\n")
    other.write_document(
        "model", "effects: [{name: slope, x: 1}, {name: tether, parameters: {force: 0.2}}]\n"
    )
    other.write_document("shape", "name: shape\nangles: [0.1, 0.25]\n")
    other.write_resolved("protocol", {"title": "Hop", "steps": [{"run": {"speed": 18.0}}]})
    assert told(first, other) == [
        ("protocol", "steps[0].run.speed", 17.0, 18.0, ""),
        ("model", "effects[tether].parameters.force", 0.1, 0.2, ""),
        ("model", "effects[slope].name", ABSENT, "slope", ""),
        ("model", "effects[slope].x", ABSENT, 1, ""),
        ("shape", "angles[1]", 0.2, 0.25, ""),
    ]


def test_null_is_no_value_and_what_is_no_number_equals_itself(
    first: Bundle, tmp_path: Path
) -> None:
    note(first, pull_N=None, error_mm=float("nan"))
    other = second(tmp_path, error_mm=float("nan"))
    assert told(first, other) == []
    note(other, pull_N=0.39)
    assert told(first, other) == [("asked", "pull_N", ABSENT, 0.39, "N")]


def test_a_file_that_cannot_be_read_is_a_difference(first: Bundle, tmp_path: Path) -> None:
    other = second(tmp_path)
    other.write_document("model", "a: [")
    found = differences(first, other)
    assert {d.section for d in found} == {"model"}
    assert any(str(d.b).startswith("cannot be read: ") for d in found)


def test_json_leaves_out_the_side_that_has_none(first: Bundle, tmp_path: Path) -> None:
    other = second(tmp_path)
    note(other, pull_N=0.39)
    (only,) = differences(first, other)
    assert only.as_json() == {"section": "asked", "path": "pull_N", "b": 0.39, "unit": "N"}


def test_a_file_of_a_bundle_that_holds_too_much_is_told_and_not_expanded(
    first: Bundle, tmp_path: Path
) -> None:
    other = second(tmp_path)
    lines = ["a0: &a0 [x,x,x,x,x,x,x,x,x]"]
    lines += [f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 9)]
    other.write_document("model", "\n".join(lines) + "\n")
    (found,) = [d for d in differences(first, other) if d.path == "file"]
    assert "more than 15000 values up to here" in str(found.b)
