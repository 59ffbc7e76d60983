"""An export is taken when it is whole and shows the run; otherwise it is told why not."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from workbench.run.takes import CameraTime, judge

Export = Callable[..., Path]
S = timedelta(seconds=1)


def test_a_take_of_the_run_belongs_and_its_clock_is_named(
    export: Export, wanted: CameraTime
) -> None:
    verdict = judge(export("a.csv", wanted.began - 1.5 * S), wanted)
    assert verdict.belongs
    assert verdict.notes == ("by its clock the take began 1.5 s before this run's cameras",)


@pytest.mark.parametrize("late", [-59, 59])
def test_clocks_may_differ_by_the_tolerance(export: Export, wanted: CameraTime, late: int) -> None:
    take = export("a.csv", wanted.began + late * S, seconds=4.0)
    assert judge(take, wanted).belongs
    assert not judge(take, wanted, tolerance=50).belongs


@pytest.mark.parametrize(
    ("late", "told"), [(-600, "0:10:00 before this run's cameras"), (600, "0:10:00 after"),
                       (-70, "70.0 s before"), (61, "61.0 s after"),
                       (86400, "1 day, 0:00:00 after")],
)  # fmt: skip
def test_a_take_of_another_time_is_refused_with_the_difference(
    export: Export, wanted: CameraTime, late: int, told: str
) -> None:
    verdict = judge(export("a.csv", wanted.began + late * S), wanted)
    (reason,) = verdict.reasons
    assert told in reason
    assert "2026-03-12 15:59:50; 60 s are allowed" in reason
    assert "the clocks differ: set one of them, or tracking.takes_tolerance" in reason
    assert verdict.readable


def test_a_recording_started_long_before_belongs_when_it_lasts_through_the_run(
    export: Export, wanted: CameraTime
) -> None:
    began = wanted.began - 300 * S
    assert judge(export("long.csv", began, seconds=310), wanted).notes == (
        "by its clock the take began 0:05:00 before this run's cameras",
        "the take is 0:05:06 longer than the run",
    )
    assert not judge(export("ended.csv", began, seconds=200), wanted).belongs


def test_a_take_that_is_too_short_is_refused(export: Export, wanted: CameraTime) -> None:
    (reason,) = judge(export("a.csv", seconds=2.9), wanted).reasons
    assert "a.csv: the take lasts 2.9 s, from the start of the cameras to the end" in reason
    assert "it was 4.0 s" in reason
    assert judge(export("b.csv", seconds=3.5), wanted).belongs


def test_a_start_time_without_morning_or_afternoon_is_read_in_favour_of_the_run(
    export: Export, wanted: CameraTime
) -> None:
    assert judge(export("a.csv", "2026-03-12 03.59.49.500 "), wanted).belongs
    assert not judge(export("b.csv", "2026-03-12 03.59.49.500 AM"), wanted).belongs


def test_a_take_without_a_start_time_rests_on_its_length(
    export: Export, wanted: CameraTime
) -> None:
    verdict = judge(export("a.row.csv"), wanted)
    assert verdict.belongs
    assert "has no start time, so it was matched by duration and file time" in verdict.notes[0]
    assert not judge(export("b.row.csv", seconds=2), wanted).belongs


@pytest.mark.parametrize("name", ["a.csv", "a.row.csv"])
def test_an_export_that_was_cut_anywhere_is_never_taken(
    export: Export, wanted: CameraTime, name: str
) -> None:
    path = export(name)
    data = path.read_bytes()
    lines = data.splitlines(keepends=True)
    last = len(data) - len(lines[-1])
    places = [*range(last, len(data), 2), *(round(len(data) * k / 9) for k in range(9))]
    for size in places:
        path.write_bytes(data[:size])
        assert not judge(path, wanted).belongs, (size, data[max(0, size - 30) : size])
    path.write_bytes(data)
    assert judge(path, wanted).belongs


def test_a_cut_at_a_line_s_end_is_known_by_the_header_s_count(
    export: Export, wanted: CameraTime
) -> None:
    path = export("a.csv")
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:-3]))
    (reason,) = judge(path, wanted).reasons
    assert "the header states 120 frames, the file has 117; the export is not finished" in reason


def test_what_is_no_export_cannot_be_insisted_on(tmp_path: Path, wanted: CameraTime) -> None:
    path = tmp_path / "notes.csv"
    path.write_text("date;mass\n")
    verdict = judge(path, wanted)
    assert not verdict.readable
    assert "notes.csv:1: " in verdict.reasons[0]
    gone = judge(tmp_path / "gone.csv", CameraTime(datetime(2026, 1, 1), 1.0))
    assert not gone.readable
    assert "gone.csv: cannot be read" in gone.reasons[0]
