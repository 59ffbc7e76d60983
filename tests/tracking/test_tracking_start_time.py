"""Start times as Motive writes them on PCs of several languages."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.tracking import format_start_time, read_take
from workbench.tracking.start_time import parse_start_time


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2016-01-05 03.49.50.755 PM", "15:49:50.755"),
        ("2016-01-05 03.49.50.755 AM", "03:49:50.755"),
        ("2016-01-05 12.00.00.000 AM", "00:00:00"),
        ("2016-01-05 12.00.00.000 PM", "12:00:00"),
        ("2016-01-05 3:49:50 P.M.", "15:49:50"),
        ("2016-01-05 03.49.50.755 p. m.", "15:49:50.755"),
        ("2016-01-05 02.58.01.5 DU.", "14:58:01.500"),
        ("2016-01-05 02.58.01.500 DE.", "02:58:01.500"),
        ("2016-01-05 02.58.01.500 下午", "14:58:01.500"),
        ("2016-01-05 上午 02.58.01.500", "02:58:01.500"),
        ("2016-01-05 오후 02.58.01.500", "14:58:01.500"),
        ("2016-01-05 14.58.01.500", "14:58:01.500"),
        ("2016-01-05 14.58.01.500 PM", "14:58:01.500"),
        ("2016-01-05 00.58.01.500", "00:58:01.500"),
    ],
)
def test_a_time_with_a_readable_word_means_one_time(text: str, expected: str) -> None:
    assert parse_start_time(text) == (datetime.fromisoformat(f"2016-01-05 {expected}"),)


@pytest.mark.parametrize("word", ["", " ", " ÏÂÎç", " ?", " \ufffd\ufffd"])
def test_without_a_readable_word_both_halves_of_the_day_are_possible(word: str) -> None:
    assert parse_start_time(f"2016-01-05 02.58.01.500{word}") == (
        datetime(2016, 1, 5, 2, 58, 1, 500_000),
        datetime(2016, 1, 5, 14, 58, 1, 500_000),
    )
    noon = parse_start_time(f"2016-01-05 12.58.01{word}")
    assert [time.hour for time in noon] == [0, 12]


@pytest.mark.parametrize(
    "text",
    ["", "Take 3", "2016-13-05 03.49.50.755 PM", "2016-01-05 25.00.00", "2016-01-05 03.61.50 PM",
     "2016-01-05", "05.01.2016 15:49:50", "0000-01-01 01.01.01 PM"],
)  # fmt: skip
def test_what_is_no_time_means_none(text: str) -> None:
    assert parse_start_time(text) == ()


@given(st.text())
def test_no_text_makes_it_fail(text: str) -> None:
    assert len(parse_start_time(text)) <= 2
    assert len(parse_start_time(f"2016-01-05 {text}")) <= 2


@given(st.datetimes(min_value=datetime(1900, 1, 1)))
def test_every_time_is_read_back_to_the_millisecond(when: datetime) -> None:
    rounded = when.replace(microsecond=when.microsecond // 1000 * 1000)
    assert parse_start_time(format_start_time(when)) == (rounded,)


def test_a_motive_export_tells_when_it_began_and_a_row_export_does_not(stored: Path) -> None:
    assert read_take(stored / "hop_motive_1.24.csv").began == (datetime(2012, 5, 23, 12),)
    assert read_take(stored / "hop_row_1.0.csv").began == ()


def test_real_exports_began_when_their_names_say(real_exports: Path) -> None:
    take = read_take(real_exports / "b_motive_1.21_quality_unlabeled.csv")
    assert take.began == (datetime(2016, 1, 5, 15, 49, 50, 755_000),)
