"""How fast and how well beams are searched for, each number beside its bar.

    python benchmarks/optimize.py [--quick] [--log FOLDER] [--seeds 7] [--only speed,ga,cma,peers]

Speed: searches of 480 hops of 10 s at 17 rad/s, checkpoint included, against as many bare `mj_step`
loops in C of the same model without its ground law, on as many threads. Both run in turn, a
generation of each, so that they see the same machine. One search stays near its first shape, so
that none of its candidates fails, as a failure costs nothing; the other is the default search.

Quality: seven seeds, 7 to 13, of the thesis' genetic algorithm, of the default search and of other
packages, at equal evaluations. Searches are kept in the log folder; the same command goes on where
it was stopped, a finished one is only read.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from search import PEERS, has_octave_ga, octave_ga
from twin import THREADS, floor

from workbench.design import ALGORITHMS, Objective, Problem, Settings, Study, appraise
from workbench.optimize import Algorithm, Cmaes, CmaesOptions, History, search
from workbench.schemas import load_model, load_shape
from workbench.sim import Fanout

OMEGA = 17.0  # [rad/s]
PENALTY = 102.0
SLOWER = 0.6  # bar: wall time over that of the bare loops
GAIN = 2.0  # bar of the genetic algorithm: +200 % on the first shape
LEAST_MEDIAN_M, WIDEST = 1.5, 0.12  # bars of the default search: median, (max - min) / median
NEAR = 1e-3  # of the bounds' widths: candidates of the speed run, so near the first that none fails


class Plan(NamedTuple):
    """How much is run.

    Args:
        evaluations: of each search.
        seconds: of a hop.
        seeds: of each method.
        first: seed; the default search was built with 0 to 6.
    """

    evaluations: int = 480
    seconds: float = 10.0
    seeds: int = 7
    first: int = 7


QUICK = Plan(evaluations=24, seconds=1.0, seeds=2)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="Time and judge the search for beams.")
    parser.add_argument("--quick", action="store_true", help="few hops of 1 s, two seeds")
    parser.add_argument("--log", type=Path, help="folder of the searches, to go on from")
    parser.add_argument("--seeds", type=int, help="of each method, by default 7")
    parser.add_argument("--evaluations", type=int, help="of each search, by default 480")
    parser.add_argument("--only", default="speed,ga,guided,cma,peers", help="parts, commas between")
    given = parser.parse_args()
    plan = QUICK if given.quick else Plan()
    plan = plan._replace(
        seeds=given.seeds or plan.seeds, evaluations=given.evaluations or plan.evaluations
    )
    parts = given.only.split(",")
    if "speed" in parts:
        print_speed(plan)
    if set(parts) - {"speed"}:
        with tempfile.TemporaryDirectory() as scratch:
            print_quality(plan, given.log or Path(scratch), parts)


def problem(plan: Plan, shape: str) -> Problem:
    """Return the thesis' problem from one of its first shapes."""
    model, start = load_model("thesis", Path()).content, load_shape(shape, Path()).content
    return Problem(model, start, omega=OMEGA, duration=plan.seconds)


def print_speed(plan: Plan) -> None:
    """Print what searches take, and what as many bare loops take."""
    asked = problem(plan, "thesis-initial")
    floor(asked.robot(asked.space.start), 0.1, THREADS, THREADS)  # compiles the ground law
    print(f"{plan.evaluations} hops of {plan.seconds:g} s at {OMEGA:g} rad/s on {THREADS} threads")
    print(f"{'':36}{'wall s':>9}{'floor s':>9}{'of floor':>10}{'of its cpu':>12}{'bar':>7}")
    settings = Settings(OMEGA, plan.seconds, "guided", evaluations=plan.evaluations)
    with Fanout() as fanout:
        objective = Objective(asked, fanout)
        for name, algorithm in (
            ("near the first shape", Cmaes(asked.space, 0, CmaesOptions(sigma=NEAR))),
            ("the default search", ALGORITHMS["guided"](objective, settings)),
        ):
            own, bare, failed = timed(plan, asked, objective, algorithm)
            share = own.wall / bare.wall
            print(
                f"{f'{name}, {failed} failed':36}{own.wall:9.1f}{bare.wall:9.1f}{share:10.2f}"
                f"{own.cpu / bare.cpu:12.2f}{SLOWER:7.2f}  {met(share <= SLOWER)}",
                flush=True,
            )
    print()


def timed(
    plan: Plan, asked: Problem, objective: Objective, algorithm: Algorithm
) -> tuple[Spent, Spent, int]:
    """Return what a search took, what as many bare loops took, and how many candidates failed."""
    robot = asked.robot(asked.space.start)
    ours: list[Spent] = []
    base: list[Spent] = []

    def in_turn(history: History, _: int) -> None:
        count = len(history.generations[-1].trials)
        ours.append(since(begun[0]))
        begun[0] = now()
        floor(robot, plan.seconds, count, THREADS)
        base.append(since(begun[0]))
        begun[0] = now()

    with tempfile.TemporaryDirectory() as scratch:
        begun = [now()]
        history = search(
            asked.identity,
            algorithm,
            objective,
            evaluations=plan.evaluations,
            penalty=(PENALTY,),
            checkpoint=Path(scratch) / "search.json",
            watch=in_turn,
        )
    failed = sum(len(generation.failures) for generation in history.generations)
    own, bare = (Spent(*(sum(each) for each in zip(*all_, strict=True))) for all_ in (ours, base))
    return own, bare, failed


