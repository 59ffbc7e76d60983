"""What the bank's tests share: the thesis' robot in both engines."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.bank.rod import Rod
from workbench.schemas import ModelFile, ShapeFile, load_model, load_shape


@pytest.fixture(scope="session")
def model() -> ModelFile:
    return load_model("thesis", Path()).content


@pytest.fixture(scope="session")
def shape() -> ShapeFile:
    return load_shape("thesis-initial", Path()).content


@pytest.fixture(scope="session")
def rod(model: ModelFile, shape: ShapeFile) -> Rod:
    """The thesis' robot as the independent engine has it."""
    return Rod(model.values(), shape.angles, shape.length)
