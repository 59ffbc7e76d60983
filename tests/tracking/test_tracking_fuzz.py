"""Whatever the bytes, the reader gives the right answer, or refuses with line and cause."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from fuzzing import FLAVOURS, base_export, check, fuzz
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mutations import KNOWN

FILES = 200


OFTEN = ("row_1.1", "motive_1.21", "motive_1.23")
OTHERS = [pytest.param(one, marks=pytest.mark.long) for one in FLAVOURS if one not in OFTEN]


@pytest.mark.budget(25)  # compiles the reader where no cache is kept
@pytest.mark.parametrize("flavour", [*OFTEN, *OTHERS])
def test_changed_exports_are_read_rightly_or_refused_with_a_cause(
    flavour: str, tmp_path: Path
) -> None:
    outcomes = [(name, outcome) for name, _, outcome in fuzz(flavour, "test", FILES, tmp_path)]
    assert [(name, outcome) for name, outcome in outcomes if outcome.faults] == []
    # the test is worth something only while every change occurs and both outcomes are common
    assert KNOWN.keys() < Counter(name for name, _ in outcomes).keys()
    for kind in (outcomes, [o for o in outcomes if o[0] == "blind"]):
        assert 0.03 < sum(o.cause == "read" for _, o in kind) / len(kind) < 0.95


@pytest.mark.parametrize("flavour", ["row_1.1", "motive_1.23"])
def test_cut_exports_are_read_with_a_warning_or_refused(flavour: str, tmp_path: Path) -> None:
    text = base_export(flavour).text()
    for length in range(1, len(text), max(1, len(text) // 300)):
        found, faults = check(tmp_path / "x.csv", text[:length])
        assert faults == []
        assert isinstance(found, str) or found.warnings


@settings(
    max_examples=200,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(
    head=st.sampled_from([b"", b"comment,", b"frame,", b"Format Version,1.23\n"]), tail=st.binary()
)
def test_any_bytes_are_read_alike_by_both_readers_or_refused(
    tmp_path_factory: pytest.TempPathFactory, head: bytes, tail: bytes
) -> None:
    _, faults = check(tmp_path_factory.getbasetemp() / "any.csv", head + tail)
    assert faults == []
