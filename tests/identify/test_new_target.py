"""Results of one day are numbered; what was asked for by name is never overwritten."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.errors import InputError
from workbench.identify import new_target


def files(target: Path) -> list[Path]:
    return [target, target.with_suffix(".html")]


def test_a_second_result_of_a_day_is_numbered(tmp_path: Path) -> None:
    named = tmp_path / "thesis-2026-11-27.yaml"
    assert new_target(None, named, files) == named
    named.touch()
    second = tmp_path / "thesis-2026-11-27-2.yaml"
    assert new_target(None, named, files) == second
    second.with_suffix(".html").touch()  # of a result whose file was moved away
    assert new_target(None, named, files).name == "thesis-2026-11-27-3.yaml"


def test_a_name_that_was_given_is_refused_where_it_is_taken(tmp_path: Path) -> None:
    out = tmp_path / "mine.yaml"
    out.with_suffix(".html").touch()
    with pytest.raises(InputError, match=r"mine\.html: exists and is never overwritten"):
        new_target(out, tmp_path / "other.yaml", files)
