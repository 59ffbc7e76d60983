"""The index is a cache of what lies on disk: it finds what is there, and is never believed more."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from tests.bundles import NOW, make_bundle, note, remarked
from workbench.bundle import add_remark
from workbench.catalogue import NumberRange, Query, period, rebuild, search, window
from workbench.catalogue.entry import COLUMNS
from workbench.catalogue.index import _STAMPED, _VERSION, INDEX, _opened
from workbench.errors import InputError


def silent(text: str) -> None:
    raise AssertionError(text)


def names(root: Path, **asked: Any) -> list[str]:
    """The short names of what is found."""
    found = search(root, Query(**asked), silent)
    return [entry.name.split("_", 2)[2] for entry in found.entries]


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five runs over two years, told apart by everything that can be asked."""
    root = tmp_path_factory.mktemp("lab") / "runs"
    day = timedelta(days=1)
    make_bundle(root, "a", NOW - 400 * day, speed_rad_s=16.51, operator="Grace", shape="bent-1")
    remarked(make_bundle(root, "b", NOW, title="Tape 100%_loose"))
    make_bundle(root, "c", NOW + day, speed_rad_s=19.0, status="failed", model="april")
    levels = [[0.0, 4.0, 14.0], [5.0, 5.0, 18.0]]
    make_bundle(root, "d", NOW + 20 * day, mode="clamped", speed_rad_s=None, levels=levels)
    answers = {"operator": {"value": "Emmy", "unit": None}}
    make_bundle(root, "e", NOW + 90 * day, mode="decay", speed_rad_s=None,
                real={"displacement_m": 0.02}, answers=answers, error_mm=float("nan"))  # fmt: skip
    return root


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ({}, "abcde"),
        ({"speed": window("17")}, "abd"),
        ({"speed": window("17.0")}, "bd"),
        ({"speed": window("18.5..")}, "c"),
        ({"speed": window("..16.7")}, "ad"),
        ({"mode": "clamped"}, "d"),
        ({"status": "failed"}, "c"),
        ({"verdict": "good"}, "b"),
        ({"verdict": "none"}, "acde"),
        ({"verdict": "bad"}, ""),
        ({"shape": "BENT"}, "a"),
        ({"model": "april"}, "c"),
        ({"operator": "grace"}, "a"),
        ({"operator": "emmy"}, "e"),
        ({"tags": ("paper",)}, "b"),
        ({"tags": ("pape",)}, ""),
        ({"tags": ("paper", "demo")}, ""),
        ({"since": "2026-03"}, "bcde"),
        ({"since": "2026-03-13"}, "cde"),
        ({"until": "2026-03"}, "abc"),
        ({"until": "2026-03-12", "since": "2026"}, "b"),
        ({"words": ("folie", "tape")}, "b"),
        ({"words": ("100%_",)}, "b"),
        ({"words": ("%",)}, "b"),
        ({"words": ("hop", "folie", "grace")}, ""),
        ({"sort": "speed"}, "eabdc"),
        ({"sort": "error", "limit": 2}, "cd"),
        ({"limit": 2}, "de"),
    ],
)
def test_each_question_finds_its_runs(lab: Path, asked: dict[str, Any], found: str) -> None:
    assert names(lab, **asked) == list(found)


def test_a_list_counts_what_it_leaves_out_and_numbers_all_by_age(lab: Path) -> None:
    found = search(lab, Query(mode="hop", limit=1), silent)
    assert (found.matching, found.total, found.numbers) == (3, 5, (3,))


def test_a_word_that_no_run_has_is_answered_with_those_there_are(lab: Path) -> None:
    words = "no run has the mode 'hopp'; there are clamped, decay, hop; did you mean 'hop'"
    with pytest.raises(InputError, match=words):
        search(lab, Query(mode="hopp"), silent)


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [("17", 16.5, 17.5), ("17.0 rad/s", 16.95, 17.05), ("16..18", 16, 18), ("16 ..", 16, 1e9)],
)
def test_a_speed_is_read_as_a_technician_writes_it(text: str, low: float, high: float) -> None:
    found = window(text)
    assert (found.low, min(found.high, 1e9)) == (pytest.approx(low), pytest.approx(high))


@pytest.mark.parametrize("text", ["", "..", "fast", "17 18", "17 Hz", "-3"])
def test_what_is_no_speed_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"write 17, 16\.\.18, 16\.\. or \.\.18"):
        window(text)


def test_what_is_no_date_is_refused() -> None:
    assert period("2026-03-12T10") == "2026-03-12T10"
    with pytest.raises(InputError, match=r"date '12\.3\.2026': write 2026, 2026-03"):
        period("12.3.2026")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    make_bundle(tmp_path / "runs", "a")
    make_bundle(tmp_path / "runs", "b", NOW + timedelta(minutes=1))
    assert names(tmp_path / "runs") == ["a", "b"]
    return tmp_path / "runs"


