"""An export is told once it is finished, however it comes into the folder."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from workbench.errors import HardwareError
from workbench.hw import SimulatedClock, SystemClock
from workbench.run.takes import TakeFolder

WRITER = """
import os, sys, time
place, how = sys.argv[1:]
name = os.path.join(place, "take.csv" if how == "in pieces" else "take.csv.part")
with open(name, "wb", buffering=0) as file:
    for k in range(4):
        time.sleep(0.4)
        file.write(b"x" * 5000)
if how == "renamed":
    time.sleep(0.4)
    os.replace(name, os.path.join(place, "take.csv"))
"""


@pytest.fixture
def clock() -> SimulatedClock:
    return SimulatedClock()


@pytest.fixture
def folder(tmp_path: Path, clock: SimulatedClock) -> TakeFolder:
    (tmp_path / "old.csv").write_text("old")
    return TakeFolder(tmp_path, clock)


def seen_until(folder: TakeFolder, clock: SimulatedClock, seconds: float) -> list[str]:
    """Poll four times a second and return the names of what is told."""
    names: list[str] = []
    for _ in range(round(4 * seconds)):
        names += [file.name for file in folder.finished()]
        clock.sleep(0.25)
    return names


@pytest.mark.parametrize("how", ["in pieces", "renamed"])
def test_a_slow_writer_in_another_process_is_waited_for(tmp_path: Path, how: str) -> None:
    folder = TakeFolder(tmp_path, SystemClock())
    writer = subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path), how])
    try:
        deadline = time.monotonic() + 20
        while not (found := folder.finished()):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        size = found[0].stat().st_size
    finally:
        assert writer.wait(timeout=20) == 0
    assert [file.name for file in found] == ["take.csv"]
    assert size == 20_000


def test_what_lay_there_before_is_left_alone_until_it_changes(
    tmp_path: Path, folder: TakeFolder, clock: SimulatedClock
) -> None:
    assert seen_until(folder, clock, 3) == []
    (tmp_path / "old.csv").write_text("exported again")
    assert seen_until(folder, clock, 3) == ["old.csv"]


def test_a_file_is_told_after_a_second_of_standing_still_and_once(
    tmp_path: Path, folder: TakeFolder, clock: SimulatedClock
) -> None:
    (tmp_path / "new.csv").write_text("a")
    assert seen_until(folder, clock, 1) == []
    assert seen_until(folder, clock, 0.25) == ["new.csv"]
    assert seen_until(folder, clock, 10) == []


def test_a_file_that_goes_on_growing_is_waited_for_and_told_again_when_it_grew_later(
    tmp_path: Path, folder: TakeFolder, clock: SimulatedClock
) -> None:
    path = tmp_path / "new.csv"
    for k in range(8):
        path.write_text("a" * (k + 1))
        assert seen_until(folder, clock, 0.75) == []
    assert seen_until(folder, clock, 1) == ["new.csv"]
    path.write_text("b" * 50)
    assert seen_until(folder, clock, 2) == ["new.csv"]


def test_the_same_size_with_a_new_time_of_change_is_a_change(
    tmp_path: Path, folder: TakeFolder, clock: SimulatedClock
) -> None:
    path = tmp_path / "old.csv"
    os.utime(path, ns=(1, 1))
    assert seen_until(folder, clock, 2) == ["old.csv"]


def test_only_exports_are_told(tmp_path: Path, folder: TakeFolder, clock: SimulatedClock) -> None:
    for name in ("take.tak", "~$take.csv", ".~lock.take.csv", "notes.txt", "take.csv.part"):
        (tmp_path / name).write_text("x")
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "empty.csv").touch()
    (tmp_path / "TAKE.CSV").write_text("x")
    (tmp_path / "points.c3d").write_text("x")
    assert seen_until(folder, clock, 3) == ["TAKE.CSV", "points.c3d"]


def test_a_file_that_cannot_be_opened_is_waited_for(
    tmp_path: Path, folder: TakeFolder, clock: SimulatedClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "new.csv").write_text("a")
    real = Path.open

    def locked(path: Path, *words: str) -> object:
        raise PermissionError(13, "held by another program")

    monkeypatch.setattr(Path, "open", locked)
    assert seen_until(folder, clock, 5) == []
    monkeypatch.setattr(Path, "open", real)
    assert seen_until(folder, clock, 0.25) == ["new.csv"]


def test_a_folder_that_is_not_there_is_told(tmp_path: Path, clock: SimulatedClock) -> None:
    with pytest.raises(HardwareError, match=r"gone: the folder of exports cannot be listed"):
        TakeFolder(tmp_path / "gone", clock)
