"""How long an output stays on after its client was killed, as a table: 100 clients, four signals.

    python -m benchmarks.kills

from the top folder; see `tests/killing.py` for what a client is and who measures.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from tests.killing import BAR_S, SIGNALS, kill_many, random_instants, table

__all__: list[str] = []


def main() -> None:
    """Kill, and print the distribution."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=8)
    parser.add_argument("--quick", action="store_true", help="four kills")
    asked = parser.parse_args()
    count = len(SIGNALS) if asked.quick else asked.kills
    names = [SIGNALS[i % len(SIGNALS)] for i in range(count)]
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        found = kill_many(names, random_instants(count, asked.seed), Path(folder))
    print(table(found))
    late = sum(killed.off_s > BAR_S for killed in found)
    print(f"bar {1000 * BAR_S:.0f} ms: {late} late; {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