def test_what_came_changed_or_went_is_seen_at_the_next_look(root: Path) -> None:
    third = make_bundle(root, "c", NOW + timedelta(minutes=2), status="unfinished")
    assert names(root, status="unfinished") == ["c"]
    third.finish("interrupted")
    assert names(root, status="interrupted") == ["c"]
    add_remark(third.path, "verdict", "bad", "Ada", NOW)
    assert names(root, verdict="bad") == ["c"]
    add_remark(third.path, "note", "slipped", "Ada", NOW)
    assert names(root, words=("slipped",)) == ["c"]
    note(third, shape="bent-2")
    assert names(root, shape="bent-2") == ["c"]
    shutil.rmtree(third.path)
    assert names(root) == ["a", "b"]


def test_a_look_that_finds_nothing_new_reads_and_writes_nothing(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = (root / INDEX).read_bytes()
    monkeypatch.setattr("workbench.catalogue.index.read_entry", lambda *words: 1 / 0)
    assert names(root) == ["a", "b"]
    assert (root / INDEX).read_bytes() == before


def test_whoever_deletes_the_index_loses_nothing(lab: Path) -> None:
    before = search(lab, Query(), silent)
    (lab / INDEX).unlink()
    assert search(lab, Query(), silent) == before


def test_rebuild_sees_what_was_edited_with_its_date_set_back(root: Path) -> None:
    manifest = next(root.glob("*_a/manifest.json"))
    then = manifest.stat()
    manifest.write_text(manifest.read_text().replace("thesis-initial", "tampered-shape"[:14]))
    os.utime(manifest, ns=(then.st_atime_ns, then.st_mtime_ns))
    assert names(root, shape="tampered") == []
    assert rebuild(root, silent) == 2
    assert names(root, shape="tampered") == ["a"]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda path: path.write_bytes(b"no database at all" * 100), "damaged"),
        (lambda path: path.write_bytes(path.read_bytes()[:5000]), "damaged"),
        (lambda path: execute(path, "DROP TABLE stamps"), "damaged"),
        (lambda path: execute(path, "ALTER TABLE runs RENAME COLUMN shape TO form"), "damaged"),
        (lambda path: execute(path, "PRAGMA user_version = 99"), "of another version"),
    ],
)
def test_a_spoilt_index_is_made_again_and_that_is_told(root: Path, spoil: Any, words: str) -> None:
    spoil(root / INDEX)
    told: list[str] = []
    found = search(root, Query(shape="thesis"), told.append)
    assert len(found.entries) == 2
    assert len(told) == 1
    assert words in told[0]
    assert told[0].endswith("made again from the bundles")
    assert names(root) == ["a", "b"]


def execute(path: Path, text: str) -> None:
    with closing(sqlite3.connect(path)) as base:
        base.execute(text)
        base.commit()


def test_a_folder_that_takes_no_index_is_searched_without(root: Path) -> None:
    (root / INDEX).unlink()
    (root / INDEX).mkdir()
    told: list[str] = []
    assert len(search(root, Query(), told.append).entries) == 2
    assert len(told) == 1
    assert told[0].endswith("(unable to open database file); the runs are searched without it")


def test_an_index_that_cannot_be_written_still_serves(root: Path) -> None:
    make_bundle(root, "c", NOW + timedelta(minutes=2))
    with closing(sqlite3.connect(root / INDEX, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")  # somebody writes, and does not end
        told: list[str] = []
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("workbench.catalogue.index._WAIT_S", 0.05)
            assert len(search(root, Query(), told.append).entries) == 3
    assert told[0].endswith("(database is locked); the runs are searched without it")
    assert names(root) == ["a", "b", "c"]


def test_a_folder_that_is_not_there_has_no_runs(tmp_path: Path) -> None:
    assert search(tmp_path / "none", Query(), silent).total == 0
    assert not (tmp_path / "none").exists()


LISTER = """\
import sys
from pathlib import Path
from workbench.catalogue import Query, rebuild, search
told = []
for k in range(8):
    print(len(search(Path(sys.argv[1]), Query(), told.append).entries))
    rebuild(Path(sys.argv[1]), told.append)
assert not told, told
"""


def test_lists_and_rebuilds_at_once_all_see_every_run(root: Path) -> None:
    (root / INDEX).unlink()

    def several(k: int) -> str:
        return subprocess.run(
            [sys.executable, "-c", LISTER, str(root)], capture_output=True, text=True, check=True
        ).stdout

    with ThreadPoolExecutor(4) as pool:
        assert set("".join(pool.map(several, range(4))).split()) == {"2"}


def test_an_index_that_another_program_made_while_we_waited_is_kept(root: Path) -> None:
    (root / INDEX).unlink()
    with closing(sqlite3.connect(root / INDEX, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")  # it found no index either, and comes first
        with ThreadPoolExecutor(1) as pool:
            second = pool.submit(lambda: _opened(str(root / INDEX), silent).close())
            with pytest.raises(TimeoutError):
                second.result(0.2)  # it has read that there is no index, and waits
            for table, columns in (("runs", COLUMNS), ("stamps", _STAMPED)):
                other.execute(f"CREATE TABLE {table} ({', '.join(columns)}, PRIMARY KEY (name))")
            other.execute("INSERT INTO runs (name) VALUES ('made meanwhile')")
            other.execute(f"PRAGMA user_version = {_VERSION}")
            other.execute("COMMIT")
            second.result(10.0)
        assert other.execute("SELECT name FROM runs").fetchall() == [("made meanwhile",)]


def test_windows_are_closed() -> None:
    assert window("16..18") == NumberRange(16.0, 18.0)
