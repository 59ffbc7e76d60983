"""Whatever happened to a bundle: the file is named, and what is there can still be listed."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from tests.bundles import (
    NOW,
    TRACK,
    asked_for,
    guardian_of,
    journal_of,
    make_bundle,
    manifest_of,
    remarked,
)
from workbench.bundle import Bundle, Measured, Record, events, sha256, verify
from workbench.catalogue import Query, search
from workbench.errors import InputError, RecordError

FILES = (
    "manifest.json", "protocol.yaml", "protocol.json", "bench.yaml", "bench.json", "model.yaml",
    "shape.yaml", "calibration.yaml", "journal.jsonl", "wire.log", "guardian.jsonl",
    "take/take 1.csv", "track.parquet", "raw.parquet", "twin.parquet", "supply.parquet",
    "state.parquet", "checksums.txt", "remarks.jsonl",
)  # fmt: skip
VIEWS = ("compare.rrd", "report.html")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return remarked(make_bundle(tmp_path_factory.mktemp("runs"))).path


@pytest.fixture
def run(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / whole.name))


def flip(path: Path, at: int) -> None:
    data = bytearray(path.read_bytes())
    data[at] ^= 0x04
    path.write_bytes(data)


def damaged_files(problems: Iterable[str]) -> frozenset[str]:
    """The names of the files that the sentences of `verify` are about."""
    return frozenset(problem.partition(": ")[0] for problem in problems)


def listed(run: Path) -> str:
    """The status in the list."""
    found = search(run.parent, Query(), lambda text: None)
    assert [entry.name for entry in found.entries] == [run.name]
    return found.entries[0].status


def test_the_bundle_holds_every_kind_of_file_and_is_whole(whole: Path) -> None:
    held = {p.relative_to(whole).as_posix() for p in whole.rglob("*") if p.is_file()}
    assert held == {*FILES, *VIEWS}
    assert verify(whole) == []


def test_sha256sum_finds_nothing_wrong_either(whole: Path) -> None:
    if shutil.which("sha256sum") is None:
        pytest.skip("no sha256sum here")
    done = subprocess.run(
        ["sha256sum", "-c", "--strict", "checksums.txt"], cwd=whole, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count(": OK") == len(FILES) - 2  # neither of itself nor of the remarks


@pytest.mark.parametrize("before", [False, True], ids=["sealed now", "sealed before"])
@pytest.mark.parametrize("name", VIEWS)
def test_a_view_may_be_drawn_anew_or_missing(run: Path, name: str, before: bool) -> None:
    """The seals of the first bundles list the views."""
    if before:
        seal_as_before(run)
    assert (name in (run / "checksums.txt").read_text(encoding="utf-8")) == before
    for change in (draw_anew, leave_a_draft, Path.unlink):
        change(run / name)
        assert verify(run) == [], change
    flip(run / "model.yaml", 3)
    assert damaged_files(verify(run)) == {"model.yaml"}


def draw_anew(path: Path) -> None:
    path.write_bytes(b"another picture")


def leave_a_draft(path: Path) -> None:
    """As a program does that is killed while it draws."""
    path.with_name(f".{path.name}").write_bytes(b"half a pic")


def seal_as_before(run: Path) -> None:
    """Write checksums that list the views, as the first bundles have them."""
    kept = (run / "checksums.txt").read_text(encoding="utf-8").splitlines(keepends=True)[:-1]
    lines = "".join([*kept, *(f"{sha256(run / name)}  {name}\n" for name in VIEWS)])
    own = hashlib.sha256(lines.encode()).hexdigest()
    (run / "checksums.txt").write_text(f"{lines}# sha256 of the lines above: {own}\n", "utf-8")


@pytest.mark.parametrize("name", FILES)
def test_one_changed_byte_names_its_file(run: Path, name: str) -> None:
    size = (run / name).stat().st_size
    for at in sorted({0, size // 3, size // 2, size - 1}):
        flip(run / name, at)
        problems = verify(run)
        assert problems[0].startswith(f"{name}: changed") or name == "remarks.jsonl", at
        assert damaged_files(p for p in problems if "changed itself" not in p) == {name}, at
        assert listed(run) in ("complete", "damaged")
        assert manifest_of(Bundle.recover(run)[0])["mode"]
        flip(run / name, at)
    assert verify(run) == []


@pytest.mark.parametrize("name", ["checksums.txt", "remarks.jsonl"])
def test_what_guards_the_others_guards_itself_at_every_byte(run: Path, name: str) -> None:
    for at in range((run / name).stat().st_size):
        flip(run / name, at)
        assert name in damaged_files(verify(run)), at
        flip(run / name, at)


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_was_cut_or_lost_is_named(run: Path, name: str) -> None:
    data = (run / name).read_bytes()
    (run / name).write_bytes(data[: len(data) // 2])
    assert name in damaged_files(verify(run))
    assert listed(run) in ("complete", "damaged")
    (run / name).unlink()
    if name == "remarks.jsonl":
        assert verify(run) == []  # nobody said anything
    else:
        assert name in damaged_files(verify(run))
    assert listed(run) in ("complete", "damaged")


def test_a_manifest_with_one_broken_key_still_tells_the_others(run: Path) -> None:
    manifest = run / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"mode": "hop"', '"mode": hop"'))
    bundle, lost = Bundle.recover(run)
    assert lost.startswith("manifest.json: damaged: Expecting value: line ")
    assert manifest_of(bundle)["mode"] == "hop"  # of the folder's name
    assert manifest_of(bundle)["title"] == "Hop at 17 rad/s"
    assert manifest_of(bundle)["twin"]["distance_m"] == 0.248
    assert listed(run) == "damaged"
    with pytest.raises(InputError, match=r"manifest\.json: damaged: "):
        Bundle.open(run)


def test_a_list_of_checksums_without_its_own_is_one_of_the_first_bundles(run: Path) -> None:
    listing = run / "checksums.txt"
    lines = listing.read_text().splitlines(keepends=True)
    listing.write_text("".join(lines[:-1]))
    assert verify(run) == []
    listing.write_text("".join(lines[:-2]))
    assert verify(run) == ["wire.log: not in checksums.txt"]


def test_a_changed_file_and_a_changed_list_are_both_named(run: Path) -> None:
    flip(run / "model.yaml", 3)
    flip(run / "checksums.txt", 5)
    assert {"model.yaml", "checksums.txt"} <= damaged_files(verify(run))


def test_another_line_of_the_journal_is_left_out_alone(run: Path) -> None:
    with (run / "journal.jsonl").open("ab") as file:
        file.write(b'\xff\xfe{"time_s"\n{"time_s": 3.0, "event": "output_off"}\n')
    assert [e["event"] for e in journal_of(Bundle.open(run))][-1] == "output_off"


WRITER = """\
import sys
from datetime import datetime
from pathlib import Path
from tests.bundles import TRACK, asked_for
from workbench.bundle import Bundle, events
bundle = Bundle.create(Path(sys.argv[1]), "hop-17", datetime.now(), asked_for(title="T"))
for k in range(10**9):
    bundle.record.journal(events.Complete(), k)
    bundle.series.write("supply", TRACK, {})
