"""How long one waits for an answer: of a command, of the tests, of CI; beside the bars.

    python benchmarks/feedback.py [--quick] [--only commands|tests|ci]

Each command is a process of its own, seen from outside: Python's start included, the median of
five. Bars of commands are processor time, as that does not depend on what else the computer does;
those of tests and CI are wall time on two idle cores. `make test` runs in this checkout after the
install, `.ci/run` on a clean clone of its last commit, the packages' install included. Floors: a
Python that does nothing, and one that only loads what reads a YAML file and an array.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
REPEATS, QUICK = 5, 1
PYTHON = [sys.executable, "-c"]
WORKBENCH = [*PYTHON, "from workbench.cli import main; main()"]
USUAL = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
"""The environment of somebody who works with Python, and does not pack it."""
FRAMES = 10
HEAD = """\
Format Version,1.23,Take Name,small,Capture Frame Rate,120.000000,Export Frame Rate,120.000000,\
Capture Start Frame,0,Total Frames in Take,{n},Total Exported Frames,{n},Rotation Type,Quaternion,\
Length Units,Meters,Coordinate Space,Global

,Type,{body}Rigid Body
,Name,{name}Foot
,ID,{id}1
,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error
Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,
"""
ROW = "{frame},{time:.6f},0.0,0.0,0.0,1.0,0.22,0.0620{frame},-0.31,0.0002\n"


class Cost(NamedTuple):
    """Seconds of a process and of those that it started."""

    processor: float
    wall: float


class Row(NamedTuple):
    """A line of the table.

    Args:
        what: is timed.
        cost: measured.
        bar: the most that it may take [s]; None for a floor.
        waited: whether the bar is wall time.
        note: what else is to be said.
    """

    what: str
    cost: Cost
    bar: float | None = None
    waited: bool = False
    note: str = ""

    def line(self) -> str:
        """Return the line."""
        seen = self.cost.wall if self.waited else self.cost.processor
        bar = "floor" if self.bar is None else f"{self.bar:g} {'wall' if self.waited else 'proc.'}"
        verdict = "" if self.bar is None else "met" if seen <= self.bar else "MISSED"
        return (
            f"{self.what:44}{self.cost.processor:13.2f}{self.cost.wall:10.2f}{bar:>12}  {verdict}"
            f"{'; ' * bool(self.note)}{self.note}"
        )


def timed(words: Sequence[str], repeats: int, cwd: Path, code: int = 0) -> Cost:
    """Return the median cost of a command.

    Args:
        words: the command.
        repeats: how often it is called.
        cwd: where.
        code: with which it has to end.

    Raises:
        RuntimeError: when it ends otherwise; with what it printed last.
    """
    found: list[Cost] = []
    for _ in range(repeats):
        used, start = os.times(), time.perf_counter()
        done = subprocess.run(
            words, cwd=cwd, env=USUAL, capture_output=True, text=True, check=False
        )
        wall, after = time.perf_counter() - start, os.times()
        if done.returncode != code:
            raise RuntimeError(
                f"{' '.join(words)}: {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}"
            )
        spent = after.children_user + after.children_system
        found.append(Cost(spent - used.children_user - used.children_system, wall))
    return Cost(median(one.processor for one in found), median(one.wall for one in found))


def commands(repeats: int, folder: Path) -> list[Row]:
    """Return what commands cost.

    Args:
        repeats: how often each is called.
        folder: empty; where they are called.
    """
    right = (ROOT / "protocols" / "hop-17.yaml").read_text("utf-8")
    (folder / "wrong.yaml").write_text(right.replace("speed:", "sped:"), "utf-8")
    rows = "".join(ROW.format(frame=k, time=k / 120) for k in range(FRAMES))
    head = HEAD.format(n=FRAMES, body="Rigid Body," * 7, name="Foot," * 7, id="1," * 7)
    (folder / "take.csv").write_text(head + rows, "utf-8")
    size = (folder / "take.csv").stat().st_size / 1000
    hop = str(ROOT / "protocols" / "hop-17.yaml")

    def ours(*words: str, code: int = 0) -> Cost:
        return timed([*WORKBENCH, *words], repeats, folder, code)

    return [
        Row("python", timed([*PYTHON, "pass"], repeats, folder)),
        Row(
            "typer, pydantic, ruamel.yaml, numpy",
            timed([*PYTHON, "import typer, pydantic, ruamel.yaml, numpy"], repeats, folder),
        ),
        Row("workbench --help", ours("--help"), 0.3),
        Row("workbench run --help", ours("run", "--help"), 0.8),
        Row("a misspelt key in a protocol", ours("run", "wrong.yaml", code=2), 0.8),
        Row(f"workbench ingest, a take of {size:.1f} kB", ours("ingest", "take.csv"), 1.0),
        Row("make demo", ours("run", hop, "--bench", "virtual"), 5.0),
    ]


def tests() -> Row:
    """Return what `make test` costs here."""
    return Row("make test, after the install", timed(["make", "test"], 1, ROOT), 480.0, waited=True)


def ci(folder: Path) -> Row:
    """Return what CI costs.

    Args:
        folder: empty; where the clone is made.
    """
    clone = ["git", "clone", "--quiet", str(ROOT), "clone"]
    subprocess.run(clone, cwd=folder, check=True)
    cost = timed(["bash", ".ci/run"], 1, folder / "clone")
    return Row(".ci/run, on a clean clone", cost, 900.0, waited=True)


def main() -> None:
    """Time what is asked for and print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--quick", action="store_true", help="commands alone, each once")
    options.add_argument("--only", choices=["commands", "tests", "ci"])
    given = options.parse_args()
    only = "commands" if given.quick else given.only
    print(
        f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before"
        if os.name == "posix"
        else f"{os.cpu_count()} cores"
    )
    print(f"{'':44}{'processor [s]':>13}{'wall [s]':>10}{'bar [s]':>12}")
    with tempfile.TemporaryDirectory() as scratch:
        if only in (None, "commands"):
            (Path(scratch) / "commands").mkdir()
            repeats = QUICK if given.quick else REPEATS
            for row in commands(repeats, Path(scratch) / "commands"):
                print(row.line(), flush=True)
        if only in (None, "tests"):
            print(tests().line(), flush=True)
        if only in (None, "ci"):
            print(ci(Path(scratch)).line(), flush=True)


if __name__ == "__main__":
    main()
