"""What the pages quote: commands, and what they say that a reader sees of them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

__all__ = ["Quoted", "commands", "section", "squeezed"]

_SHOWN = ("console", "sh")  # blocks that a reader types


@dataclass
class Quoted:
    """A command as it stands on a page.

    Args:
        line: the command.
        sees: lines below it, each of which the command must print somewhere.
    """

    line: str
    sees: list[str] = field(default_factory=list)


def commands(text: str) -> Iterator[Quoted]:
    """Yield the commands of a page's blocks `sh` and `console`, in order."""
    for kind, block in re.findall(r"^```(\w+)\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        if kind in _SHOWN:
            yield from _of_block(kind, block)


def _of_block(kind: str, block: str) -> Iterator[Quoted]:
    if kind == "sh":
        yield from (Quoted(line.partition("  #")[0].rstrip()) for line in block.splitlines())
        return
    found: list[Quoted] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append(Quoted(line[2:]))
        else:
            found[-1].sees.append(squeezed(line))
    yield from found


def section(page: Path, heading: str) -> str:
    """Return a page's text below a heading, as far as the next of its rank."""
    _, found, below = page.read_text("utf-8").partition(f"\n## {heading}\n")
    if not found:
        raise ValueError(f"{page} has no section {heading!r}")
    return below.partition("\n## ")[0]


def squeezed(text: str) -> str:
    """Return a text with single spaces, and without the lines that tables are drawn with."""
    return " ".join(re.sub(r"[│┃]", " ", text).split())
