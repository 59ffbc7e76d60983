"""Whether a print of the marker board is at 1:1, and by how much it is off."""

from __future__ import annotations

from workbench.errors import InputError
from workbench.photo.board import BOARDS
from workbench.photo.board_page import CHECK_BAR_MM

__all__ = ["printed_scale"]

_WORST_PRINT = 0.005  # of a length, as for templates


def printed_scale(horizontal: float, vertical: float | None) -> tuple[float, float]:
    """Return what a metre of the board became on paper, across and along [m].

    Args:
        horizontal: measured length of the check bar H [mm].
        vertical: measured height V of a sheet's pattern [mm]; None where it was not measured.

    Raises:
        InputError: when the print is off by so much that it has to be made again.
    """
    across = horizontal / CHECK_BAR_MM
    along = 1.0 if vertical is None else vertical / _stated_height(vertical)
    for bar, share, measured in (("--h", across, horizontal), ("--v", along, vertical)):
        if not abs(share - 1) <= _WORST_PRINT:
            raise InputError(
                f"{bar} {measured:g} mm is {100 * (share - 1):+.2f} % off, more than "
                f"{100 * _WORST_PRINT:g} %; print the board again at 100 %, without fitting to "
                "the page"
            )
    return across, along


def _stated_height(vertical: float) -> float:
    """Return the sheet's height of pattern that is nearest to the one measured [mm]."""
    heights = [1000 * one.square * one.rows_a_sheet for one in BOARDS.values()]
    return min(heights, key=lambda height: abs(height - vertical))
