"""The printed board carries what the reader expects, at 1:1."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
from pypdf import PdfReader

from workbench.errors import InputError
from workbench.photo import BOARDS, find_board, write_board
from workbench.photo.markers import find_corners

DPI = 200
PX_PER_M = DPI / 0.0254


@pytest.mark.parametrize("paper", BOARDS)
def test_the_pdf_is_at_1_to_1_and_says_so(paper: str, tmp_path: Path) -> None:
    board, path = find_board(paper), tmp_path / "board.pdf"
    write_board(path, board)
    pages = PdfReader(path).pages
    assert len(pages) == board.sheets + 1
    size = np.array([float(pages[0].mediabox.width), float(pages[0].mediabox.height)])
    assert size / 72 * 0.0254 == pytest.approx(np.array(board.sheet_size), abs=1e-5)
    text = "".join(page.extract_text() for page in pages)
    assert "H, measure this: must be 200.0 mm" in text
    assert f"must be {1000 * board.size[1] / board.sheets:.1f} mm" in text
    assert PdfReader(path).trailer["/Root"]["/ViewerPreferences"]["/PrintScaling"] == "/None"  # type: ignore[index]


@pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="needs poppler")
def test_the_reader_finds_the_printed_corners(tmp_path: Path) -> None:
    board, path = find_board("A3"), tmp_path / "board.pdf"
    write_board(path, board)
    subprocess.run(
        ["pdftoppm", "-r", str(DPI), "-l", "1", "-gray", path, tmp_path / "page"], check=True
    )
    grey = cv2.imread(str(next(tmp_path.glob("page*.pgm"))), cv2.IMREAD_GRAYSCALE)
    assert grey is not None
    seen = find_corners("page", np.asarray(grey, dtype=np.uint8))
    assert seen.board is board
    assert len(seen.number) == len(board.corners)
    places = board.corners[seen.number]
    margin = (np.array(board.sheet_size) - board.size) / 2
    down = [1.0, -1.0] * (places + margin) + [0.0, board.sheet_size[1]]
    assert (seen.pixels + 0.5) / PX_PER_M == pytest.approx(down, abs=1e-4)


def test_no_marker_serves_two_boards() -> None:
    numbers = [
        set(range(board.first_marker, board.first_marker + len(board.marked)))
        for board in BOARDS.values()
    ]
    assert not numbers[0] & numbers[1]
    assert max(max(one) for one in numbers) < 1000


def test_corners_keep_off_the_joint() -> None:
    board = find_board("a4")
    joint = board.square * board.rows_a_sheet
    assert np.abs(board.corners[:, 1] - joint).min() > board.square / 2
    assert set(board.corner_sheets) == {0, 1}
    low, high = board.field
    assert (high - low >= [0.21, 0.362]).all()


def test_an_unknown_paper_is_refused() -> None:
    with pytest.raises(InputError, match=r"no board for paper 'A5'.*there are A3, A4"):
        find_board("A5")
