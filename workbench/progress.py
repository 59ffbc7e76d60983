"""What the rooms tell of work that takes time: stages in words, and what is known of each."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress", "Stage", "counted", "within"]

Progress = Callable[[str], None]
"""Is told each stage as it begins; a `Stage` where more than its words is known."""


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


def within(progress: Progress, words: str, share: float) -> Progress:
    """Return what tells the stages of one part of a work, as stages of the whole.

    Args:
        progress: is told.
        words: of the part, put before each stage's own.
        share: of the whole that is done when the part begins, 0 to 1.
    """

    def told(stage: str) -> None:
        seconds = stage.seconds if isinstance(stage, Stage) else None
        progress(Stage(f"{words}{stage}", share, seconds))

    return told
