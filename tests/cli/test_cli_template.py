"""`workbench template` as people and scripts use it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conftest import Command

STRIP = ("thesis-initial", "--thickness", "2 mm")


def test_the_short_form_draws_and_tells_files_pages_and_paper(
    workbench: Command, tmp_path: Path
) -> None:
    answer = workbench("template", *STRIP, "--format", "pdf,svg,dxf", "--out", tmp_path, "--json")
    assert answer.code == 0, answer.err
    assert answer.json["paper"] == "A4"
    assert answer.json["pages"] == 3
    assert [Path(path).suffix for path in answer.json["files"]] == [".pdf", ".svg", ".dxf"]
    assert all(Path(path).is_file() for path in answer.json["files"])
    assert answer.json["thickness_mm"] == pytest.approx(2)


def test_options_may_stand_before_the_shape(workbench: Command, tmp_path: Path) -> None:
    answer = workbench("template", "--paper", "A3", "--mirror", "--out", tmp_path, "--json", *STRIP)
    assert answer.code == 0, answer.err
    assert answer.json["pages"] == 1
    assert "A3-mirrored" in answer.json["files"][0]


def test_people_are_told_pages_and_files(workbench: Command, tmp_path: Path) -> None:
    answer = workbench("template", "draw", *STRIP, "--paper", "A3", "--out", tmp_path)
    assert answer.code == 0
    assert "1 of A3" in answer.out
    assert "615.01 mm long" in answer.out


def test_a_standing_robot_s_shape_is_freed_by_the_model_named(
    workbench: Command, root: Path, tmp_path: Path
) -> None:
    text = (root / "models" / "thesis-initial.yaml").read_text("utf-8")
    file = tmp_path / "standing.yaml"
    file.write_text(
        text.replace("state: unloaded", "state: loaded\nthickness: 2 mm"), encoding="utf-8"
    )
    answer = workbench("template", file, "--out", tmp_path, "--json")
    assert answer.code == 0, answer.err
    assert answer.json["freed_by_model"] == "thesis"
    record = json.loads(Path(answer.json["files"][0]).with_suffix(".json").read_text("utf-8"))
    assert record["model"] == "thesis"
    assert record["angles_rad"][12] != pytest.approx(0.399, abs=0.005)


def test_a_print_is_confirmed_compensated_or_refused(workbench: Command, tmp_path: Path) -> None:
    drawn = workbench("template", *STRIP, "--paper", "A3", "--out", tmp_path, "--json")
    (pdf,) = drawn.json["files"]
    again = workbench("template", "confirm", pdf, "--h", 99.6, "--v", 100.1, "--json")
    assert again.code == 0, again.err
    assert again.json["verdict"] == "compensated"
    assert Path(again.json["files"][0]).is_file()
    told = workbench("template", "confirm", pdf, "--h", 99.6, "--v", 100.1)
    assert "this print does not count" in told.out
    assert "confirm that one" in told.out
    (compensated,) = again.json["files"]
    good = workbench("template", "confirm", compensated, "--h", 100, "--v", 100)
    assert good.code == 0
    assert "confirmed, the print is at 1:1" in good.out
    refused = workbench("template", "confirm", pdf, "--h", 97, "--v", 97)
    assert refused.code == 1
    assert "do not bend against this print" in refused.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("thesis-initial",), "the strip's thickness is unknown and is never guessed"),
        (("thesis-initial", "--thickness", "2"), "--thickness: 2 has no unit"),
        (("thesis-initial", "--thickness", "-2 mm"), "--thickness: -2 mm is not possible"),
        ((*STRIP, "--paper", "Leter"), "unknown paper 'Leter'; did you mean 'Letter'?"),
        ((*STRIP, "--paper", "roll", "--roll-width", "15 cm"), "150 mm is too small"),
        ((*STRIP, "--format", "pdf,dfx"), "unknown format 'dfx'; there is pdf, svg, dxf"),
        (("thesis-initail", "--thickness", "2 mm"), "did you mean 'thesis-initial'?"),
    ],
)
def test_bad_input_ends_with_2_and_says_what_to_do(
    workbench: Command, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    answer = workbench("template", *words, "--out", tmp_path / "out")
    assert answer.code == 2
    assert message in answer.err
    assert not (tmp_path / "out").exists()
