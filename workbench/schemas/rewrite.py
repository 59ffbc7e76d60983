"""A changed copy of a YAML file: the given one stays as it is, its comments are kept."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap

from workbench.errors import InputError
from workbench.schemas.files import Document, parse
from workbench.schemas.section import Section

__all__ = ["rounded", "write_changed"]

S = TypeVar("S", bound=Section)

_WIDTH = 10_000  # characters: no line of the given file is broken anew


def write_changed(
    path: Path, stated: Document[S], kind: str, change: Callable[[CommentedMap], None]
) -> Document[S]:
    """Write a changed copy of a file, checked like any other, and return it as read back.

    Args:
        path: of the new file.
        stated: the file as it is.
        kind: what it is called in messages.
        change: changes the tree in place.

    Raises:
        InputError: when the new file exists.
        FileFaults: when the changed content does not fit its schema; nothing is written then.
    """
    if path.exists():
        raise InputError(f"{path}: exists; a {kind} is never changed, give another --out")
    yaml = YAML()
    yaml.width = _WIDTH
    tree = yaml.load(stated.text)
    change(tree)
    stream = io.StringIO()
    yaml.dump(tree, stream)
    document = parse(path, stream.getvalue(), type(stated.content))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(stream.getvalue(), encoding="utf-8")
    return document


def rounded(value: float, digits: int = 6) -> float:
    """Return a number with so many significant digits."""
    return float(f"{value:.{digits}g}")
