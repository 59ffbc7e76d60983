"""Measure printed pages: a PDF through poppler at 300 dpi, lines by their centres of darkness.

Nothing here knows how the pages are drawn.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

Array = NDArray[np.float64]

DPI = 300
PIXEL_MM = 25.4 / DPI

needs_poppler = pytest.mark.skipif(
    shutil.which("pdftoppm") is None, reason="pdftoppm (poppler-utils) is not installed"
)


def pages(pdf: bytes, folder: Path) -> list[Array]:
    """Rasterise; each page as darkness from 0 to 1, row 0 at the top."""
    (folder / "sheet.pdf").write_bytes(pdf)
    words = ["pdftoppm", "-r", str(DPI), "-gray", str(folder / "sheet.pdf"), str(folder / "page")]
    subprocess.run(words, check=True, capture_output=True, timeout=120)
    found = []
    for path in sorted(folder.glob("page*.pgm")):
        with Image.open(path) as picture:
            found.append(1 - np.asarray(picture, dtype=float) / 255)
        path.unlink()
    return found


def walked(angles: Array, length: float, parts: int = 16) -> tuple[Array, Array]:
    """Ends of equal parts of the equal-length arcs and their headings, by tiny steps [mm]."""
    steps = 160_000
    increment = length / len(angles)
    middle = (np.arange(steps) + 0.5) * length / steps
    share = np.clip(middle[:, None] / increment - np.arange(1, len(angles)) + 0.5, 0, 1)
    heading = angles[0] + share @ angles[1:]
    way = 1000 * length / steps * np.stack([np.cos(heading), -np.sin(heading)], axis=1)
    points = np.concatenate([np.zeros((1, 2)), np.cumsum(way, axis=0)])
    stride = steps // parts
    return points[::stride], np.append(heading, heading[-1])[::stride]


def sample(page: Array, points: Array) -> Array:
    """Darkness at points from the lower left [mm], between pixels in proportion."""
    column = points[..., 0] / PIXEL_MM - 0.5
    row = page.shape[0] - points[..., 1] / PIXEL_MM - 0.5
    left, top = np.floor(column).astype(int), np.floor(row).astype(int)
    right_share, low_share = column - left, row - top
    upper = page[top, left] * (1 - right_share) + page[top, left + 1] * right_share
    lower = page[top + 1, left] * (1 - right_share) + page[top + 1, left + 1] * right_share
    return upper * (1 - low_share) + lower * low_share


def line_near(page: Array, point: Array, across: Array, reach: float = 1.0) -> Array:
    """The centre of the line that a probe through a point meets, (2,) [mm]."""
    along = np.arange(-reach, reach, PIXEL_MM / 8)
    dark = sample(page, point + along[:, None] * across)
    assert dark.max() > 0.3, f"no line near {point}"
    return point + float(along @ dark / dark.sum()) * across


def cross_near(page: Array, point: Array, arm: float) -> Array:
    """The centre of an upright cross, from probes of its four arms, (2,) [mm]."""
    x, y = np.eye(2)
    upright = [line_near(page, point + sign * arm * y, x) for sign in (-1, 1)]
    level = [line_near(page, point + sign * arm * x, y) for sign in (-1, 1)]
    return np.array([np.mean(upright, axis=0)[0], np.mean(level, axis=0)[1]])


def bars(page: Array) -> list[tuple[str, float]]:
    """The check bars, lines between 98 and 102 mm, with the distance of their end ticks [mm]."""
    return [("H", length) for length in _level_bars(page)] + [
        ("V", length) for length in _level_bars(np.rot90(page, -1))
    ]


def _level_bars(page: Array) -> list[float]:
    """Lengths of level bars; their end ticks are probed 1.5 mm to the side free of minor ticks."""
    dark = page > 0.5
    found: list[float] = []
    last = -100
    for row in np.flatnonzero(dark.sum(axis=1) > 95 / PIXEL_MM):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], dark[row].astype(int), [0]])))
        for begin, end in edges.reshape(-1, 2):
            if not 98 < (end - begin) * PIXEL_MM < 102 or row - last < 10:
                continue
            last = int(row)
            y = (page.shape[0] - row - 0.5) * PIXEL_MM + 1.5
            ends = [
                line_near(page, np.array([x * PIXEL_MM, y]), np.array([1.0, 0.0]))
                for x in (begin, end)
            ]
            found.append(float(ends[1][0] - ends[0][0]))
    return found
