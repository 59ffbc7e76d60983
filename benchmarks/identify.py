"""Four parameters from clamped runs and ring-downs: ours beside the peer and the thesis.

    python benchmarks/identify.py [--quick]
    python benchmarks/identify.py --repeats 100 [--increments 40] [--log FILE]

The first prints one table of methods on the same data. The second draws many robots and counts how
often our intervals cover the truth; with --log it goes on where it was stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from identify_repeats import Setting, print_repeats

RUN_S, QUICK_RUN_S = 10.0, 3.0


def main() -> None:
    """Print the table of methods, or that of repeats."""
    parser = argparse.ArgumentParser(description="Compare methods that find k, kT, d and dT.")
    parser.add_argument("--quick", action="store_true", help=f"runs of {QUICK_RUN_S:g} s")
    parser.add_argument("--repeats", type=int, default=0, help="robots drawn, ours only")
    parser.add_argument("--increments", type=int, default=16, help="of the true beam")
    parser.add_argument("--log", type=Path, help="file of one JSON line a repeat, to go on from")
    given = parser.parse_args()
    seconds = QUICK_RUN_S if given.quick else RUN_S
    if given.repeats:
        print_repeats(given.repeats, Setting(given.increments, seconds), given.log)


if __name__ == "__main__":
    main()