class Spent(NamedTuple):
    """Time on the clock and of the processors [s]."""

    wall: float
    cpu: float


def now() -> Spent:
    """Return what both clocks show."""
    return Spent(time.perf_counter(), time.process_time())


def since(begun: Spent) -> Spent:
    """Return what has passed on both clocks."""
    return Spent(*(later - before for later, before in zip(now(), begun, strict=True)))


def met(whether: bool) -> str:
    """Return the word for a bar."""
    return "met" if whether else "missed"


def print_quality(plan: Plan, folder: Path, parts: Sequence[str]) -> None:
    """Print a row for each method as it ends."""
    print(f"best distance of {plan.evaluations} evaluations, {plan.seeds} seeds [m]")
    print(f"{'':28}{'first':>8}{'median':>8}{'spread':>8}{'least':>8}{'most':>8}  bars")
    for name, first, distances in rows(plan, folder, parts):
        middle, spread = median(distances), max(distances) - min(distances)
        print(
            f"{name:28}{first:8.3f}{middle:8.3f}{100 * spread / middle:7.0f}%"
            f"{min(distances):8.3f}{max(distances):8.3f}  "
            f"{bars(name, first, distances)}",
            flush=True,
        )


def rows(
    plan: Plan, folder: Path, parts: Sequence[str]
) -> Iterator[tuple[str, float, list[float]]]:
    """Yield method, distance of its first shape and best distance of each seed [m]."""
    for algorithm, shape in (
        ("ga", "thesis-ga-start"),
        ("guided", "thesis-initial"),
        ("cma", "thesis-initial"),
    ):
        if algorithm in parts:
            asked = problem(plan, shape)
            first = appraise(asked, asked.space.start).values["distance"]
            found = [searched(plan, folder, algorithm, shape, seed) for seed in seeds_of(plan)]
            yield algorithm, first, found
    if "peers" in parts:
        asked = problem(plan, "thesis-initial")
        first = appraise(asked, asked.space.start).values["distance"]
        for name, peer in PEERS.items():
            if name.startswith("ours"):
                continue
            if peer is octave_ga and not has_octave_ga():
                print(f"{name:28} not compared: octave-cli or its package ga is not installed")
                continue
            yield name, first, peers(plan, folder, asked, name)


def seeds_of(plan: Plan) -> range:
    """Return the seeds of each method."""
    return range(plan.first, plan.first + plan.seeds)


def searched(plan: Plan, folder: Path, algorithm: str, shape: str, seed: int) -> float:
    """Return the best distance of one search [m]; it is begun, gone on with, or read."""
    own = folder / f"{algorithm}-{OMEGA:g}-seed-{seed}"
    settings = Settings(OMEGA, plan.seconds, algorithm, seed=seed, evaluations=plan.evaluations)
    if own.exists():
        study = replace(Study.resume(own), settings=settings)
    else:
        model, start = load_model("thesis", Path()), load_shape(shape, Path())
        study = Study.begin(own, settings, model, start)
    with Fanout() as fanout:
        history = study.run(fanout)
    return 100 - history.best.evaluation.fitness[0]


def peers(plan: Plan, folder: Path, asked: Problem, name: str) -> list[float]:
    """Return the best distance of another package for each seed [m]; those logged are read."""
    objective = Objective(asked, Fanout())

    def evaluate(candidates: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.array([found.fitness[0] for found in objective(candidates)])

    found = []
    for seed in seeds_of(plan):
        log = folder / f"{name.replace(' ', '-')}-seed-{seed}.txt"
        if not log.exists():
            best = PEERS[name](evaluate, asked.space, seed, plan.evaluations)
            folder.mkdir(parents=True, exist_ok=True)
            log.write_text(f"{best!r}\n", encoding="utf-8")
        found.append(100 - float(log.read_text(encoding="utf-8")))
    return found


def bars(name: str, first: float, distances: Sequence[float]) -> str:
    """Return the bars of a method, each with whether it is met."""
    middle = median(distances)
    if name == "ga":
        least = min(distances) / first - 1
        return f"all at least +200 %: {100 * least:+.0f} % {met(least >= GAIN)}"
    if name == "guided":
        spread = (max(distances) - min(distances)) / middle
        return (
            f"median at least {LEAST_MEDIAN_M} m {met(middle >= LEAST_MEDIAN_M)}, "
            f"spread at most {100 * WIDEST:.0f} % {met(spread <= WIDEST)}"
        )
    return ""


if __name__ == "__main__":
    main()
