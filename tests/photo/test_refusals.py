"""Photographs that cannot be read are refused with what to do."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.photo.conftest import Picture
from tests.photo.rendering import TARGET
from workbench.errors import InputError
from workbench.photo import find_board, read_photo, write_board

Changed = Callable[[Callable[[Picture], Picture]], Path]
Taken = Callable[..., Path]


def refuse(path: Path, match: str, **how: str) -> None:
    with pytest.raises(InputError, match=match):
        read_photo(path, TARGET, **how)  # type: ignore[arg-type]


def test_a_photo_without_markers(taken: Taken) -> None:
    refuse(taken(without="markers"), "no markers are seen; lay the strip on the board")


def test_too_few_markers(changed: Changed) -> None:
    def cover(picture: Picture) -> Picture:
        picture[:, 260:] = 90
        return picture

    refuse(changed(cover), "markers are seen, .* are needed|corners are seen, too few")


@pytest.mark.long
def test_half_a_board(changed: Changed) -> None:
    refuse(changed(lambda p: p[:, : p.shape[1] * 6 // 10]), "too few or all on one side")


def test_markers_of_another_board(changed: Changed) -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)

    def other(picture: Picture) -> Picture:
        picture[:] = 255
        for k in range(20):
            marker = cv2.aruco.generateImageMarker(dictionary, 900 + k, 60)
            x, y = 60 + 130 * (k % 10), 100 + 300 * (k // 10)
            picture[y : y + 60, x : x + 60] = marker[..., None]
        return picture

    refuse(changed(other), "the 20 markers seen are of another board; print one with")


def test_markers_of_this_board_in_other_places(changed: Changed) -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)

    def shuffled(picture: Picture) -> Picture:
        picture[:] = 255
        for k in range(40):
            marker = cv2.aruco.generateImageMarker(dictionary, (37 * k) % 160, 60)
            x, y = 60 + 130 * (k % 10), 100 + 200 * (k // 10)
            picture[y : y + 60, x : x + 60] = marker[..., None]
        return picture

    refuse(changed(shuffled), "do not lie as on the board for A3; .* tape it to a plate")


def test_a_strip_over_the_border(taken: Taken) -> None:
    refuse(taken(place=(0.19, 0.2)), "cut off at the field's border; lay all of it")


@pytest.mark.long
def test_a_blurred_photo(changed: Changed) -> None:
    refuse(changed(lambda p: np.asarray(cv2.GaussianBlur(p, (0, 0), 9), np.uint8)), "is blurred")


def test_no_strip(taken: Taken) -> None:
    refuse(taken(without="strip"), "no strip is found on the dark field; .*--tape")


def test_a_strip_of_another_length(photo: Path) -> None:
    long = TARGET.model_copy(update={"length": 0.9})
    with pytest.raises(InputError, match="mm of strip are seen, 900 mm are expected"):
        read_photo(photo, long)


def test_a_mirrored_photo(changed: Changed) -> None:
    refuse(changed(lambda p: p[:, ::-1]), "is mirrored; turn off the camera's mirroring")


def test_a_curled_paper(changed: Changed) -> None:
    def curl(picture: Picture) -> Picture:
        rows, columns = picture.shape[:2]
        x, y = np.meshgrid(np.arange(columns), np.arange(rows))
        wave = y + 6 * np.sin(x / columns * 9)
        maps = x.astype(np.float32), wave.astype(np.float32)
        return np.asarray(cv2.remap(picture, *maps, cv2.INTER_LINEAR), np.uint8)

    refuse(changed(curl), "mm rms off after the lens is straightened .* tape the paper flat")


def test_what_is_no_picture(tmp_path: Path) -> None:
    path = tmp_path / "notes.jpg"
    path.write_text("no picture")
    refuse(path, "is not a picture that can be read; save it as JPEG or PNG")
    refuse(tmp_path / "missing.jpg", "cannot be read: No such file")


@pytest.mark.long
def test_a_shape_alike_from_both_ends(photo: Path) -> None:
    circle = TARGET.model_copy(update={"angles": (-2.5, *[0.2] * 15)})
    with pytest.raises(InputError, match="cannot be distinguished"):
        read_photo(photo, circle)


def test_an_unknown_tape(photo: Path) -> None:
    refuse(photo, "tape 'pink' is not known; it is one of none, blue", tape="pink")


def test_without_the_extra(photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    refuse(photo, r"pip install hopping-workbench\[photo\]")
    with pytest.raises(InputError, match=r"pip install hopping-workbench\[photo\]"):
        write_board(tmp_path / "board.pdf", find_board("A3"))
