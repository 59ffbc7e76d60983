"""The page of supplies is the table's."""

from __future__ import annotations

import runpy
from pathlib import Path


def test_the_page_is_what_the_table_says(root: Path) -> None:
    written = (root / "docs" / "reference" / "supplies.md").read_text(encoding="utf-8")
    page = runpy.run_path(str(root / "docs" / "make_supplies.py"))["page"]
    assert written == page(), "write it again: python docs/make_supplies.py"
