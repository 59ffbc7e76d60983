"""Over a wire that loses, delays, repeats and spoils no wrong reading is ever accepted.

The supplies are stubs that share no table with the drivers: `foreign.py`.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

PROGRAM = Path(__file__).resolve().parents[2] / "benchmarks" / "wire.py"
FIRST, FULL = 2_000, 100_000  # disturbed exchanges a family


def _wire() -> ModuleType:
    spec = importlib.util.spec_from_file_location("wire", PROGRAM)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["wire"] = module  # dataclasses look it up
    spec.loader.exec_module(module)
    return module


wire = _wire()
each_stub = pytest.mark.parametrize("model", wire.STUBS)


def none_is_wrong(model: str, faults: int) -> None:
    """Read with this many disturbed exchanges; those of a family are shared by its stubs."""
    family = wire.STUBS[model][0]
    own = faults // sum(other == family for other, _ in wire.STUBS.values())
    score = wire.read_supply(model, own)
    assert score.wrong == 0
    assert score.accepted > own // 8
    assert set(score.faults) == set(wire.KINDS)
    assert min(score.faults.values()) > own // 20  # each kind was there


@each_stub
def test_no_wrong_reading_is_accepted(model: str) -> None:
    none_is_wrong(model, FIRST)


@each_stub
@pytest.mark.long
def test_no_wrong_reading_is_accepted_at_full_length(model: str) -> None:
    none_is_wrong(model, FULL)


def test_the_count_notices_a_channel_that_was_not_selected(monkeypatch: pytest.MonkeyPatch) -> None:
    never = property(lambda line: "", lambda line, command: None)
    monkeypatch.setattr("workbench.hw.line.Line.selection", never)
    assert wire.read_supply("HMP4040", 100).wrong > 10