"""


def test_a_killed_writer_leaves_what_it_had_and_the_list_says_so(
    tmp_path: Path, root: Path
) -> None:
    writer = subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path / "runs")], cwd=root)
    wait_until(lambda: any((tmp_path / "runs").glob("*/supply.parquet")))
    writer.kill()
    assert writer.wait() == -getattr(signal, "SIGKILL", -1)
    (run,) = (p for p in (tmp_path / "runs").iterdir() if p.is_dir())
    told = verify(run)
    assert told[0] == "checksums.txt: missing; the run was cut off (status failed)"
    assert all("draft" in line or "cut short" in line for line in told[1:])
    bundle = Bundle.open(run)
    assert len(journal_of(bundle)) >= 1
    assert bundle.series.read("supply").names == TRACK.names
    assert listed(run) == "unfinished"


def test_a_writer_killed_in_the_middle_of_a_line_or_file_is_told(tmp_path: Path) -> None:
    bundle = make_bundle(tmp_path, status="unfinished")
    with (bundle.path / "journal.jsonl").open("a") as file:
        file.write('{"time_s": 3.0, "eve')
    track = bundle.path / "track.parquet"
    track.write_bytes(track.read_bytes()[:-7])
    track.rename(bundle.path / ".track.parquet")
    (bundle.path / "twin.parquet").write_bytes(b"PAR1")
    (bundle.path / "bench.json").write_text('{"name": ')
    assert verify(bundle.path) == [
        "checksums.txt: missing; the run was cut off (status failed); the output is off, confirmed",
        ".track.parquet: a draft that was never finished",
        "bench.json: cut short",
        "journal.jsonl: its last line is cut short",
    ]
    assert [e["event"] for e in journal_of(bundle)] == ["asked", "output_on"]
    with pytest.raises(InputError, match=r"twin\.parquet: cannot be read"):
        bundle.series.read("twin")


def test_a_folder_whose_manifest_never_came_is_listed(tmp_path: Path) -> None:
    (tmp_path / "2026-03-12_101500_hop-17.00").mkdir()
    (tmp_path / "notes").mkdir()
    found = search(tmp_path, Query(), lambda text: None)
    (entry,) = found.entries
    assert (entry.mode, entry.status) == ("hop", "damaged")
    assert entry.title.startswith("manifest.json: not a bundle, it has no manifest.json")
    with pytest.raises(InputError, match="not a bundle, it has no manifest"):
        verify(tmp_path / "notes")


def wait_until(done: Callable[[], bool], seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end
        time.sleep(0.02)


def write_x(path: Path) -> None:
    path.write_text("x")


WRITES: dict[str, Callable[[Bundle], object]] = {
    "manifest.json": lambda b: b.record.note(Measured(output_off="confirmed")),
    "protocol.yaml": lambda b: b.write_document("protocol", "title: T\n"),
    "bench.json": lambda b: b.write_resolved("bench", {}),
    "supply.parquet": lambda b: b.series.write("supply", TRACK, {}),
    "take/t.csv": lambda b: b.write_take("t.csv", write_x),
    "report.html": lambda b: b.write_view("report", write_x),
    "checksums.txt": lambda b: b.finish("complete"),
}


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full disk")
@pytest.mark.parametrize("name", WRITES)
def test_a_full_disk_names_the_file_and_leaves_no_half_of_it(tmp_path: Path, name: str) -> None:
    bundle = Bundle.create(tmp_path, "hop-17", NOW, asked_for(title="T"))
    draft = bundle.take_folder.parent / Path(name).with_name(f".{Path(name).name}")
    draft.symlink_to("/dev/full")
    with pytest.raises(RecordError, match=rf"{name}: cannot be written \(.*No space left"):
        WRITES[name](bundle)
    assert not draft.is_symlink()
    assert (bundle.path / name).exists() == (name == "manifest.json")


APPENDS: dict[str, Callable[[Record], None]] = {
    "journal.jsonl": lambda record: record.journal(events.NoDrive(), 0.0),
    "wire.log": lambda record: record.wire("{}"),
}


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full disk")
@pytest.mark.parametrize("name", APPENDS)
def test_a_full_disk_names_what_is_appended(tmp_path: Path, name: str) -> None:
    bundle = Bundle.create(tmp_path, "hop-17", NOW, asked_for(title="T"))
    (bundle.path / name).symlink_to("/dev/full")
    with pytest.raises(RecordError, match=rf"{name}: cannot be written \(No space left"):
        APPENDS[name](bundle.record)


@pytest.mark.skipif(sys.platform == "win32", reason="needs symbolic links and pipes")
def test_a_link_or_pipe_in_place_of_a_file_is_named_and_never_opened(
    run: Path, tmp_path: Path
) -> None:
    elsewhere = Path(shutil.copytree(run, tmp_path / "out" / "elsewhere"))
    for name in FILES:
        (run / name).unlink()
        if name.endswith((".jsonl", ".log")):
            os.mkfifo(run / name)  # whoever opened it would wait for ever
        else:
            (run / name).symlink_to(elsewhere / name)
    problems = verify(run)
    assert damaged_files(problems) == frozenset(FILES)
    assert all("no file of the run; it is not opened" in text for text in problems)
    with pytest.raises(InputError, match=r"manifest\.json: is a link, and no file of the run"):
        Bundle.open(run)
    bundle, lost = Bundle.recover(run)
    assert "a link" in lost
    assert (journal_of(bundle), bundle.record.exchanges(), guardian_of(bundle)) == ([], [], [])
    assert not bundle.has_take()
    assert not bundle.series.has("track")
    for read in (
        lambda: bundle.document("bench"),
        lambda: bundle.resolved("bench"),
        lambda: bundle.series.read("track"),
    ):
        with pytest.raises(InputError, match="is a link, and no file of the run"):
            read()
    assert listed(run) == "damaged"


@pytest.mark.skipif(sys.platform == "win32", reason="needs symbolic links")
def test_a_folder_that_is_a_link_is_named_and_not_entered(run: Path, tmp_path: Path) -> None:
    shutil.move(run / "take", tmp_path / "take")
    (run / "take").symlink_to(tmp_path / "take")
    assert "take: a link, and no file of the run; it is not opened" in verify(run)
    assert "take/take 1.csv: missing" in verify(run)
    assert not Bundle.open(run).has_take()


def test_lists_in_lists_without_end_are_damage_like_any_other(run: Path) -> None:
    deep = "[" * 100_000
    (run / "manifest.json").write_text(f'{{"schema": {deep}')
    for name in ("journal.jsonl", "remarks.jsonl"):
        (run / name).write_text(f"{deep}\n")
    assert listed(run) == "damaged"
    assert {"manifest.json", "journal.jsonl", "remarks.jsonl"} <= damaged_files(verify(run))
    bundle, _ = Bundle.recover(run)
    assert journal_of(bundle) == []
