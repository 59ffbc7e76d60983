"""However a supply is lost, it is said within a second, and it is off a second after it is back."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.losing import CASES, CLIENTS, KINDS, Case, lose_many, lose_one, table

pytestmark = [
    pytest.mark.xdist_group("alone"),  # what is told when is timed
    pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo terminals and POSIX signals"),
]

WAYS = {
    "silence": "riden tcp",
    "unplugged": "korad pty",
    "stalled": "riden pty",
    "flood": "scpi tcp",
    "damaged": "riden rtu-over-tcp",
    "foreign": "riden rtu-over-tcp",
    "slow": "korad tcp",
    "echo": "riden pty",
    "exception": "riden tcp",
}
SOME = [Case(kind, WAYS[kind], CLIENTS[k % 2]) for k, kind in enumerate(KINDS)]
"""One way a kind, the client alive or killed; one that hangs is in the second tier: its half second
of grace leaves a busy computer little of the second."""


def test_each_kind_of_loss_is_told_and_ends_with_the_output_off(tmp_path: Path) -> None:
    found = list(lose_many(SOME, tmp_path))
    print(table(found))
    assert [(str(one.case), one.output) for one in found if not one.right] == []


@pytest.mark.long
@pytest.mark.budget(60)
def test_every_kind_on_every_way_whatever_becomes_of_the_client(tmp_path: Path) -> None:
    found = list(lose_many(CASES, tmp_path))
    print(table(found))
    assert [(str(one.case), one.output) for one in found if not one.right] == []


@pytest.mark.long
@pytest.mark.parametrize("client", CLIENTS)
def test_a_supply_that_is_away_for_a_minute_is_switched_off_when_it_is_back(
    tmp_path: Path, client: str
) -> None:
    found = lose_one(Case("silence", "riden rtu-over-tcp", client), tmp_path, away_s=60.0)
    assert found.right, (found, found.output)
