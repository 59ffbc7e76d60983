"""The picture of an output's states is what the fold says."""

from __future__ import annotations

import runpy
from pathlib import Path


def test_the_picture_is_drawn_from_the_fold(root: Path) -> None:
    drawn = (root / "docs" / "pictures" / "output.svg").read_text(encoding="utf-8")
    picture = runpy.run_path(str(root / "docs" / "make_output_picture.py"))["picture"]
    assert drawn == picture(), "draw it again: python docs/make_output_picture.py docs/pictures"
