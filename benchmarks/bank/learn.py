"""Learn from answers that are kept how often each kind of answer is right.

    python -m benchmarks.bank.learn --seeds 40

Write `workbench/diagnose/confidence.json`. Its seeds are not those that the page of scores judges
stated confidences by.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from pathlib import Path

import workbench
from benchmarks.bank.kept import kept
from benchmarks.bank.score import Judged, judge

__all__ = ["LEARNT", "learn", "learnt"]

LEARNT = Path(workbench.__file__).parent / "diagnose" / "confidence.json"


def learnt(answers: Iterable[Judged]) -> dict[str, list[int]]:
    """Return kind of answer -> how many were right, and how many there are.

    A SET, or a PARTIAL, which says that something else is wrong as well, is right where the true
    causes are among those that it lists.
    """
    found: dict[str, list[int]] = {}
    for one in answers:
        right = one.right or (one.verdict in ("SET", "PARTIAL") and one.listed)
        before = found.setdefault(one.verdict, [0, 0])
        found[one.verdict] = [before[0] + right, before[1] + 1]
    return dict(sorted(found.items()))


def learn(folder: Path, seeds: Iterable[int]) -> str:
    """Return the text of the file that draws of some seeds make.

    Args:
        folder: of the lines that are kept.
        seeds: of the draws.
    """
    chosen = sorted(seeds)
    lines = [one for seed in chosen for one in kept(folder / f"seed-{seed}.jsonl").values()]
    answers = learnt(judge(one["answer"], one["label"], one) for one in lines if "answer" in one)
    return json.dumps({"seeds": chosen, "answers": answers}, indent=1) + "\n"


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bank.learn", description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--kept", type=Path, default=Path("docs/reference/bank"))
    asked = parser.parse_args()
    LEARNT.write_text(learn(asked.kept, asked.seeds), encoding="utf-8")
    print(LEARNT.read_text(encoding="utf-8"), end="")


if __name__ == "__main__":
    main()
