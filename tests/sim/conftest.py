from __future__ import annotations

from pathlib import Path

import pytest

from workbench.schemas import load_model, load_shape
from workbench.sim import Robot, make_robot


@pytest.fixture(scope="session")
def robot() -> Robot:
    """The thesis' robot."""
    shape = load_shape("thesis-initial", Path()).content
    return make_robot(load_model("thesis", Path()).content.values(), shape)
