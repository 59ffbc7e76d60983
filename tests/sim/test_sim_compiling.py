"""Compiled code is kept on disk, and compiled anew when anything that it was made from changes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from workbench.sim import compiling


def nothing() -> float:
    return 0.0


def kept_as(*offsets: int) -> str:
    compiling.callback(nothing, "float64()", offsets)
    return nothing.__qualname__


def test_the_same_code_is_kept_under_the_same_name() -> None:
    assert kept_as(8, 16) == kept_as(8, 16)
    assert compiling.callback(nothing, "float64()", (8, 16)).cache_hits == 1


def test_another_layout_is_another_name() -> None:
    assert kept_as(8, 16) != kept_as(8, 24)


def test_another_source_of_the_room_is_another_name(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    before = kept_as()
    copies = [Path(shutil.copy(source, tmp_path)) for source in compiling._SOURCES]
    monkeypatch.setattr(compiling, "_SOURCES", copies)
    assert kept_as() == before
    law = next(copy for copy in copies if copy.name == "ground.py")
    law.write_text(law.read_text("utf-8").replace("max(0.0 - p[14]", "max(1.0 - p[14]"), "utf-8")
    assert kept_as() != before
