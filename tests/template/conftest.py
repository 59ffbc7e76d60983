"""The thesis' strip and its templates, which several files here look at."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from functools import cache
from pathlib import Path

import pytest

from workbench.schemas import Document, ShapeFile, load_shape, parse
from workbench.template import (
    Compensation,
    Strip,
    TemplatePages,
    make_sheet,
    make_strip,
    paper_named,
)

DAY = date(2026, 11, 21)
THICKNESS_M = 0.002

MakeSheet = Callable[..., TemplatePages]


@pytest.fixture(scope="session")
def thesis() -> Document[ShapeFile]:
    return load_shape("thesis-initial", Path())


@pytest.fixture(scope="session")
def strip(thesis: Document[ShapeFile]) -> Strip:
    return make_strip(thesis, THICKNESS_M)


@pytest.fixture(scope="session")
def sheet(strip: Strip) -> MakeSheet:
    """Make the thesis' template, each only once."""

    @cache
    def make(
        paper: str,
        mirror: bool = False,
        roll_width: float | None = None,
        compensation: Compensation = Compensation(),  # noqa: B008 # a constant
    ) -> TemplatePages:
        return make_sheet(strip, paper_named(paper, roll_width), DAY, mirror, compensation)

    return make


@pytest.fixture
def shape(thesis: Document[ShapeFile]) -> Callable[..., Document[ShapeFile]]:
    """Make a shape like the thesis' with other entries."""

    def make(**entries: object) -> Document[ShapeFile]:
        listed = {
            "schema": "workbench/shape-1",
            "name": "bent",
            "angles": list(thesis.content.angles),
            "length": "615.008 mm",
            "state": "unloaded",
            "source": "a test",
        }
        text = "".join(f"{key}: {value}\n" for key, value in (listed | entries).items())
        return parse(Path("bent.yaml"), text, ShapeFile)

    return make
