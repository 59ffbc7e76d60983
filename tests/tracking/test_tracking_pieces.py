"""Rows that lie apart read as one text, whatever the size of the blocks."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.tracking.pieces import Pieces
from workbench.tracking.rectangle import read_rectangle

ROWS = [b'frame,%d,"a"\r\n' % k for k in range(200)]
DATA = b"other\n".join(ROWS)
BEGINS = np.cumsum([0, *(len(row) + len(b"other\n") for row in ROWS[:-1])]).astype(np.intp)
ENDS = BEGINS + np.array([len(row) for row in ROWS], dtype=np.intp)


def pieces() -> Pieces:
    return Pieces(DATA, BEGINS, ENDS)


@pytest.mark.parametrize("size", [-1, 1, 17, 100, 10_000])
def test_the_pieces_come_whole_and_in_order(size: int) -> None:
    stream, blocks = pieces(), []
    while block := stream.read(size):
        assert block.endswith(b"\n")
        assert len(block) <= max(size, len(ROWS[-1])) or size < 0
        blocks.append(block)
    assert b"".join(blocks) == b"".join(ROWS)
    assert stream.read(size) == b""
    assert stream.quotes == 2 * len(ROWS)


def test_the_first_row_is_told_without_moving_on() -> None:
    stream = pieces()
    stream.read(50)
    assert stream.first_row() == ROWS[0].rstrip(b"\n")
    assert stream.read(20) == ROWS[3]


def test_pieces_are_read_like_the_joined_text() -> None:
    apart = read_rectangle(pieces(), 3, [1], [0, 2])
    joined = read_rectangle(b"".join(ROWS), 3, [1], [0, 2])
    assert apart is not None
    assert joined is not None
    np.testing.assert_array_equal(apart.numbers, joined.numbers)
    assert apart.words[1].vocabulary == joined.words[1].vocabulary == ("a",)


def test_a_quote_within_a_cell_is_declined_in_pieces_too() -> None:
    text = b'frame,1,"a"\nframe,2,b"c\n'
    assert (
        read_rectangle(Pieces(text, np.array([0, 12]), np.array([12, 24])), 3, [1], [0, 2]) is None
    )


def test_a_piece_larger_than_a_block_is_read() -> None:
    row = b"7,0.125\n"
    text = row * 700_000  # 5.6 MB; blocks have 4 MB
    found = read_rectangle(Pieces(text, np.array([0]), np.array([len(text)])), 2, [0, 1])
    assert found is not None
    assert found.numbers.shape == (2, 700_000)
    assert (found.numbers == [[7.0], [0.125]]).all()
