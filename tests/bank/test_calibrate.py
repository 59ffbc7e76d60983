"""The table of confidences: what it learns, how it is read, and how far off it is."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.bank import calibrate
from benchmarks.bank.calibrate import Told, apart, learnt, told_of
from workbench.diagnose.confidence import TABLE, confidence


def drawn(seed: int, count: int) -> list[Told]:
    """Causes that are true half as often as their weight says."""
    rng = np.random.default_rng(seed)
    weights = rng.uniform(size=count)
    return [
        Told(k, "SET", float(w), bool(rng.uniform() < w / 2)) for k, w in enumerate(weights)
    ]  # fmt: skip


def test_shares_are_those_of_the_truth_and_rise_with_the_weight() -> None:
    told = drawn(1, 4000)
    table = learnt(told)
    weights, shares = [e.weight for e in table], [e.right for e in table]
    assert sum(e.causes for e in table) == len(told)
    assert weights == sorted(weights)
    assert shares == sorted(shares)
    for weight in (0.2, 0.5, 0.8):
        assert np.interp(weight, weights, shares) == pytest.approx(weight / 2, abs=0.08)
    fresh = drawn(2, 4000)
    right = [one.right for one in fresh]
    plain = apart([one.weight for one in fresh], right)
    mended = apart([float(np.interp(one.weight, weights, shares)) for one in fresh], right)
    assert plain == pytest.approx(0.25, abs=0.03)
    assert mended < 0.05


def test_few_cases_make_nobody_sure() -> None:
    told = [Told(k, "NAMED", 1.0, True) for k in range(4)]
    assert learnt(told) == [(1.0, 0.9, 4)]
    assert learnt([*told, Told(4, "NAMED", 0.999, False)]) == [(1.0, 0.75, 5)]
    assert learnt([*told, Told(4, "NAMED", 0.5, False)]) == [(0.5, 0.25, 1), (1.0, 0.9, 4)]


def line(seed: int, answer: str, expected: list[str], **weights: float) -> dict:
    causes = [{"effect": c, "confidence": 0.5, "weight": w} for c, w in weights.items()]
    label = {"expected": {"answers": ["NAMED"], "listed": expected, "named": expected}}
    return {"seed": seed, "answer": {"answer": answer, "causes": causes}, "label": label}


def test_causes_are_told_with_their_weight_and_truth() -> None:
    lines = [
        line(1, "NAMED", ["tether"], tether=0.97),
        line(2, "SET", ["tether"], sole_adhesion=0.6, tether=0.4),
        line(3, "DATA_FAULT", [], marker_offset=1.0),
        line(4, "DATA_FAULT", []),
        line(5, "CLEAN", []),
        {"seed": 6, "failed": "no answer"},
    ]
    assert told_of(lines) == [
        (1, "NAMED", 0.97, True), (2, "SET", 0.6, False), (2, "SET", 0.4, True),
        (3, "NAMED", 1.0, False),
    ]  # fmt: skip


def test_the_command_writes_a_table_and_tells_how_far_off_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line(k, "NAMED", ["tether"], tether=1.0) for k in range(3)]
    lines.append(line(4, "SET", ["tether"], tether=0.6, sole_adhesion=0.4))
    (tmp_path / "seed-9.jsonl").write_text("".join(json.dumps(one) + "\n" for one in lines))
    (tmp_path / "seed-9-flip-tether.jsonl").write_text("not read")
    table = tmp_path / "table.csv"
    words = ["calibrate", "--kept", str(tmp_path), "--table", str(table)]
    monkeypatch.setattr(sys, "argv", words)
    calibrate.main()
    assert table.read_text().splitlines() == [
        "answer,weight,right,causes",
        "NAMED,1.0000,0.875,3",
        "SET,0.4000,0.250,1",
        "SET,0.6000,0.750,1",
    ]
    said = capsys.readouterr().out
    assert "NAMED: 3 causes of 3 cases; off by 0.000 as weights, 0.167 as learnt" in said
    assert "SET: 2 causes of 1 cases; off by 0.400 as weights, 0.000 as learnt" in said


def test_the_table_that_is_shipped_can_be_read_and_is_no_more_sure_than_its_cases() -> None:
    with TABLE.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for answer in ("NAMED", "SET"):
        own = [row for row in rows if row["answer"] == answer]
        assert confidence(answer, 1.0) == pytest.approx(float(own[-1]["right"]))
        assert confidence(answer, 0.0) <= confidence(answer, 0.5) <= confidence(answer, 1.0)
        most = sum(int(row["causes"]) for row in own)
        assert confidence(answer, 1.0) <= (most + 0.5) / (most + 1)
    assert confidence("DATA_FAULT", 0.9) == confidence("NAMED", 0.9)
