"""What the rooms tell of work that takes time: phases in words, and what is known of each."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Phase", "Progress", "counted", "within"]

Progress = Callable[[str], None]
"""Is told each phase as it begins; a `Phase` where more than its words is known."""


class Phase(str):
    """The words of a phase that begins, and how far the work is.

    Args:
        words: what begins.
        share: of the whole work that is done at its beginning, 0 to 1; None where nobody knows. A
            share below the one before begins another piece of work.
        seconds: that this phase will last [s]; None where nobody knows.
    """

    share: float | None
    seconds: float | None

    def __new__(cls, words: str, share: float | None = None, seconds: float | None = None) -> Phase:
        """Make the text, and keep beside it what is known."""
        phase = super().__new__(cls, words)
        phase.share, phase.seconds = share, seconds
        return phase


def counted(words: str, number: int, count: int) -> Phase:
    """Return the phase of one of several pieces alike.

    Args:
        words: what is done with each.
        number: of this piece, from 1.
        count: of all pieces.
    """
    return Phase(f"{words} ({number} of {count})", (number - 1) / count)


def within(progress: Progress, words: str, share: float) -> Progress:
    """Return what tells the phases of one part of a work, as phases of the whole.

    Args:
        progress: is told.
        words: of the part, put before each phase's own.
        share: of the whole that is done when the part begins, 0 to 1.
    """

    def told(phase: str) -> None:
        seconds = phase.seconds if isinstance(phase, Phase) else None
        progress(Phase(f"{words}{phase}", share, seconds))

    return told
