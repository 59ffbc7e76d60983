"""Over a wire that loses, delays, repeats and spoils no wrong reading is ever accepted."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

PROGRAM = Path(__file__).resolve().parents[2] / "benchmarks" / "wire.py"


@pytest.fixture(scope="module")
def wire() -> ModuleType:
    spec = importlib.util.spec_from_file_location("wire", PROGRAM)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["wire"] = module  # dataclasses look it up
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("seed", [1, 2])
def test_no_wrong_register_is_accepted(wire: ModuleType, seed: int) -> None:
    score = wire.read_registers(3000, seed)
    assert score.wrong == 0
    assert score.accepted > 2000
    assert min(score.faults.values()) > 50  # each kind was there


@pytest.mark.parametrize("model", ["RD6012P", "DPH5005", "HM310P", "72-2540", "DP832", "SPE6103"])
def test_no_wrong_reading_is_accepted(wire: ModuleType, model: str) -> None:
    score = wire.read_supply(model, 1000)
    assert score.wrong == 0
    assert score.accepted > 40
    assert min(score.faults.values()) > 20
