"""Searches beside their peers at equal evaluations: median and spread over seeds.

    python benchmarks/search.py [--quick] [--seeds N] [--evaluations N]

Ours are the genetic algorithm of the thesis and the default search; the peers are pymoo's GA and
DE, scipy's DE, pycma and, where it is installed, GNU Octave's `ga`. Two test functions over the
beam's 16 angles with its bounds and the constraint on the sum: a smooth, ill-conditioned bowl, and
one with ripples and cliffs behind which every candidate fails. All start from the same point; a
peer that knows no sum has its candidates projected, as ours are. Less is better.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import cma
import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from scipy.optimize import differential_evolution

from workbench.optimize import Algorithm, Cmaes, Evaluation, GeneticAlgorithm, Guided, Space, search

Objective = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Returns the fitness (n,) of candidates (n, d); less is better."""

Peer = Callable[[Objective, Space, int, int], float]
"""Returns the least fitness found: objective, space, seed, evaluations."""

PENALTY = 2.0  # of a failure [m], as in the thesis: worse than hopping 2 m backward
POPULATION = 12
SIGMA = 0.2  # of the bounds' widths: the first deviation of both CMA-ES
WAVES = 40  # that make up the ripples
CLIFFS = 6
ANGLES = (-2.558, 0.01, 0.112, 0.042, 0.084, 0.126, 0.130, 0.217,
          0.182, 0.339, 0.339, 0.347, 0.399, 0.234, 0.344, 0.175)  # fmt: skip
SCRIPT = Path(__file__).with_name("search_ga.m")


def main() -> None:
    """Print a table for each test function."""
    parser = argparse.ArgumentParser(description="Compare searches at equal evaluations.")
    parser.add_argument("--quick", action="store_true", help="two seeds, 96 evaluations")
    parser.add_argument("--seeds", type=int, default=15)
    parser.add_argument("--evaluations", type=int, default=480)
    chosen = parser.parse_args()
    seeds, evaluations = (2, 96) if chosen.quick else (chosen.seeds, chosen.evaluations)
    for name, function in FUNCTIONS.items():
        compare(name, beam(), function, range(seeds), evaluations)


def beam() -> Space:
    """Return the angles with the bounds of eq. 5.2 and 5.3 and of eq. 5.4 and 5.5 for the sum."""
    names = tuple(f"alpha_{k}" for k in range(len(ANGLES)))
    lower = np.array([-3.0, *[-0.1] * 3, *[0.0] * 12])
    upper = np.array([-1.0, *[0.5] * 3, *[0.6] * 12])
    return Space(names, lower, upper, np.array(ANGLES), names[1:], -0.1, 1.2 * np.pi)


def compare(
    title: str,
    space: Space,
    function: Callable[[Space, int], Objective],
    seeds: Sequence[int],
    evaluations: int,
) -> None:
    """Print least, median, greatest and spread of what each search found.

    Args:
        title: of the table.
        space: that is searched.
        function: makes the objective of a seed.
        seeds: one search each.
        evaluations: of each search.
    """
    print(f"\n{title}, {evaluations} evaluations, {len(seeds)} seeds")
    print(f"{'':26}{'least':>10}{'median':>10}{'greatest':>10}{'spread':>8}{'s':>8}")
    for name, peer in PEERS.items():
        if peer is octave_ga and not has_octave_ga():
            print(f"{name:26}  not compared: octave-cli or its package ga is not installed")
            continue
        begin = time.process_time()
        found = np.array([peer(function(space, s), space, s, evaluations) for s in seeds])
        print_row(name, found, (time.process_time() - begin) / len(seeds))


def print_row(name: str, found: NDArray[np.float64], seconds: float) -> None:
    """Print one search's results; the spread is (greatest - least) / |median|."""
    middle = float(np.median(found))
    spread = np.ptp(found) / abs(middle) if middle else float("nan")
    print(
        f"{name:26}{found.min():10.4f}{middle:10.4f}{found.max():10.4f}{spread:8.0%}{seconds:8.2f}"
    )


def smooth(space: Space, seed: int) -> Objective:
    """Return a rotated bowl with axes a hundred times apart; its least value is 0."""
    generator = np.random.default_rng([seed, 1])
    target, size = space.sample(generator, 1)[0], len(space)
    turn = np.linalg.qr(generator.standard_normal((size, size)))[0]
    stiffness = 10 ** generator.uniform(-1, 1, size)

    def fitness(candidates: NDArray[np.float64]) -> NDArray[np.float64]:
        away = (candidates - target) / space.widths @ turn
        return (away**2 * stiffness).sum(axis=1)

    return fitness


def cliffs(space: Space, seed: int) -> Objective:
    """Return a hill of 1.5 m with ripples of a tenth, cut by cliffs; the start stands on it."""
    generator = np.random.default_rng([seed, 2])
    target, size = space.sample(generator, 1)[0], len(space)
    waves = generator.standard_normal((WAVES, size))
    phases = generator.uniform(0, 2 * np.pi, WAVES)
    normals = generator.standard_normal((CLIFFS, size))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    begin = (space.start - target) / space.widths
    edges = np.maximum(0.45, normals @ begin + 0.1)

    def fitness(candidates: NDArray[np.float64]) -> NDArray[np.float64]:
        away = (candidates - target) / space.widths
        ripples = np.sin(12 * away @ waves.T + phases).sum(axis=1) / np.sqrt(WAVES)
        metres = 1.5 * np.exp(-1.5 * (away**2).sum(axis=1)) * (1 + 0.15 * ripples)
        return np.where((away @ normals.T > edges).any(axis=1), PENALTY, -metres)

    return fitness


