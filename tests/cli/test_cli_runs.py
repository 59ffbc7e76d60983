"""`workbench runs`: find, judge, compare, check and export runs."""

from __future__ import annotations

import json
import subprocess
import sys
import zipfile
from datetime import timedelta
from pathlib import Path

import pytest

from tests.bundles import NOW, asked_for, make_bundle, note
from tests.conftest import Command
from workbench.bundle import Bundle, read_remarks


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    root = tmp_path / "runs"
    make_bundle(root, "hop-16.99")
    levels = [[0.0, 4.0, 14.0], [5.0, 5.0, 19.0]]
    make_bundle(root, "clamped-stairs", NOW + timedelta(1), mode="clamped", speed_rad_s=None,
                levels=levels, title="Stairs")  # fmt: skip
    monkeypatch.setenv("WORKBENCH_RUNS", str(root))
    monkeypatch.setenv("WORKBENCH_OPERATOR", "Ada L.")
    return root


def test_a_list_has_a_line_a_run_with_its_number(workbench: Command, runs: Path) -> None:
    head, first, second = workbench("runs", "list").out.splitlines()
    assert head.split()[:4] == ["#", "bundle", "mode", "speed"]
    assert head.split()[-4:] == ["[mm]", "status", "verdict", "title"]
    assert first.split() == ["1", "2026-03-12_101500_hop-16.99", "hop", "16.99", "0.213", "m",
                             "0.248", "m", "16.9", "complete", "Hop", "at", "17",
                             "rad/s"]  # fmt: skip
    assert "14.00 to 19.00" in second


def test_options_and_words_narrow_it_and_say_so(workbench: Command, runs: Path) -> None:
    answer = workbench("runs", "list", "--speed", "18..20", "stairs")
    assert len(answer.out.splitlines()) == 2
    assert answer.err.strip() == "1 of 2 runs"
    answer = workbench("runs", "list", "--limit", "1")
    assert "clamped-stairs" in answer.out
    assert answer.err.startswith("1 more; --limit N shows more")


def test_json_holds_what_it_held_and_what_people_said(workbench: Command, runs: Path) -> None:
    workbench("runs", "tag", "1", "paper", "fig-4")
    workbench("runs", "note", "1", "the tape came loose", "--who", "Grace")
    workbench("runs", "good", "hop")
    found = workbench("runs", "list", "--tag", "fig-4", "--json").json
    assert (found["matching"], found["total"]) == (1, 2)
    (run,) = found["runs"]
    assert run["bundle"] == str(runs / "2026-03-12_101500_hop-16.99")
    assert (run["status"], run["mode"], run["role"], run["number"]) == (
        "complete",
        "hop",
        "train",
        1,
    )
    assert run["real"]["distance_m"] == 0.213
    assert (run["verdict"], run["tags"], run["notes"]) == (
        "good",
        ["paper", "fig-4"],
        ["the tape came loose"],
    )
    (note,) = read_remarks(Path(run["bundle"])).notes
    assert note.who == "Grace"
    assert workbench("runs", "verify", "1", "2").code == 0


def test_a_verdict_and_a_tag_can_be_taken_back(workbench: Command, runs: Path) -> None:
    workbench("runs", "tag", "1", "paper")
    workbench("runs", "bad", "1")
    answer = workbench("runs", "tag", "1", "paper", "--remove")
    assert answer.err.strip() == "2026-03-12_101500_hop-16.99: verdict bad, 0 notes"
    workbench("runs", "bad", "1", "--undo")
    assert len(workbench("runs", "list", "--verdict", "none").out.splitlines()) == 3


def test_what_is_no_tag_note_sort_or_run_is_refused(workbench: Command, runs: Path) -> None:
    for words, told in (
        (("tag", "1", "two words"), "a tag is one word; `workbench runs note` takes text"),
        (("note", "1", " "), "the note is empty"),
        (("list", "--sort", "sped"), "did you mean 'speed'"),
        (("list", "--speed", "fast"), "write 17, 16..18"),
        (("list", "--status", "complet"), "did you mean 'complete'"),
        (("show", "2026"), "holds 2 runs, numbered from 1"),
        (("show", "2026-03"), "fits 2 runs"),
    ):
        answer = workbench("runs", *words)
        assert answer.code == 2, words
        assert told in answer.err


def test_show_takes_a_number_and_tells_the_remarks(workbench: Command, runs: Path) -> None:
    workbench("runs", "note", "1", "slipped", "--who", "Grace")
    shown = workbench("runs", "show", "1").out
    for text in ("distance", "0.248", "note", "slipped (Grace, "):
        assert text in shown
    assert workbench("runs", "show", "1", "--json").json["notes"][0]["text"] == "slipped"


