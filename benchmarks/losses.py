"""Lose a supply in every way while it drives: what is said within what time, and when is it off?

    python -m benchmarks.losses            nine kinds, six ways, three states of the client
    python -m benchmarks.losses --quick    one way a kind, its client alive

from the top folder; see `tests/losing.py` for the stubs and for who measures.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from tests.losing import BAR_S, CASES, lose_many, table

__all__: list[str] = []


def main() -> None:
    """Lose, and print the table and what was not right."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", default="", help="cases with these words in their name")
    asked = parser.parse_args()
    cases = [case for case in CASES if asked.only in str(case)]
    if asked.quick:
        cases = [c for c in cases if (c.way, c.client) == ("riden rtu-over-tcp", "alive")]
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        found = list(lose_many(cases, Path(folder)))
    print(table(found))
    for one in found:
        if not one.right:
            print(one.case, *one.output, sep="\n    ")
    right = sum(one.right for one in found)
    print(f"bar {BAR_S:g} s: {right} of {len(found)} right; {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
