"""A print is judged by its measured bars."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from tests.template.conftest import MakeSheet
from workbench.errors import InputError, PrintRefused
from workbench.template import confirm_template, pdf_pages, write_template
from workbench.template.record import sheet_of, unchanged_record

TODAY = date(2026, 11, 22)


@pytest.fixture
def shape_file(tmp_path: Path, root: Path) -> Path:
    path = tmp_path / "thesis-initial.yaml"
    path.write_text((root / "models" / "thesis-initial.yaml").read_text("utf-8"), "utf-8")
    return path


@pytest.fixture
def printed(sheet: MakeSheet, tmp_path: Path, shape_file: Path) -> Path:
    (pdf,) = write_template(sheet("A3"), tmp_path / "out", shape_file)
    return pdf


@pytest.mark.parametrize("bars", [(100.0, 100.0), (99.9, 100.1)])
def test_a_print_within_a_tenth_is_confirmed_and_kept(
    printed: Path, bars: tuple[float, float]
) -> None:
    found = confirm_template(printed, *bars, TODAY)
    assert found.measured.verdict == "confirmed"
    assert found.files == ()
    kept = json.loads(found.kept.read_text("utf-8"))
    assert kept["template"] == printed.name
    assert kept["pdf_sha256"] == unchanged_record(printed).pdf_sha256
    assert [(m["horizontal_mm"], m["vertical_mm"]) for m in kept["measured"]] == [bars]


def test_a_print_that_is_a_little_off_is_written_again_compensated(printed: Path) -> None:
    found = confirm_template(printed, 99.6, 100.1, TODAY)
    assert found.measured.verdict == "compensated"
    (again,) = found.files
    assert again.name == "thesis-initial-07eb4c66-A3-h99.60-v100.10.pdf"
    record = unchanged_record(again)
    assert record.compensation_h == pytest.approx(100 / 99.6)
    assert record.compensation_v == pytest.approx(100 / 100.1)
    assert record.day == unchanged_record(printed).day
    second = confirm_template(again, 100.0, 100.0, TODAY)
    assert second.measured.verdict == "confirmed"


def test_compensations_add_up(printed: Path) -> None:
    (once,) = confirm_template(printed, 99.7, 100.0, TODAY).files
    (twice,) = confirm_template(once, 100.2, 100.0, TODAY).files
    assert unchanged_record(twice).compensation_h == pytest.approx(100**2 / 99.7 / 100.2)
    with pytest.raises(PrintRefused, match=r"H measures 99\.7 mm, 99\.40 mm without compensation"):
        confirm_template(once, 99.7, 100.0, TODAY)


@pytest.mark.parametrize(
    ("bars", "axis"), [((99.4, 100.0), "H"), ((100.0, 100.6), "V"), ((97.0, 97.0), "H")]
)
def test_a_print_more_than_half_a_percent_off_is_refused(
    printed: Path, bars: tuple[float, float], axis: str
) -> None:
    before = sorted(printed.parent.iterdir())
    with pytest.raises(
        PrintRefused, match=rf"bar {axis} measures .* more than 0\.5% off .* 100 % \(actual size\)"
    ):
        confirm_template(printed, *bars, TODAY)
    assert sorted(printed.parent.iterdir()) == before


@pytest.mark.parametrize("bars", [(99.5, 100.5), (100.5, 99.5)])
def test_half_a_percent_itself_is_compensated(printed: Path, bars: tuple[float, float]) -> None:
    assert confirm_template(printed, *bars, TODAY).measured.verdict == "compensated"


def test_every_measurement_is_kept(printed: Path) -> None:
    for bars in ((99.6, 100.1), (100.0, 100.0)):
        kept = confirm_template(printed, *bars, TODAY).kept
    measured = json.loads(kept.read_text("utf-8"))["measured"]
    assert [m["verdict"] for m in measured] == ["compensated", "confirmed"]


def test_a_record_tells_enough_to_draw_the_same_bytes(printed: Path) -> None:
    assert pdf_pages(sheet_of(unchanged_record(printed))) == printed.read_bytes()


def test_a_template_that_was_changed_since_is_refused(printed: Path) -> None:
    printed.write_bytes(printed.read_bytes() + b"\n")
    with pytest.raises(InputError, match=r"was changed since it was drawn on 2026-11-21"):
        confirm_template(printed, 100.0, 100.0, TODAY)


def test_a_shape_that_was_changed_since_is_refused(printed: Path, shape_file: Path) -> None:
    text = shape_file.read_text("utf-8").replace("0.339", "0.329", 1)
    shape_file.write_text(text, "utf-8")
    with pytest.raises(InputError, match=r"thesis-initial\.yaml: was changed since .*A3\.pdf"):
        confirm_template(printed, 100.0, 100.0, TODAY)


def test_a_template_whose_shape_is_gone_can_still_be_confirmed(
    printed: Path, shape_file: Path
) -> None:
    shape_file.unlink()
    assert confirm_template(printed, 100.0, 100.0, TODAY).measured.verdict == "confirmed"


def test_what_is_no_template_is_refused(printed: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no such template; give the PDF that was printed"):
        confirm_template(tmp_path / "none.pdf", 100.0, 100.0, TODAY)
    drawing = printed.with_suffix(".svg")
    drawing.write_text("<svg/>", "utf-8")
    with pytest.raises(InputError, match=r"A3\.svg: no such template; give the PDF"):
        confirm_template(drawing, 100.0, 100.0, TODAY)
    other = tmp_path / "other.pdf"
    other.write_bytes(printed.read_bytes())
    with pytest.raises(InputError, match=r"its record other\.json is not beside it"):
        confirm_template(other, 100.0, 100.0, TODAY)


def test_a_measured_template_is_never_overwritten(
    printed: Path, sheet: MakeSheet, shape_file: Path
) -> None:
    later = replace(sheet("A3"), day=TODAY)
    write_template(later, printed.parent, shape_file)  # not yet measured
    write_template(sheet("A3"), printed.parent, shape_file)
    confirm_template(printed, 100.0, 100.0, TODAY)
    write_template(sheet("A3"), printed.parent, shape_file)  # the very same
    with pytest.raises(InputError, match=r"was measured, so it is never overwritten"):
        write_template(later, printed.parent, shape_file)
