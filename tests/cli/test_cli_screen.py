"""What a technician sees: commands on a real terminal of 80 columns, the screen read back."""

from __future__ import annotations

import sys
from io import StringIO
from pathlib import Path

import pytest

if sys.platform == "win32":
    pytest.skip("needs a pseudo terminal", allow_module_level=True)

from tests.bundles import make_bundle
from tests.screen import Screen, shown_on_a_terminal
from workbench.cli.console import stderr

SWEEP = """\
schema: workbench/protocol-1
title: Two clamped speeds
steps:
  - sweep:
      mode: clamped
      speeds: [14 rad/s, 17 rad/s]
      rest: 1 s
      duration: 2.5 s
      before: [Wait until the beam is still.]
"""
TEN = """\
schema: workbench/protocol-1
title: Ten hops
steps:
  - prompt: Clean the plate.
  - sweep:
      mode: hop
      speeds: {from: 16 rad/s, to: 20.5 rad/s, step: 0.5 rad/s}
      before: [Stand the robot on the start line.]
"""


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Screen:
    folder = tmp_path_factory.mktemp("swept")
    (folder / "pair.yaml").write_text(SWEEP, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("workbench.report.comparison_set.write_views", lambda bundle: None)
        return shown_on_a_terminal(patch, "run", "pair.yaml")


def _is_progress(line: str) -> bool:
    return line.startswith("  ") and ("run " in line or "views" in line)


def test_no_result_is_on_a_line_of_progress_and_none_is_followed_by_one(swept: Screen) -> None:
    assert swept.code == 0
    for title in ("Two clamped speeds", "bundle:    runs/", "all runs:  workbench review pair"):
        assert any(line.startswith(title) for line in swept.lines), swept.text
    last = max(k for k, line in enumerate(swept.lines) if _is_progress(line))
    results = [k for k, line in enumerate(swept.lines) if line.startswith("recording:")]
    assert last < results[-1], "the words of the last stage are above its result"
    assert sum("views" in line for line in swept.lines) == 2, "each stage once"
    assert not any("left" in line or "━━ " in line for line in swept.lines if _is_progress(line))


def test_a_clamped_run_is_summed_up_by_what_t_does(swept: Screen) -> None:
    for words in (
        "amplitude of T [mm]",
        "frequency of T [Hz]",
        "phase of T behind the rotor [deg]",
    ):
        assert swept.text.count(words) == 2
    assert "distance" not in swept.text
    assert "hop height" not in swept.text


def test_a_sweep_ends_with_a_row_a_run(swept: Screen) -> None:
    table = swept.text.rpartition("Two clamped speeds: amplitude of T of robot and twin")[2]
    assert "clamped-14.00" in table
    assert "clamped-16.99" in table
    assert table.count(" mm │") == 4, "amplitudes of robot and twin, with their unit"


def test_a_dry_run_of_ten_runs_fits_one_screen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "ten.yaml").write_text(TEN, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    shown = shown_on_a_terminal(monkeypatch, "run", "ten.yaml", "--dry-run")
    assert shown.code == 0
    assert 24 <= len(shown.lines) <= 40, shown.text
    assert "before run 1: Clean the plate." in shown.lines
    assert "before runs 1 to 10: Stand the robot on the start line." in shown.lines
    assert "register" not in shown.text.replace("--registers", "")


def test_a_list_is_folded_and_what_is_cut_is_marked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_bundle(tmp_path / "runs", "clamped-14.00", title="Hop " + "very " * 20 + "far")
    monkeypatch.chdir(tmp_path)
    shown = shown_on_a_terminal(monkeypatch, "runs", "list")
    assert [line.split() for line in shown.lines[:3]] == [
        ["#", "bundle", "mode", "speed", "real", "twin", "error"],
        ["[rad/s]", "[mm]"],
        ["status", "verdict", "title"],
    ]
    assert shown.lines[3].split()[3:] == ["16.99", "0.213", "m", "0.248", "m", "16.9"]
    assert shown.lines[4].split()[:2] == ["complete", "Hop"]
    assert shown.lines[4].endswith("…")
    assert len(shown.lines[4]) == 80
    wide = shown_on_a_terminal(monkeypatch, "runs", "list", columns=240)
    assert len(wide.lines) == 2
    assert wide.lines[1].endswith("very far")


def test_numbers_of_a_run_have_units_and_sensible_digits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_bundle(tmp_path / "runs", error_mm=16.943711683850598)
    monkeypatch.chdir(tmp_path)
    shown = shown_on_a_terminal(monkeypatch, "runs", "show", "1").text
    assert "16.94 mm" in shown
    assert "16.9437" not in shown
    assert "None" not in shown
    assert "error_mm" not in shown


def test_a_sentence_is_broken_between_words_on_a_terminal_alone() -> None:
    words = "SET: held foot: nothing is missing; drive: speed_scale, speed_offset may be there"
    for terminal, lines in ((True, 3), (False, 1)):
        paper = StringIO()
        console = type(stderr)(file=paper, force_terminal=terminal, width=40, soft_wrap=True)
        console.sentence(words)
        seen = paper.getvalue().splitlines()
        assert " ".join(line.strip() for line in seen) == words
        assert len(seen) == lines
        assert all(line.startswith("  ") for line in seen[1:])
