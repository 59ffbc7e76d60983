"""The page of the architecture says what is true: its picture, its steps, the files they name."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from docs.make_architecture_picture import PAGE, WAYS, drawn, layers, steps

ROOT = Path(__file__).resolve().parents[1]
NAMED = sorted(set(re.findall(r"`(workbench/[\w/]+\.py):(\w+)`", PAGE.read_text("utf-8"))))


def test_the_picture_is_that_of_the_layers_and_the_steps() -> None:
    kept = (ROOT / "docs" / "pictures" / "architecture.svg").read_text("utf-8")
    assert kept == drawn(), "python docs/make_architecture_picture.py docs/pictures"
    assert len(kept) < 20_000


@pytest.mark.parametrize(("file", "name"), NAMED)
def test_what_a_step_names_is_defined_in_that_file(file: str, name: str) -> None:
    tree = ast.parse((ROOT / file).read_text("utf-8"))
    kinds = (ast.FunctionDef, ast.ClassDef)
    assert name in {node.name for node in ast.walk(tree) if isinstance(node, kinds)}


def test_each_way_has_ten_steps_through_rooms_that_the_picture_shows() -> None:
    rooms = {room for layer in layers() for room in layer}
    for title in WAYS:
        found = steps(title)
        assert {number for numbers in found.values() for number in numbers} == set(range(1, 11))
        assert set(found) - rooms == set()
