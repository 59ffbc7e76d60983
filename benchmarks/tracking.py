"""How fast a take becomes a track on disk, against pyarrow merely parsing the same file.

    python benchmarks/tracking.py [--quick]

The take is ten minutes of three bodies with four markers each at 120 Hz, written by our writers as
Motive 1.23 and as row format 1.0; a body is lost now and then. The peer is `pyarrow.csv.read_csv`
with its defaults and all its threads. It cannot parse a row-format file, whose rows are ragged; so
there it gets the frame rows and the body rows sorted by their number of cells beforehand, which is
not timed. Ours reads the file, cleans it by the default recipe and writes the motion as Parquet.
Peer and ours run in turn; the ratio is the median over the turns, and beside it stands that of the
processor time of all threads. Memory is the peak of a process of its own above what its imports
take (Linux).
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.csv as arrow_csv
from numpy.typing import NDArray

from workbench.bundle import SeriesFiles
from workbench.timeseries import TimeSeries
from workbench.tracking import (
    Axes,
    BodyNames,
    BodyTake,
    Cloud,
    SampleStatus,
    Take,
    Track,
    make_track,
    read_take,
    write_motive,
    write_row,
)

RATE = 120.0  # [Hz]
MINUTES, QUICK_MINUTES = 10.0, 0.25
TURNS, QUICK_TURNS = 7, 2
OMEGA = 17.0  # [rad/s]
NOISE_M = 1e-4
BAR_TIME, BAR_MEMORY = 2.0, 4.0
PLACES = np.array([[0.1, 0.0, 0.1], [0.1, 0.02, -0.1], [-0.1, 0.01, 0.1], [-0.1, 0.0, -0.1]])
LOST_EVERY, LOST_FOR = 1800, 8  # samples
AXES = Axes()
KILOBYTE = 1024 / 1e6  # [MB]; Linux counts memory in these
MEMORY = """
import sys
from workbench.bundle import Bundle
from workbench.tracking import *
from workbench.tracking import csv_cells

def peak():
    lines = open("/proc/self/status").read().splitlines()
    return int(next(line.split()[1] for line in lines if line.startswith("VmHWM")))

before = peak()
take = read_take(sys.argv[1])
read = peak()
make_track(take, bodies=BodyNames(), axes=Axes())
print(read - before, peak() - before)
"""


Result = TypeVar("Result")


class Step(NamedTuple):
    """What ran, and how long each turn of it took on the clock and of all cores [s]."""

    name: str
    times: list[float]
    processor: list[float]


def main() -> None:
    """Print time and memory of both formats."""
    parser = argparse.ArgumentParser(description="Time a take against pyarrow's parsing of it.")
    parser.add_argument("--quick", action="store_true", help="a short take, few turns")
    quick = parser.parse_args().quick
    minutes, turns = (QUICK_MINUTES, QUICK_TURNS) if quick else (MINUTES, TURNS)
    take = synthetic(round(60 * minutes * RATE))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        motive, row = folder / "motive.csv", folder / "row.csv"
        write_motive(take, motive, "1.23")
        write_row(take, row, "1.0")
        print(f"{len(take)} frames, 3 bodies, 12 markers, medians over {turns} turns")
        for path, peer in ((motive, motive_peer(motive)), (row, row_peer(row))):
            report(path, timed(path, peer, folder, turns), memory(path))


def synthetic(n: int) -> Take:
    """Return a take of a hopping robot: foot, T and rotor, four markers each."""
    t = np.arange(n) / RATE
    angle = OMEGA * np.maximum(0.0, t - 1.0)
    bounce = np.sin(angle)
    foot = np.column_stack([0.3 * np.sin(0.02 * t), 0.0 * t, 0.012 * bounce**2])
    top = foot + np.column_stack([0.07 + 0.02 * bounce, 0.0 * t, 0.28 + 0.01 * bounce])
    rotor = top + 0.035 * np.column_stack([np.cos(angle), 0.0 * t, -np.sin(angle)])
    rng = np.random.default_rng(1)
    paths = {"Foot": foot, "T": top, "Rotor": rotor}
    bodies = {name: body(name, k + 1, path, rng) for k, (name, path) in enumerate(paths.items())}
    return Take(
        path="synthetic", sha256="", format="row", version="1.0", rate_hz=RATE, jitter_s=0.0,
        indices=np.arange(n), times=t, bodies=bodies, cloud=Cloud.empty(n),
    )  # fmt: skip


def body(name: str, number: int, path: NDArray[np.float64], rng: np.random.Generator) -> BodyTake:
    """Return a body on a path, lost for some samples every fifteen seconds."""
    n = len(path)
    solved = AXES.points_to_export(path[:, None, :] + 0.3 * PLACES)
    lost = (np.arange(n) + 500 * number) % LOST_EVERY < LOST_FOR
    lost[: LOST_EVERY // 2] = False
    position = np.where(lost[:, None], np.nan, solved.mean(axis=1))
    measured = solved + rng.normal(0, NOISE_M, solved.shape)
    return BodyTake(
        name=name,
        id=str(number),
        position=position,
        quaternion=np.where(lost[:, None], np.nan, [1.0, 0.0, 0.0, 0.0]),
        measured=np.where(lost[:, None, None], np.nan, measured),
        solved=solved,
        marker_names=tuple(f"Marker {k + 1}" for k in range(len(PLACES))),
        missing=np.where(lost, SampleStatus.LOST, SampleStatus.SEEN).astype(np.int8),
    )


def motive_peer(path: Path) -> Callable[[], object]:
    """Return pyarrow's parsing of a Motive file, its first header rows passed over."""
    with path.open(encoding="utf-8") as file:
        header = next(i for i, line in enumerate(file) if line.startswith("Frame"))
    options = arrow_csv.ReadOptions(skip_rows=header)
    return lambda: arrow_csv.read_csv(path, options)