def test_f17_show_prints_the_notes_of_a_run_and_of_many_the_first(
    workbench: Command, tmp_path: Path
) -> None:
    make_bundle(tmp_path, "few", warnings=["'Foot' stood aside"])
    many = make_bundle(
        tmp_path, "many", NOW + timedelta(1), warnings=[f"no {k}" for k in range(30)]
    )
    few = workbench("runs", "show", "few", "--runs", str(tmp_path)).out
    assert "note: 'Foot' stood aside\n" in few
    shown = workbench("runs", "show", str(many.path)).out
    assert "note: no 11\n" in shown
    assert "note: no 12" not in shown
    assert "and 18 more notes; --json has all of them" in shown


def test_f17_a_run_that_failed_shows_its_notes_too(workbench: Command, tmp_path: Path) -> None:
    bundle = Bundle.create(tmp_path, "bad", NOW, asked_for(kind="ingest", title="x"))
    note(
        bundle,
        real={"distance_m": 0.1},
        twin={"distance_m": 0.1},
        error_mm=1.0,
        warnings=["the clock is cut"],
    )
    assert "note: the clock is cut\n" in workbench("runs", "show", str(bundle.path)).out


def test_a_damaged_manifest_is_listed_shown_and_named(workbench: Command, runs: Path) -> None:
    manifest = runs / "2026-03-12_101500_hop-16.99" / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"role": "train"', '"role": train"'))
    (line,) = workbench("runs", "list", "--status", "damaged").out.splitlines()[1:]
    assert "manifest.json: damaged: Expecting value" in line
    shown = workbench("runs", "show", "1")
    assert shown.code == 0
    assert "damaged: manifest.json" in shown.err
    assert "0.248" in shown.out
    answer = workbench("runs", "verify", "1", "--json")
    assert answer.code == 1
    assert answer.json["problems"] == {
        manifest.parent.name: ["manifest.json: changed since the run was finished"]
    }


def test_diff_tells_what_differs_by_section(workbench: Command, runs: Path) -> None:
    shown = workbench("runs", "diff", "1", "2").out
    assert shown.startswith("a  2026-03-12_101500_hop-16.99\nb  2026-03-13_101500_clamped-stairs\n")
    assert "levels[1][2]         (absent)         19" in shown
    assert "distance" not in shown
    found = workbench("runs", "diff", "1", "2", "--json").json["differences"]
    assert {"section": "asked", "path": "mode", "a": "hop", "b": "clamped", "unit": None} in found
    assert workbench("runs", "diff", "1", "1").err.strip() == "nothing differs"


@pytest.mark.skipif(sys.platform == "win32", reason="needs symbolic links")
def test_export_tells_what_it_left_out_and_fails(
    workbench: Command, runs: Path, tmp_path: Path
) -> None:
    (run,) = runs.glob("*hop*")
    (run / "take" / "x.csv").symlink_to("/etc/passwd")
    answer = workbench("runs", "export", "1", "--to", tmp_path / "b.zip")
    assert answer.code == 1
    assert f"left out: {run.name}/take/x.csv" in answer.err
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        assert not [name for name in archive.namelist() if name.endswith("x.csv")]
    again = workbench("runs", "export", "1", "--to", tmp_path / "c.zip", "--json")
    assert (again.code, again.json["left_out"]) == (1, [f"{run.name}/take/x.csv"])


def test_export_packs_and_refuses_to_overwrite(
    workbench: Command, runs: Path, tmp_path: Path
) -> None:
    target = tmp_path / "for-ada.zip"
    answer = workbench("runs", "export", "1", "2", "--to", target, "--csv", "--json")
    assert answer.json["problems"] == []
    with zipfile.ZipFile(target) as archive:
        assert "csv/2026-03-12_101500_hop-16.99/measured.csv" in archive.namelist()
        assert len(archive.namelist()) == answer.json["files"] + 1  # the checksums of all
    assert workbench("runs", "export", "1", "--to", target).code == 2


def test_rebuild_counts_the_runs(workbench: Command, runs: Path) -> None:
    assert workbench("runs", "rebuild").err.strip() == f"2 runs in {runs}"


HEAVY = ("mujoco", "rerun", "pyarrow", "numpy", "scipy", "pandas", "matplotlib", "numba", "ruamel")


def test_a_list_loads_no_library_that_it_does_not_need(runs: Path) -> None:
    text = (
        "import atexit, sys, json\n"
        f"atexit.register(lambda: print(json.dumps([m for m in {HEAVY!r} if m in sys.modules])))\n"
        "sys.argv = ['workbench', 'runs', 'list']\n"
        "from workbench.cli import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout.splitlines()[-1]) == []
    assert "hop-16.99" in done.stdout
