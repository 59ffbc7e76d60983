"""One photograph that many tests read, and changed copies of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.photo.rendering import Scene, random_scene, render

SIZE = (1600, 1200)

Picture = NDArray[np.uint8]


@pytest.fixture(scope="session")
def scene() -> Scene:
    """A strip along the foot line, a few degrees off at each joint."""
    return random_scene(3, SIZE, np.radians(2.0), aligned=True, glare=4)


@pytest.fixture(scope="session")
def photo(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("photo") / "strip.jpg"
    path.write_bytes(render(scene))
    return path


@pytest.fixture
def changed(photo: Path, tmp_path: Path) -> Callable[[Callable[[Picture], Picture]], Path]:
    """The photograph after a change of its pixels."""

    def change(how: Callable[[Picture], Picture]) -> Path:
        picture = how(np.asarray(cv2.imread(str(photo)), dtype=np.uint8))
        path = tmp_path / "changed.png"
        path.write_bytes(cv2.imencode(".png", np.ascontiguousarray(picture))[1].tobytes())
        return path

    return change


@pytest.fixture
def taken(scene: Scene, tmp_path: Path) -> Callable[..., Path]:
    """A photograph of the scene with something else about it."""

    def take(**changes: object) -> Path:
        path = tmp_path / "other.jpg"
        path.write_bytes(render(replace(scene, **changes)))  # type: ignore[arg-type]
        return path

    return take
