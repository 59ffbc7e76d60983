"""Learn how often causes of some weight are true, from all cases that the bank keeps.

    python -m benchmarks.bank.calibrate

Writes the table that `workbench diagnose` takes its confidences from, and prints how far off stated
confidences are (expected calibration error in ten bins): plain weights, and shares learnt from all
other cases. A draw that is answered later judges the table.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import isotonic_regression

from benchmarks.bank.kept import kept
from benchmarks.bank.one_case import Line
from benchmarks.bank.score import judge
from workbench.diagnose.confidence import TABLE

__all__ = ["Entry", "Told", "apart", "elsewhere", "learnt", "told_of"]

_BINS = 10
_DIGITS = 2
_UNKNOWN = 0.5  # cases right and cases wrong that are added to each share (Jeffreys)


class Told(NamedTuple):
    """A cause that was told of a case: with which weight, and whether it was a true one."""

    case: int
    answer: str
    weight: float
    right: bool


class Entry(NamedTuple):
    """One row of the table."""

    weight: float
    right: float
    causes: int


def told_of(lines: Iterable[Line]) -> list[Told]:
    """Return all causes that answers named or listed as one of a set."""
    found = []
    for line in lines:
        if "answer" not in line:
            continue
        one = judge(line["answer"], line["label"])
        truth = {*one.expects("named"), *one.expects("listed")}
        answer = "NAMED" if one.names else one.verdict
        if answer in ("NAMED", "SET"):
            found += [
                Told(line["seed"], answer, cause.get("weight", cause["confidence"]),
                     cause["effect"] in truth)
                for cause in line["answer"]["causes"]
            ]  # fmt: skip
    return found


def learnt(told: Sequence[Told]) -> list[Entry]:
    """Return shares that rise with the weight, each with half a case right and half a case wrong.

    Neighbours whose shares do not rise are pooled (isotonic regression); pools whose shares, with
    what is added, do not rise either share one. Weights count to two digits.
    """
    right: dict[float, list[bool]] = {}
    for one in sorted(told, key=lambda one: one.weight):
        right.setdefault(round(one.weight, _DIGITS), []).append(one.right)
    causes = np.array([len(each) for each in right.values()])
    shares = np.array([np.mean(each) for each in right.values()])
    starts = isotonic_regression(shares, weights=causes).blocks[:-1]
    pooled = np.add.reduceat(causes, starts)
    hits = np.add.reduceat(causes * shares, starts)
    means = np.add.reduceat(causes * np.array(list(right)), starts) / pooled
    rising = isotonic_regression((hits + _UNKNOWN) / (pooled + 2 * _UNKNOWN), weights=pooled).x
    return [
        Entry(float(weight), float(share), int(count))
        for weight, share, count in zip(means, rising, pooled, strict=True)
    ]


def apart(stated: Sequence[float], right: Sequence[bool]) -> float:
    """Return the expected calibration error of confidences, in ten bins."""
    bins = np.minimum((np.asarray(stated) * _BINS).astype(int), _BINS - 1)
    gaps = np.asarray(right, dtype=np.float64) - np.asarray(stated)
    return float(sum(abs(gaps[bins == k].sum()) for k in range(_BINS)) / max(len(bins), 1))


def elsewhere(told: Sequence[Told]) -> list[float]:
    """Return what is learnt of each cause's weight from all other cases; of none, half.

    Args:
        told: of one kind of answer.
    """
    found = []
    for one in told:
        others = [other for other in told if other.case != one.case]
        entries = learnt(others) if others else [Entry(one.weight, 0.5, 0)]
        weights, shares = [e.weight for e in entries], [e.right for e in entries]
        found.append(float(np.interp(one.weight, weights, shares)))
    return found


def main() -> None:
    """Write the table that the command line asks for."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.bank.calibrate", description=__doc__
    )
    parser.add_argument("--kept", type=Path, default=Path("docs/reference/bank"))
    parser.add_argument("--table", type=Path, default=TABLE)
    asked = parser.parse_args()
    draws = sorted(log for log in asked.kept.glob("seed-*.jsonl") if "-flip-" not in log.name)
    told = told_of(line for draw in draws for line in kept(draw).values())
    with asked.table.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(("answer", "weight", "right", "causes"))
        for answer in ("NAMED", "SET"):
            own = [one for one in told if one.answer == answer]
            if not own:
                parser.error(f"no case of {asked.kept} was answered {answer}")
            for entry in learnt(own):
                rows.writerow((answer, f"{entry.weight:.4f}", f"{entry.right:.3f}", entry.causes))
            right = [one.right for one in own]
            print(
                f"{answer}: {len(own)} causes of {len({one.case for one in own})} cases; off by "
                f"{apart([one.weight for one in own], right):.3f} as weights, "
                f"{apart(elsewhere(own), right):.3f} as learnt from other cases"
            )
    print(f"the table is {asked.table}")


if __name__ == "__main__":
    main()
