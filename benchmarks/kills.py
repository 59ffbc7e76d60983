"""How long an output stays on after its client was killed, and what is said when both are.

    python -m benchmarks.kills           100 clients, four signals: until the output is off
    python -m benchmarks.kills --both    200 clients and guardians: is what is said then so?

from the top folder; see `tests/killing.py` for what a client is and who measures.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from tests.killing import (
    BAR_S,
    SIGNALS,
    both_table,
    kill_both_many,
    kill_many,
    random_instants,
    table,
)

__all__: list[str] = []


def main() -> None:
    """Kill, and print the distribution."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=8)
    parser.add_argument("--quick", action="store_true", help="four kills")
    parser.add_argument("--both", action="store_true", help="kill client and guardian at once")
    asked = parser.parse_args()
    if asked.both:
        _both(asked.quick, asked.seed)
        return
    count = len(SIGNALS) if asked.quick else asked.kills
    names = [SIGNALS[i % len(SIGNALS)] for i in range(count)]
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        found = kill_many(names, random_instants(count, asked.seed), Path(folder))
    print(table(found))
    late = sum(killed.off_s > BAR_S for killed in found)
    print(f"bar {1000 * BAR_S:.0f} ms: {late} late; {time.monotonic() - began:.0f} s")


def _both(quick: bool, seed: int) -> None:
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        found = kill_both_many(8 if quick else 200, seed, Path(folder))
    print(both_table(found))
    right = sum(one.right for one in found)
    print(f"{right} of {len(found)} right; {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
