from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from workbench.design import Problem
from workbench.schemas import load_model, load_shape
from workbench.sim import Robot


@pytest.fixture(scope="session")
def problem() -> Problem:
    """The thesis' problem, with hops of one second."""
    model, shape = load_model("thesis", Path()).content, load_shape("thesis-initial", Path())
    return Problem(model, shape.content, duration=1.0)


@pytest.fixture(scope="session")
def robot(problem: Problem) -> Robot:
    return problem.robot(problem.space.start)


@pytest.fixture(scope="session")
def changed(problem: Problem) -> Callable[..., Problem]:
    """The same problem with something else."""

    def change(**fields: object) -> Problem:
        return replace(problem, **fields)  # type: ignore[arg-type]

    return change