def ours(make: Callable[[Space, int], Algorithm]) -> Peer:
    """Return a search of this workbench as a peer."""

    def peer(objective: Objective, space: Space, seed: int, evaluations: int) -> float:
        def evaluate(candidates: NDArray[np.float64]) -> list[Evaluation]:
            return [Evaluation((float(worth),)) for worth in objective(candidates)]

        history = search(
            "benchmark", make(space, seed), evaluate, evaluations=evaluations, penalty=(PENALTY,)
        )
        return history.best.evaluation.fitness[0]

    return peer


def pymoo_peer(algorithm: type[GA] | type[DE]) -> Peer:
    """Return a search of pymoo as a peer, with pymoo's own operators."""

    def peer(objective: Objective, space: Space, seed: int, evaluations: int) -> float:
        count = Counter(objective, space, evaluations)

        class Beam(Problem):
            def _evaluate(self, x: NDArray[np.float64], out: dict[str, NDArray[np.float64]],
                          *_: object, **__: object) -> None:  # fmt: skip
                out["F"] = count(x)[:, None]

        problem = Beam(n_var=len(space), n_obj=1, xl=space.lower, xu=space.upper)
        first: Any = around(space, seed, POPULATION)  # declared as an operator, arrays are taken
        searching = algorithm(pop_size=POPULATION, sampling=first)
        minimize(problem, searching, ("n_eval", evaluations), seed=seed)
        return count.least

    return peer


def scipy_de(objective: Objective, space: Space, seed: int, evaluations: int) -> float:
    """Search by scipy's differential evolution."""
    count = Counter(objective, space, evaluations)
    first: Any = around(space, seed, POPULATION)  # declared as text, arrays are taken
    differential_evolution(
        lambda x: float(count(np.atleast_2d(x))[0]),
        list(zip(space.lower, space.upper, strict=True)),
        init=first,
        maxiter=evaluations // POPULATION - 1,
        rng=seed,
        polish=False,
        tol=0,
    )
    return count.least


def pycma(objective: Objective, space: Space, seed: int, evaluations: int) -> float:
    """Search by pycma with its own bounds handling, started like ours."""
    count = Counter(objective, space, evaluations)
    options = {"bounds": [0, 1], "seed": seed + 1, "verbose": -9, "maxfevals": evaluations}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        strategy = cma.CMAEvolutionStrategy(scaled(space, space.start), SIGMA, options)
        count(space.start[None])
        while count.left >= strategy.popsize and not strategy.stop():
            drawn = strategy.ask()
            strategy.tell(drawn, list(count(space.lower + space.widths * np.array(drawn))))
    return count.least


def octave_ga(objective: Objective, space: Space, seed: int, evaluations: int) -> float:
    """Search by the `ga` of GNU Octave's package in a process of its own, line by line."""
    count = Counter(objective, space, evaluations)
    rows = (
        [seed + 1, POPULATION, evaluations // POPULATION],
        space.lower,
        space.upper,
        around(space, seed, POPULATION),
    )
    command = ["octave-cli", "--quiet", "--norc", str(SCRIPT)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as run:
        if run.stdin is None or run.stdout is None:
            raise RuntimeError("octave-cli has no pipes")
        run.stdin.write("\n".join(matrix(row) for row in rows) + "\n#")
        run.stdin.flush()
        while count.left > 0 and (line := run.stdout.readline()):
            if line.startswith("ask"):
                candidate = np.array(line.split()[1:], dtype=np.float64)
                run.stdin.write(f"{float(count(candidate[None])[0])!r}\n#")
                run.stdin.flush()
        run.kill()
    return count.least


@cache
def has_octave_ga() -> bool:
    """Tell whether Octave is here and loads its package."""
    if not shutil.which("octave-cli"):
        return False
    command = ["octave-cli", "--quiet", "--norc", "--eval", "pkg load ga"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def matrix(values: ArrayLike) -> str:
    """Return numbers as Octave reads them."""
    rows = np.atleast_2d(np.asarray(values, dtype=np.float64))
    return "[" + "; ".join(" ".join(repr(float(v)) for v in row) for row in rows) + "]"


class Counter:
    """Counts what a peer evaluates and keeps the least, whatever the peer reports.

    Args:
        objective: to be counted.
        space: into which candidates are projected.
        evaluations: how many there may be.
    """

    def __init__(self, objective: Objective, space: Space, evaluations: int) -> None:
        self._objective, self._space = objective, space
        self.left, self.least = evaluations, np.inf

    def __call__(self, candidates: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the fitness (n,) of candidates (n, d); those beyond the count teach nothing."""
        fitness = self._objective(self._space.project(candidates))
        counted = fitness[: max(self.left, 0)]
        self.left -= len(fitness)
        self.least = min(self.least, float(counted.min(initial=np.inf)))
        return fitness


def scaled(space: Space, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a point with each bound's width as its unit."""
    return (point - space.lower) / space.widths


def around(space: Space, seed: int, count: int) -> NDArray[np.float64]:
    """Return the start and points about it, (count, d): the peers' first population."""
    drawn = np.random.default_rng([seed, 3]).standard_normal((count, len(space)))
    drawn[0] = 0.0
    return space.project(space.start + SIGMA * space.widths * drawn)


FUNCTIONS = {"smooth bowl": smooth, "ripples and cliffs": cliffs}
PEERS: Mapping[str, Peer] = {
    "ours: ga of the thesis": ours(GeneticAlgorithm),
    "ours: cma": ours(Cmaes),
    "ours: guided, given nothing": ours(Guided),
    "pymoo GA": pymoo_peer(GA),
    "pymoo DE": pymoo_peer(DE),
    "scipy DE": scipy_de,
    "pycma": pycma,
    "GNU Octave ga": octave_ga,
}

if __name__ == "__main__":
    main()
