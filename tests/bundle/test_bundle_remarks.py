"""Tags, notes and verdicts live in the bundle, appended and checked."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.bundles import NOW, make_bundle, remarked
from workbench.bundle import Remarks, add_remark, read_remarks, verify


def test_remarks_come_to_the_last_verdict_the_tags_left_and_all_notes(tmp_path: Path) -> None:
    run = remarked(make_bundle(tmp_path)).path
    add_remark(run, "tag", "demo", "Ada", NOW)
    add_remark(run, "untag", "paper", "Ada", NOW)
    add_remark(run, "verdict", "bad", "Emmy", NOW)
    found = read_remarks(run)
    assert (found.verdict, found.tags) == ("bad", ("demo",))
    (note,) = found.notes
    assert (note.who, note.text) == ("Grace", "die Folie löst sich")
    assert note.at.startswith("2026-03-12T10:15:00")
    assert verify(run) == []


def test_a_run_that_nobody_spoke_of_has_no_remarks(tmp_path: Path) -> None:
    assert read_remarks(make_bundle(tmp_path).path) == Remarks()


def test_a_remark_after_a_torn_line_is_kept_and_the_torn_one_told(tmp_path: Path) -> None:
    run = remarked(make_bundle(tmp_path)).path
    path = run / "remarks.jsonl"
    path.write_bytes(path.read_bytes()[:-20])  # the verdict
    add_remark(run, "tag", "after", "Ada", NOW)
    assert read_remarks(run).tags == ("paper", "after")
    assert read_remarks(run).verdict == "none"
    assert verify(run) == ["remarks.jsonl: line 3 was changed or cut short since it was written"]


def test_many_may_speak_at_once(tmp_path: Path) -> None:
    run = make_bundle(tmp_path).path
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda k: add_remark(run, "tag", f"t{k}", "Ada", NOW), range(40)))
    assert sorted(read_remarks(run).tags) == sorted(f"t{k}" for k in range(40))
    assert verify(run) == []
