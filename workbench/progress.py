"""Progress of work that takes time: stages in words, and what is known of each."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress", "Stage", "counted", "portion", "reached", "within"]

Progress = Callable[[str], None]
"""Receives each stage as it begins; a `Stage` where more than its words is known.

It is the one way to report progress, and how often is up to the work: what is shown of
it, and where, is up to the command line. What it raises ends the work.
"""


class Stage(str):
    """The words of a stage that begins, and how far the work is.

    Args:
        words: what begins.
        share: of the whole work that is done at its beginning, 0 to 1; None where nobody knows. A
            share below the one before begins another piece of work.
        seconds: that this stage will last [s]; None where nobody knows.
    """

    share: float | None
    seconds: float | None

    def __new__(cls, words: str, share: float | None = None, seconds: float | None = None) -> Stage:
        """Make the text, and keep beside it what is known."""
        stage = super().__new__(cls, words)
        stage.share, stage.seconds = share, seconds
        return stage


def counted(words: str, number: int, count: int) -> Stage:
    """Return the stage of one of several pieces alike.

    Args:
        words: what is done with each.
        number: of this piece, from 1.
        count: of all pieces.
    """
    return Stage(f"{words} ({number} of {count})", (number - 1) / count)


def reached(words: str, done: int, count: int) -> Stage:
    """Return how far one piece of work is, once a part of it is done.

    Args:
        words: what is counted.
        done: how many are done.
        count: of all.
    """
    return Stage(f"{words} {done} of {count}", done / max(count, 1))


def portion(progress: Progress, begin: float, end: float) -> Progress:
    """Return a callback for the stages of one part of a work, passed on as stages of the whole.

    A stage that says no share is taken to begin where a quarter of what remained of the part was
    done since the stage before: how many follow is not known, and the share never passes `end`.

    Args:
        progress: receives them.
        begin: share of the whole that is done when the part begins, 0 to 1.
        end: and when it ends.
    """
    done = 0.0
    began = False

    def report(stage: str) -> None:
        nonlocal done, began
        share = stage.share if isinstance(stage, Stage) else None
        if share is None:
            share = done + 0.25 * (1 - done) if began else 0.0
        done, began = max(done, share), True
        seconds = stage.seconds if isinstance(stage, Stage) else None
        progress(Stage(stage, begin + done * (end - begin), seconds))

    return report


def within(progress: Progress, words: str, share: float | None) -> Progress:
    """Return a callback for the stages of one part of a work, as stages of the whole.

    Args:
        progress: receives them.
        words: of the part, put before each stage's own.
        share: of the whole that is done when the part begins, 0 to 1; None where it is the whole.
    """

    def report(stage: str) -> None:
        seconds = stage.seconds if isinstance(stage, Stage) else None
        progress(Stage(f"{words}{stage}", share, seconds))

    return report
