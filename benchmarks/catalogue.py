"""How long it takes to list, search and rebuild ten thousand bundles, beside the bars.

    python benchmarks/catalogue.py [--quick] [--folder FOLDER]

The bundles are real ones, written by the workbench's own code, with manifests as long as those of
`workbench run`; only their series and takes are small. Each command is a process of its own, timed
from outside: what a person waits for, Python's start included. Processor time stands beside it, for
a computer that does other things meanwhile.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from tests.bundles import note
from workbench.bundle import Bundle, add_remark, events

COUNT, QUICK = 10_000, 300
REPEATS = 5
LIST_S, REBUILD_S = 0.3, 60.0
"""The bars: wall time of a list, and of a rebuild."""
SEED = 1
MAIN = [sys.executable, "-c", "from workbench.cli import main; main()"]
BEGIN = datetime(2023, 1, 9, 8, 0).astimezone()


class Timed(NamedTuple):
    """Seconds of a process."""

    wall: float
    processor: float


def make_bundles(root: Path, count: int) -> None:
    """Make bundles over three years: four modes, a few shapes, every twentieth remarked on."""
    draw = random.Random(SEED)
    for k in range(count):
        now = BEGIN + timedelta(minutes=150 * k + draw.randrange(60))
        mode = draw.choice(("hop", "hop", "clamped", "decay", "drop"))
        speed = round(draw.uniform(14.0, 21.0), 3) if mode in ("hop", "clamped") else None
        bundle = Bundle.create(root, f"{mode}-{k}", now)
        note(bundle, **facts(draw, mode, speed, k))
        bundle.write_document("shape", f"schema: workbench/shape-1\nname: bent-{k % 7}\n")
        bundle.record.journal(events.RunAsked(run=f"{mode}-{k}"), 0.0)
        (bundle.take_folder / "take.csv").write_text(f"Format Version,1.23\n{k}\n")
        bundle.finish(draw.choice(("complete",) * 9 + ("failed",)))
        if k % 20 == 0:
            add_remark(bundle.path, "tag", draw.choice(("paper", "demo")), "Ada", now)
            add_remark(bundle.path, "note", "the tape came loose", "Ada", now)


def facts(draw: random.Random, mode: str, speed: float | None, k: int) -> dict[str, Any]:
    """Return what the manifest of such a run says, as long as a real one's."""
    real = {"distance_m": draw.gauss(0.2, 0.05), "hop_height_m": 0.018, "speed_rad_s": speed or 0.0}
    noise = {
        f"{point}_{axis}_m": {"rest": 0.1, "white": 0.14, "synchronous": draw.random()}
        for point in ("foot", "top", "rotor")
        for axis in "xyz"
    }
    return {
        "kind": "run",
        "title": f"{mode} {'' if speed is None else f'at {speed:.0f} rad/s'}, series {k // 40}",
        "protocol": f"series-{k // 40}.yaml",
        "mode": mode,
        "role": draw.choice(("train", "held_out")),
        "model": "thesis",
        "shape": f"bent-{k % 7}",
        "operator": draw.choice(("Ada", "Grace", "Emmy")),
        "speed_rad_s": speed,
        "levels": None,
        "sent": [[2 + 0.1 * i, 0.7 * i] for i in range(40)],
        "real": real,
        "twin": {**real, "distance_m": draw.gauss(0.2, 0.05), "outcome": "completed"},
        "error_mm": abs(draw.gauss(12.0, 6.0)),
        "error_foot_mm": 5.0,
        "error_top_mm": 15.0,
        "warnings": [],
        "noise_mm": noise,
    }


def timed(root: Path, words: Sequence[str], before: Callable[[], object]) -> Timed:
    """Return the median time of a command, after as many preparations."""
    found: list[Timed] = []
    for _ in range(REPEATS):
        before()
        start, used = time.perf_counter(), os.times()
        subprocess.run(
            [*MAIN, "runs", *words, "--runs", str(root)],
            check=True,
            capture_output=True,
            env={**os.environ, "COLUMNS": "160"},
        )
        wall, after = time.perf_counter() - start, os.times()
        processor = after.children_user + after.children_system
        found.append(Timed(wall, processor - used.children_user - used.children_system))
    return Timed(median(t.wall for t in found), median(t.processor for t in found))


def main() -> None:
    """Make the bundles, time the commands, print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--quick", action="store_true", help=f"{QUICK} bundles only")
    options.add_argument("--folder", type=Path, help="where to make them, and to leave them")
    given = options.parse_args()
    count = QUICK if given.quick else COUNT
    with tempfile.TemporaryDirectory() as scratch:
        root = given.folder or Path(scratch) / "runs"
        start = time.perf_counter()
        if not root.exists():
            make_bundles(root, count)
        manifest = next(root.glob("*/manifest.json")).stat().st_size
        print(
            f"{count} bundles, a manifest of {manifest} byte each, "
            f"made in {time.perf_counter() - start:.0f} s; medians of {REPEATS}"
        )
        print_table(root, count)


def print_table(root: Path, count: int) -> None:
    """Print a line a command."""
    newest = max(root.glob("*/manifest.json"))

    def remark() -> None:
        add_remark(newest.parent, "note", "once more", "Ada", BEGIN)

    def forget() -> None:
        (root / ".catalogue.sqlite").unlink(missing_ok=True)

    def nothing() -> None:
        return

    rows: list[tuple[str, list[str], Callable[[], object], float | None]] = [
        ("first list, no index yet", ["list"], forget, REBUILD_S),
        ("rebuild", ["rebuild"], nothing, REBUILD_S),
        ("list", ["list"], nothing, LIST_S),
        ("list, one run remarked on since", ["list"], remark, LIST_S),
        ("search: speed, mode, verdict, words",
         ["list", "tape", "--speed", "17", "--mode", "hop", "--verdict", "none"], nothing, LIST_S),
        ("search: dates, shape, tag, by error",
         ["list", "--since", "2024-03", "--until", "2025", "--shape", "bent-3", "--tag", "paper",
          "--sort", "error"], nothing, LIST_S),
        ("list --json, all of them", ["list", "--json"], nothing, None),
        ("show the newest by its number", ["show", str(count)], nothing, None),
    ]  # fmt: skip
    print(f"{'':38} {'wall [s]':>9} {'processor [s]':>14} {'bar [s]':>8}")
    for name, words, before, bar in rows:
        wall, processor = timed(root, words, before)
        said = "" if bar is None else f"{bar:.1f} {'met' if wall < bar else 'MISSED'}"
        print(f"{name:38} {wall:9.2f} {processor:14.2f} {said:>12}", flush=True)
    floor = timed(root / "none", ["list"], nothing)
    print(f"{'floor: a list of no runs at all':38} {floor.wall:9.2f} {floor.processor:14.2f}")


if __name__ == "__main__":
    main()
