"""What a run is expected to come to: ranges that are read, and results that pass or fail."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from tests.bundles import asked_for
from tests.conftest import Command
from workbench.bundle import Compared, Driven, Manifest, judgements, passed
from workbench.schemas.expect import Expectation

READ = TypeAdapter(Expectation)
PROTOCOL = """\
schema: workbench/protocol-1
title: Short hop
model: thesis
shape: thesis-initial
steps:
  - run:
      {{mode: {mode}, {drive}, rest: 1 s, duration: 2 s,
       expect: {{{expect}}}}}
"""


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("100 mm +- 10 %", 0.09, 0.11),
        ("10 cm ± 5 mm", 0.095, 0.105),
        ("-20 mm +/- 50 %", -0.03, -0.01),
        ("below 3 mm", None, 0.003),
        ("above 0.1 m", 0.1, None),
        ("80 mm to 0.12 m", 0.08, 0.12),
    ],
)
def test_a_range_is_read_in_each_of_its_forms(
    text: str, low: float | None, high: float | None
) -> None:
    found = READ.validate_python({"distance": text}).ranges()["distance_m"]
    assert found == pytest.approx((low, high)) if None not in (low, high) else (low, high)


def test_ranges_are_in_the_units_of_their_results() -> None:
    given = {"ring": "2 Hz +- 5 %", "twin_error": "below 3 mm", "damping_ratio": "0.3 % to 0.5 %"}
    found = READ.validate_python(given).ranges()
    assert found["ring_hz"] == pytest.approx((1.9, 2.1))
    assert found["error_mm"] == (None, pytest.approx(3.0))
    assert found["damping_ratio"] == pytest.approx((0.003, 0.005))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (
            {"distance": "under 3 mm"},
            "'under 3 mm' is no range; write '100 mm +- 10 %', 'below 100",
        ),
        ({"distance": "3 mm"}, "'3 mm' is no range"),
        ({"distance": 3}, "3 is no range"),
        ({"distance": "3 mm +- 0 %"}, "is a single value; write a range above 0 after +-"),
        ({"distance": "3 mm to 2 mm"}, "goes from the greater to the smaller value"),
        ({"distance": "3 N to 4 N"}, "unknown unit 'N' in '3 N'"),
        ({"damping_ratio": "0.5 to 0.6"}, "'0.5' is no share; write for example '0.5 %'"),
    ],
)
def test_what_is_no_range_is_refused_with_the_forms(given: dict[str, Any], told: str) -> None:
    with pytest.raises(ValidationError) as error:
        READ.validate_python(given)
    assert told in str(error.value)


def manifest(expect: dict[str, Any], distance: float = 0.1) -> Manifest:
    done = Driven(distance_m=distance, hop_height_m=0.02)
    compared = Compared(real=done, twin=done, error_mm=5.0)
    return Manifest(id="run", asked=asked_for(expect=expect), compared=compared)


def test_results_pass_within_their_ranges_and_fail_outside() -> None:
    expect = {"distance_m": (0.09, 0.11), "error_mm": (None, 4.0), "speed_rad_s": (16.0, 18.0)}
    found = judgements(manifest(expect))
    assert [one.passed for one in found] == [True, False, False]
    assert found[0].words == ("Distance", "0.100 m", "0.090 to 0.110 m")
    assert found[1].words == ("Error of the twin", "5.0 mm", "at most 4.0 mm")
    assert found[2].words[1] == "not measured"
    assert passed(found) is False
    assert passed(found[:1]) is True


def test_a_run_without_expectations_neither_passes_nor_fails() -> None:
    assert passed(judgements(manifest({}))) is None


def test_a_run_outside_of_what_is_expected_ends_with_1_and_its_page_says_so(
    tmp_path: Path, workbench: Command
) -> None:
    expect = "speed: 14 rad/s +- 1 rad/s, amplitude: above 0.1 mm, twin_error: below 0.01 mm"
    file = tmp_path / "clamped.yaml"
    text = PROTOCOL.format(mode="clamped", drive="speed: 14 rad/s", expect=expect)
    file.write_text(text)
    done = workbench("run", str(file), "--runs", str(tmp_path / "runs"))
    assert done.code == 1
    assert "pass  rotor speed" in done.out
    assert "pass  amplitude of T" in done.out
    assert "FAIL  error of the twin" in done.out
    assert "1 of 1 runs are not as the protocol expects" in done.err
    (page,) = (tmp_path / "runs").glob("*/report.html")
    assert '<span class="FAIL">FAIL</span>' in page.read_text()


def test_what_a_mode_does_not_have_cannot_be_expected_of_it(
    tmp_path: Path, workbench: Command
) -> None:
    file = tmp_path / "decay.yaml"
    file.write_text(PROTOCOL.format(mode="decay", drive="pull: 0.3 N", expect="speed: below 1 Hz"))
    done = workbench("run", str(file), "--dry-run")
    assert done.code == 2
    assert (
        "mode decay has no speed; it has displacement, ring, damping_ratio, twin_error" in done.err
    )
