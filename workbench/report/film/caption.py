"""The words on a picture: what ran, when, how fast it is shown, and which robot is which."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from workbench.motion import CORNER_FORCES
from workbench.report.comparison import Comparison
from workbench.report.geometry import MISSING
from workbench.report.palette import EXTENDED, REAL, SHADES, TWIN

__all__ = ["Caption", "pace"]

_Face = ImageFont.FreeTypeFont
_INK, _QUIET, _ALERT = "#1b2430", "#5b6675", "#b3261e"
_MARGIN = 1 / 36  # of the picture's height
_SIZES = {"title": 1 / 24, "text": 1 / 34}  # of the letters, of the picture's height


class Caption:
    """Writes on the pictures of a run.

    Args:
        comparison: the run.
        slow: how many times slower than life it is shown.
        height: of the pictures [px].
    """

    def __init__(self, comparison: Comparison, slow: float, height: int) -> None:
        """Prepare the letters and the words that stay."""
        self._margin = round(_MARGIN * height)
        self._title = _letters("DejaVuSans-Bold.ttf", round(_SIZES["title"] * height))
        self._text = _letters("DejaVuSans.ttf", round(_SIZES["text"] * height))
        self._about = " \N{MIDDLE DOT} ".join(comparison.label) or comparison.run
        self._name, self._mark = comparison.title, comparison.mark
        self._pace = pace(slow)
        self._robots = [("robot (ghost)", REAL)] if len(comparison.real) else []
        self._robots += [("twin", TWIN)] if len(comparison.twin) else []
        self._robots += [("extended twin", EXTENDED)] if comparison.extended else []
        self._arrows = [
            *([("ground's force", SHADES["force"])]
              if any(CORNER_FORCES[0][0] in motion for motion in comparison.motions) else []),
            *([("missing force", SHADES["missing"])]
              if comparison.estimate is not None and MISSING["top"][0] in comparison.estimate
              else []),
        ]  # fmt: skip

    def on(self, picture: NDArray[np.uint8], time: float) -> NDArray[np.uint8]:
        """Return the picture, (height, width, 3), with its caption for a time.

        Args:
            picture: (height, width, 3) RGB.
            time: that is shown [s].
        """
        image = Image.fromarray(picture)
        for color, position, letters in self._words(image.width, image.height):
            image.paste(color, position, letters)
        draw, edge = ImageDraw.Draw(image), self._margin
        draw.text((image.width - edge, edge), f"{time:.2f} s", _INK, self._title, anchor="ra")
        return np.asarray(image)

    @cache  # noqa: B019  a caption lives as long as its film
    def _words(self, width: int, height: int) -> list[tuple[str, tuple[int, int], Image.Image]]:
        """Return the words that stay, in each colour: the colour, where, and the letters."""
        edge, line = self._margin, round(1.5 * self._text.size)
        below = edge + round(1.4 * self._title.size)
        layers: dict[str, Image.Image] = {}

        def write(
            x: float, y: float, words: str, color: str, face: _Face, anchor: str = "la"
        ) -> float:
            if color not in layers:
                layers[color] = Image.new("L", (width, height))
            ImageDraw.Draw(layers[color]).text((x, y), words, 255, face, anchor=anchor)
            return face.getlength(words)

        write(edge, edge, self._name, _INK, self._title)
        write(edge, below, self._about, _QUIET, self._text)
        write(width - edge, below, self._pace, _QUIET, self._text, "ra")
        write(edge, below + line, self._mark or "", _ALERT, self._text)
        left = float(edge)
        for words, color in (*self._robots, *self._arrows, ("a square is 0.1 m", _QUIET)):
            left += write(left, height - edge, words, color, self._text, "ls")
            left += 1.5 * self._text.size
        boxes = {color: letters.getbbox() for color, letters in layers.items()}
        return [(color, box[:2], layers[color].crop(box)) for color, box in boxes.items() if box]


def pace(slow: float) -> str:
    """Return the speed of a film against life; nothing where they are the same."""
    if slow == 1:
        return ""
    return f"1/{slow:g} speed" if slow > 1 else f"{1 / slow:g} times faster"


def _letters(name: str, size: int) -> _Face:
    """Return a face that comes with matplotlib, so that it is there on every computer."""
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)
