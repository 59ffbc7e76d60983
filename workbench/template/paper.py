"""Paper and what of a page is free for the drawing."""

from __future__ import annotations

import re
from dataclasses import dataclass

from workbench.errors import InputError, did_you_mean

__all__ = [
    "BAR_MM",
    "BAR_STRIP_MM",
    "MARGIN_MM",
    "OVERLAP_MM",
    "PAPERS",
    "ROLL",
    "Paper",
    "paper_named",
]

PAPERS: dict[str, tuple[float, float]] = {
    "A4": (210.0, 297.0),
    "A3": (297.0, 420.0),
    "Letter": (215.9, 279.4),
    "Tabloid": (279.4, 431.8),
}
"""Name -> width and height, upright [mm]."""

MARGIN_MM = 12.0
"""Around a page, where printers do not print."""
TITLE_MM = 38.0
"""Height of the strip at the bottom: title block, QR code, page map, and above them the horizontal
check bar."""
WIDE_TITLE_MM = 26.0
"""Its height on a page that is wide enough to have the check bar beside them."""
BAR_STRIP_MM = 10.0
"""Width of the strip on the left, which holds the vertical check bar."""
OVERLAP_MM = 15.0
"""Of neighbouring pages."""
BAR_MM = 100.0
"""Length of a check bar."""

ROLL = "roll"
_WIDE_MM = 279.0  # least width of such a page
_LEAST_WINDOW_MM = (165.0, 110.0)  # so that title block and check bars fit
_CUSTOM = re.compile(r"(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)mm")


@dataclass(frozen=True)
class Paper:
    """A page.

    Args:
        name: as the user gave it.
        width: [mm].
        height: [mm]; None for a roll, which is cut to length.
    """

    name: str
    width: float
    height: float | None

    @property
    def wide(self) -> bool:
        """Return whether the horizontal check bar lies beside the title block."""
        return self.width >= _WIDE_MM

    @property
    def title_height(self) -> float:
        """Return the height of the strip at the bottom [mm]."""
        return WIDE_TITLE_MM if self.wide else TITLE_MM

    @property
    def corner(self) -> tuple[float, float]:
        """Return the lower left corner of what is free for the drawing [mm]."""
        return MARGIN_MM + BAR_STRIP_MM, MARGIN_MM + self.title_height

    @property
    def window_width(self) -> float:
        """Return the width that is free for the drawing [mm]."""
        return self.width - 2 * MARGIN_MM - BAR_STRIP_MM

    @property
    def window_height(self) -> float | None:
        """Return the height that is free for the drawing [mm]; None for a roll."""
        return None if self.height is None else self.height - 2 * MARGIN_MM - self.title_height

    @property
    def turned(self) -> Paper | None:
        """Return the page lying on its side; None for a roll and where that is too small."""
        if self.height is None:
            return None
        sideways = Paper(self.name, self.height, self.width)
        return sideways if sideways.large_enough else None

    @property
    def large_enough(self) -> bool:
        """Return whether title block and check bars fit."""
        width, height = _LEAST_WINDOW_MM
        return self.window_width >= width and (self.window_height or height) >= height

    def cut(self, window_height: float) -> Paper:
        """Return the page of a roll that is cut to hold a drawing of a height [mm]."""
        height = max(window_height, _LEAST_WINDOW_MM[1]) + 2 * MARGIN_MM + self.title_height
        return Paper(self.name, self.width, height)


def paper_named(name: str, roll_width: float | None = None) -> Paper:
    """Return a paper.

    Args:
        name: one of `PAPERS`, `roll`, or a size such as `330x480mm`.
        roll_width: of a roll [m].

    Raises:
        InputError: for an unknown name, a roll without width, a width without roll, and a page on
            which title block and check bars do not fit.
    """
    paper = _paper(name, roll_width)
    if not paper.large_enough and paper.turned is None:
        width = _LEAST_WINDOW_MM[0] + 2 * MARGIN_MM + BAR_STRIP_MM
        height = _LEAST_WINDOW_MM[1] + 2 * MARGIN_MM + TITLE_MM
        size = f"{paper.width:g} mm" + ("" if paper.height is None else f" x {paper.height:g} mm")
        raise InputError(
            f"paper {name!r}: {size} is too small; title block and check bars of {BAR_MM:g} mm "
            f"need {width:g} mm x {height:g} mm, on a roll {width:g} mm of width"
        )
    return paper


def _paper(name: str, roll_width: float | None) -> Paper:
    if name.lower() == ROLL:
        if roll_width is None:
            raise InputError('a roll needs its width, for example --roll-width "610 mm"')
        return Paper(ROLL, 1000 * roll_width, None)
    if roll_width is not None:
        raise InputError(f"--roll-width is for --paper roll, not for {name}")
    for known, size in PAPERS.items():
        if known.lower() == name.lower():
            return Paper(known, *size)
    custom = _CUSTOM.fullmatch(name.replace(" ", ""))
    if custom is not None:
        return Paper(name, float(custom[1]), float(custom[2]))
    names = [*PAPERS, ROLL]
    raise InputError(
        f"unknown paper {name!r}{did_you_mean(name, names)}; there is {', '.join(names)}, "
        "or a size such as 330x480mm"
    )
