"""Draw the rooms in their layers, and which steps of a run and of a diagnosis happen in each.

    python docs/make_architecture_picture.py OUT

Writes `architecture.svg`, of import-linter's layers in `pyproject.toml` and of the steps in
`docs/explanation/architecture.md`; `tests/test_architecture.py` says when it is out of date.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "explanation" / "architecture.md"
WAYS = {"The way of a run": "#1f6fd0", "The way of a diagnosis": "#c4570a"}
"""Sections of the page, and the colour of their steps."""

WIDTH, LEFT, ROW, CHARACTER, GAP = 640, 36.0, 26, 7.3, 8  # px
STYLE = "font: 12px ui-monospace, monospace"
FRAME = '<rect x="0.5" y="0.5" width="{}" height="{}" rx="8" fill="#ffffff" stroke="#d0d4da"/>'
ROOM = '<rect x="{:.0f}" y="{}" width="{:.0f}" height="20" rx="4" fill="{}" stroke="#b6bcc6"/>'
BAND = '<line x1="8" y1="{0}" x2="{1}" y2="{0}" stroke="#d0d4da"/>'
NAME = '<text x="{:.0f}" y="{}" fill="{}">{}</text>'


def layers() -> list[list[str]]:
    """Return the rooms of each layer, the highest first."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    found = next(one["layers"] for one in contracts if one["type"] == "layers")
    return [sorted(re.split(r"\s*[|:]\s*", layer)) for layer in found]


def steps(title: str) -> dict[str, list[int]]:
    """Return room -> numbers of the steps of a section that happen in it."""
    section = PAGE.read_text("utf-8").split(f"## {title}")[1].split("\n## ")[0]
    found: dict[str, list[int]] = {}
    for number, step in enumerate(re.split(r"(?m)^\d+\. ", section)[1:], 1):
        for room in dict.fromkeys(re.findall(r"`workbench/(\w+)", step)):
            found.setdefault(room, []).append(number)
    return found


def drawn() -> str:
    """Return the picture."""
    ways = {colour: steps(title) for title, colour in WAYS.items()}
    parts, y = [], 12
    for number, layer in enumerate(layers(), start=1):
        if number > 1:
            parts.append(BAND.format(y, WIDTH - 8))
            y += 6
        parts.append(NAME.format(14, y + 14, "#6b7280", number))
        x = LEFT
        for room in layer:
            own = {c: " ".join(map(str, way[room])) for c, way in ways.items() if room in way}
            words = [(room, "#1c2430"), *((text, colour) for colour, text in own.items())]
            width = sum(len(text) * CHARACTER + GAP for text, _ in words) + GAP
            if x + width > WIDTH - 8:
                x, y = LEFT, y + ROW
            parts.append(ROOM.format(x, y, width, "#eef3fb" if own else "#f7f8fa"))
            at = x + GAP
            for text, colour in words:
                parts.append(NAME.format(at, y + 14, colour, text))
                at += len(text) * CHARACTER + GAP
            x += width + GAP
        y += ROW
    height = y + 6
    size = f'width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} style="{STYLE}">'
    frame = FRAME.format(WIDTH - 1, height - 1)
    return "\n".join([head, frame, *parts, "</svg>", ""])


if __name__ == "__main__":
    (Path(sys.argv[1]) / "architecture.svg").write_text(drawn(), "utf-8")