def row_peer(path: Path) -> Callable[[], object]:
    """Return pyarrow's parsing of a row-format file whose rows are sorted beforehand."""
    kinds: dict[tuple[bytes, int], list[bytes]] = defaultdict(list)
    started = False
    for line in path.read_bytes().splitlines(keepends=True):
        started = started or line.startswith(b"frame,")
        if started:
            kinds[line[:5], line.count(b",")].append(line)
    texts = [pa.py_buffer(b"".join(lines)) for lines in kinds.values()]
    options = arrow_csv.ReadOptions(autogenerate_column_names=True)
    return lambda: [arrow_csv.read_csv(pa.BufferReader(text), options) for text in texts]


def timed(path: Path, peer: Callable[[], object], folder: Path, turns: int) -> list[Step]:
    """Run peer and ours in turn, once beforehand for compiled functions to be loaded."""
    written(cleaned(read_take(path)).motion, folder)
    steps = [
        Step(name, [], []) for name in ("pyarrow parses", "read_take", "make_track", "Parquet")
    ]
    for turn in range(turns):
        for ours in (False, True) if turn % 2 else (True, False):
            if ours:
                take = clocked(steps[1], lambda: read_take(path))
                track = clocked(steps[2], lambda take=take: cleaned(take))
                clocked(steps[3], lambda track=track: written(track.motion, folder))
            else:
                clocked(steps[0], peer)
    return steps


def clocked(step: Step, run: Callable[[], Result]) -> Result:
    """Run once and keep the times."""
    begin, spent = time.perf_counter(), time.process_time()
    result = run()
    step.times.append(time.perf_counter() - begin)
    step.processor.append(time.process_time() - spent)
    return result


def cleaned(take: Take) -> Track:
    """Clean a take by the default recipe."""
    return make_track(take, bodies=BodyNames(), axes=AXES)


def written(motion: TimeSeries, folder: Path) -> None:
    """Write a motion as a bundle keeps it."""
    SeriesFiles(folder).write("track", motion, {})


def memory(path: Path) -> tuple[float, float]:
    """Return by how much a fresh process grows [MB]: reading, and reading and cleaning."""
    done = subprocess.run(
        [sys.executable, "-c", MEMORY, str(path)], check=True, capture_output=True, text=True
    )
    read, all_of_it = map(int, done.stdout.split())
    return read * KILOBYTE, all_of_it * KILOBYTE


def report(path: Path, steps: Sequence[Step], grown: tuple[float, float]) -> None:
    """Print what the steps took, and both bars."""
    size = path.stat().st_size / 1e6
    print(f"\n{path.name}, {size:.1f} MB")
    for name, times, processor in steps:
        print(f"{name:32}{median(times):9.3f} s {median(processor):9.3f} s of processor")
    peer, ours = steps[0].times, [sum(x) for x in zip(*(s.times for s in steps[1:]), strict=True)]
    ratio = median(a / b for a, b in zip(ours, peer, strict=True))
    spent = sum(median(step.processor) for step in steps[1:]) / median(steps[0].processor)
    print(f"{'ours / peer, processor':32}{spent:9.2f}")
    for name, value, bar in (
        ("ours / peer, time", ratio, BAR_TIME),
        ("memory to read / file", grown[0] / size, BAR_MEMORY),
        ("memory to read and clean / file", grown[1] / size, BAR_MEMORY),
    ):
        print(f"{name:32}{value:9.2f}   bar {bar:g} {'met' if value <= bar else 'missed'}")


if __name__ == "__main__":
    main()
