"""Motive's `Capture Start Time`: local wall time of the tracking PC, in the words of its locale."""

from __future__ import annotations

import re
import unicodedata
from datetime import datetime, timedelta

__all__ = ["format_start_time", "parse_start_time"]

_PATTERN = re.compile(
    r"\s*(?P<date>\d{4}-\d{1,2}-\d{1,2})"
    r"(?P<before>\D*?)[ T]?\s*"
    r"(?P<hour>\d{1,2})[.:](?P<minute>\d{1,2})[.:](?P<second>\d{1,2})(?:[.,:](?P<part>\d{1,9}))?"
    r"(?P<after>.*)",
    re.ASCII | re.DOTALL,
)
# English and Spanish, Hungarian, Chinese, Japanese, Korean, as Windows writes them
_MORNING = frozenset({"am", "de", "上午", "午前", "오전"})
_AFTERNOON = frozenset({"pm", "du", "下午", "午後", "오후"})
_HALF_DAY_H = 12


def parse_start_time(text: str) -> tuple[datetime, ...]:
    """Return the local times, without a zone, that a start time can mean; never fail.

    Motive prints a clock of twelve hours and the PC's word for morning or afternoon. On PCs whose
    locale has no such word it is missing, and 02.58 may be 14:58.

    Args:
        text: such as "2016-01-05 03.49.50.755 PM".

    Returns:
        One time; two, the earlier first, where the word is missing or unknown; none where the text
        is no date and time.
    """
    found = _PATTERN.fullmatch(text)
    if found is None:
        return ()
    hours = _hours(int(found["hour"]), _word(found["before"]) or _word(found["after"]))
    try:
        day = datetime.strptime(found["date"], "%Y-%m-%d")
        start = day.replace(minute=int(found["minute"]), second=int(found["second"]))
    except ValueError:
        return ()
    fraction = timedelta(microseconds=int((found["part"] or "0")[:6].ljust(6, "0")))
    return tuple(start.replace(hour=hour) + fraction for hour in hours)


def format_start_time(when: datetime) -> str:
    """Return a time as an English Motive prints it, to the millisecond."""
    hour = when.hour % _HALF_DAY_H or _HALF_DAY_H
    half = "AM" if when.hour < _HALF_DAY_H else "PM"
    return f"{when:%Y-%m-%d} {hour:02d}.{when:%M.%S}.{when.microsecond // 1000:03d} {half}"


def _hours(hour: int, word: str) -> tuple[int, ...]:
    """Return the hours of the day that the printed one can mean."""
    if not 1 <= hour <= _HALF_DAY_H:
        return (hour,) if hour < 24 else ()
    morning = hour % _HALF_DAY_H
    if word in _MORNING:
        return (morning,)
    if word in _AFTERNOON:
        return (morning + _HALF_DAY_H,)
    return (morning, morning + _HALF_DAY_H)


def _word(text: str) -> str:
    """Return a word without case, blanks, dots and the width of its letters."""
    plain = unicodedata.normalize("NFKC", text).casefold()
    return "".join(letter for letter in plain if letter.isalpha())
