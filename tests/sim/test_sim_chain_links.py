"""Chains of a block are placed each by itself, by cosines that are those of the C library."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.sim.chain import LinkColumn
from workbench.sim.chain_links import COS, LANES, ROW, SIN, blocks_of, place_links

ROUNDING = 2.3e-16  # two units in the last place below 1


@pytest.mark.parametrize("most", [1e-9, 1.0, 1e3, 1e6])
def test_cosine_and_sine_of_any_turn_are_those_of_the_library(most: float) -> None:
    angles = np.random.default_rng(0).uniform(-most, most, (500, LANES))
    angles[:4, 0] = np.pi / 4 * np.array([1, 3, 5, -7])  # where one quarter turn ends
    block = np.zeros((1, ROW))
    for turned in angles:
        feet = np.zeros((LANES, 3))
        feet[:, 2] = turned
        place_links(block, feet, np.zeros((LANES, 3)), LANES)
        assert np.abs(block[0, COS : COS + LANES] - np.cos(turned)).max() < ROUNDING
        assert np.abs(block[0, SIN : SIN + LANES] - np.sin(turned)).max() < ROUNDING


def test_eleven_chains_make_two_blocks_with_a_lane_each() -> None:
    links = np.random.default_rng(1).standard_normal((11, 3, len(LinkColumn)))
    blocks = blocks_of(links)
    assert blocks.shape == (2, 3, ROW)
    for i, chain in enumerate(links):
        lane = blocks[i // LANES, :, i % LANES :: LANES][:, : len(LinkColumn)]
        assert np.array_equal(lane, chain)
    assert not blocks[1].reshape(3, -1, LANES)[:, :, 3:].any()  # lanes of no chain
