"""Results come in the order of the items, and the first error in that order is raised."""

from __future__ import annotations

import threading

import pytest

from workbench.errors import InputError
from workbench.tracking.parallel import parallel_map


def test_items_are_worked_on_at_once_and_kept_in_order() -> None:
    meeting = threading.Barrier(3, timeout=10)

    def late(item: int) -> int:
        meeting.wait()  # passes only when all three run
        return 10 * item

    assert list(parallel_map(late, (3, 1, 2))) == [30, 10, 20]


def test_the_first_error_in_order_is_raised() -> None:
    last_has_failed = threading.Event()

    def fails(item: int) -> None:
        if item == 1:
            last_has_failed.wait(timeout=10)
        else:
            last_has_failed.set()
        raise InputError(f"body {item} is never seen")

    with pytest.raises(InputError, match="body 1 is never seen"):
        list(parallel_map(fails, (1, 2)))


def test_nothing_is_made_of_no_items() -> None:
    assert list(parallel_map(len, ())) == []
