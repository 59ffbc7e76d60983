"""Four parameters from clamped runs and ring-downs: ours beside the peer and the thesis.

    python benchmarks/identify.py [--quick] [--seed 0]
    python benchmarks/identify.py --repeats 100 [--increments 40] [--log FILE] [--processes 1]

The first prints one table of methods on the same data: five clamped runs and three ring-downs of a
robot whose parameters are off by up to 30 %, every coordinate with 0.3 mm of noise. All start from
the stated values and stay within a third and three times of them; the thesis' criterion has its own
start and bounds. The peer and the plain fit are given the true lag of the motor, the true starts
and the true pulls; ours finds them. The peer is mujoco.sysid: pip install hopping-workbench[sysid].

The second draws many robots and counts how often our intervals cover the truth; with --log it goes
on where it was stopped.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

from identify_methods import NOT_INSTALLED, Row, ours, plain, thesis
from identify_peer import installed, peer
from identify_repeats import SHORT, Setting, print_repeats
from identify_truth import NAMES, PULLS_N, SPEEDS_RAD_S, Take, Truth, drawn, taken

RUN_S = 10.0
QUICK_RUN_S, QUICK_SPEEDS_RAD_S, QUICK_PULLS_N = 1.5, (11.0, 15.0), (0.4,)
ITERATIONS, QUICK_ITERATIONS = 100, 1  # of the thesis' criterion
WINDOWS_S = (1.0, 2.5, 6.0)
"""What the peer is led through by hand before whole runs; ours goes the same way by itself."""


def main() -> None:
    """Print the table of methods, or that of repeats."""
    parser = argparse.ArgumentParser(description="Compare methods that find k, kT, d and dT.")
    parser.add_argument("--quick", action="store_true", help=f"few runs of {QUICK_RUN_S:g} s")
    parser.add_argument("--seed", type=int, default=0, help="of the robot drawn")
    parser.add_argument("--repeats", type=int, default=0, help="robots drawn, ours only")
    parser.add_argument("--increments", type=int, default=16, help="of the true beam")
    parser.add_argument("--log", type=Path, help="file of one JSON line a repeat, to go on from")
    parser.add_argument("--processes", type=int, default=2, help="repeats done at a time")
    given = parser.parse_args()
    seconds = QUICK_RUN_S if given.quick else RUN_S
    if given.repeats:
        print_repeats(given.repeats, Setting(given.increments, seconds), given.log, given.processes)
    else:
        print_methods(drawn(given.seed, given.increments), seconds, given.quick)


def print_methods(truth: Truth, seconds: float, quick: bool) -> None:
    """Print a row as each method ends, then what each of them said."""
    print(
        f"robot {truth.seed}, {truth.robot.increments} increments, runs of {seconds:g} s; truth: "
    )
    print("  " + ", ".join(f"{name} {truth.values[name]:.5g}" for name in NAMES))
    head = "".join(f"{SHORT[name] + ' err %':>11}" for name in NAMES)
    print(f"\n{'method':33}{head}{'covered':>9}{'seconds':>9}{'simulations':>13}  what it reports")
    runs = (QUICK_SPEEDS_RAD_S, QUICK_PULLS_N) if quick else (SPEEDS_RAD_S, PULLS_N)
    rows = []
    for row in _rows(taken(truth, seconds, *runs), seconds, quick):
        rows.append(row)
        _print_row(row, truth)
    for row in rows:
        if row.words:
            print(f"\n{row.method}:")
            print("\n".join(f"  {line}" for line in row.words))


def _rows(takes: Sequence[Take], seconds: float, quick: bool) -> Iterator[Row]:
    yield ours(takes)
    if installed():
        yield peer(takes, [seconds], by_hand=False)
        yield peer(takes, [*(w for w in WINDOWS_S if w < seconds), seconds], by_hand=True)
    else:
        yield Row("mujoco.sysid", {}, {}, 0.0, 0, NOT_INSTALLED)
    yield plain(takes)
    yield thesis(QUICK_ITERATIONS if quick else ITERATIONS)


def _print_row(row: Row, truth: Truth) -> None:
    if not row.value:
        print(f"{row.method:33}{row.reports}", flush=True)
        return
    errors = ""
    for name in NAMES:
        given = name in row.value
        error = 100 * (row.value[name] / truth.values[name] - 1) if given else 0.0
        errors += f"{error:11.3f}" if given else f"{'not given':>11}"
    covered = "none"
    if row.interval90:
        inside = [low <= truth.values[name] <= high for name, (low, high) in row.interval90.items()]
        covered = f"{sum(inside)} of {len(inside)}"
    print(
        f"{row.method:33}{errors}{covered:>9}{row.seconds:9.1f}{row.simulations:13d}  "
        f"{row.reports}",
        flush=True,
    )


if __name__ == "__main__":
    main()
