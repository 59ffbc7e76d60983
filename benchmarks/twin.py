"""How fast the twin is against the engine alone, and how it grows.

    python benchmarks/twin.py [--quick]

The floor is a bare `mj_step` loop in C of the same model without its ground law, on as many
threads. Floor and ours run in turn, so that both see the same machine; ratios are medians over
the turns. A rate is simulated seconds per second on the clock.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median
from typing import NamedTuple

import mujoco
import numpy as np

from workbench.protocol import load_model, load_shape
from workbench.sim import (
    Condition,
    Robot,
    build_spec,
    make_robot,
    sample_times,
    settle,
    simulate,
    simulate_all,
)

OMEGA = 17.0  # [rad/s]
START = np.pi / 2  # [rad] the rotor hangs below T
COUNTS = (1, 4, 16, 64, 256)
THREADS = os.cpu_count() or 1


class Plan(NamedTuple):
    """How much is run.

    Args:
        seconds: of a hop.
        hops: in a batch.
        turns: of floor and ours.
        python_s: of the loop in Python.
    """

    seconds: float = 10.0
    hops: int = 64
    turns: int = 5
    python_s: float = 1.0


QUICK = Plan(seconds=1.0, hops=8, turns=2, python_s=0.1)


class Line(NamedTuple):
    """A row of the table: rates are medians; ratio to the floor and its bar, where there are."""

    name: str
    rate: float
    ratio: float | None = None
    bar: float | None = None


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="Time the twin against the engine alone.")
    parser.add_argument("--quick", action="store_true", help="shorter hops, fewer turns")
    plan = QUICK if parser.parse_args().quick else Plan()
    robot = thesis_robot()
    hop(robot, 0.1)
    growth = [measured(robot, count, plan) for count in COUNTS]
    print_rates([*batched(robot, plan), *single(robot, plan)], plan)
    print_growth(growth, plan)
    print(f"\nonce a process: import and compiling the ground law {import_s():.1f} s")


def thesis_robot() -> Robot:
    """Return the thesis' robot."""
    values = load_model("thesis", Path()).content.values()
    return make_robot(values, load_shape("thesis-initial", Path()).content)


def driven(seconds: float) -> Condition:
    """Return a hop at a constant speed."""
    return Condition("hop", np.full(len(sample_times(seconds)), OMEGA), start_angle=START)


def hop(robot: Robot, seconds: float) -> None:
    """Run our single hop, from the robot's numbers to its motion."""
    simulate(robot, driven(seconds))


def floor(robot: Robot, seconds: float, hops: int, threads: int) -> None:
    """Step the same model without its ground law, in C, hops spread over threads."""
    spec = build_spec(robot, "free")
    spec.delete(spec.numeric("ground"))
    model, resting = spec.compile(), settle(robot, "free", START)[1]
    steps = round(seconds / robot.step)

    def run(_: int) -> None:
        data = mujoco.MjData(model)
        data.qpos[:], data.act[:], data.ctrl[:] = resting.qpos, resting.act, OMEGA
        mujoco.mj_step(model, data, nstep=steps)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(run, range(hops)))


def python_loop(robot: Robot, seconds: float) -> None:
    """Step the model with its ground law, one call from Python for each step."""
    model, data = settle(robot, "free", START)
    data.ctrl[:] = OMEGA
    for _ in range(round(seconds / robot.step)):
        mujoco.mj_step(model, data)


def batched(robot: Robot, plan: Plan) -> list[Line]:
    """Time many hops on all cores."""
    jobs = [(robot, driven(plan.seconds))] * plan.hops
    base, ours = in_turn(
        [
            lambda: floor(robot, plan.seconds, plan.hops, THREADS),
            lambda: simulate_all(jobs, THREADS),
        ],
        plan.turns,
    )
    simulated = plan.seconds * plan.hops
    return [
        Line(f"floor: {plan.hops} bare mj_step loops, {THREADS} threads", simulated / median(base)),
        Line(f"ours: {plan.hops} hops, {THREADS} threads", simulated / median(ours),
             ratio(base, ours), 0.90),
    ]  # fmt: skip


def single(robot: Robot, plan: Plan) -> list[Line]:
    """Time one hop on one thread, and the loop in Python scaled to the same length."""
    scale = plan.seconds / plan.python_s
    base, ours, python = in_turn(
        [
            lambda: floor(robot, plan.seconds, 1, 1),
            lambda: hop(robot, plan.seconds),
            lambda: python_loop(robot, plan.python_s),
        ],
        2 * plan.turns + 1,
    )
    python = [scale * t for t in python]
    return [
        Line("floor: 1 bare mj_step loop, 1 thread", plan.seconds / median(base)),
        Line("ours: 1 hop, start-up included", plan.seconds / median(ours),
             ratio(base, ours), 0.70),
        Line(f"a Python loop over mj_step, same law, {plan.python_s:g} s scaled up",
             plan.seconds / median(python), ratio(base, python)),
    ]  # fmt: skip


def in_turn(runs: Sequence[Callable[[], object]], turns: int) -> list[list[float]]:
    """Return the times of each [s]; every other turn goes backwards."""
    times: list[list[float]] = [[] for _ in runs]
    for turn in range(turns):
        order = range(len(runs))
        for k in order if turn % 2 == 0 else reversed(order):
            begin = time.perf_counter()
            runs[k]()
            times[k].append(time.perf_counter() - begin)
    return times


def ratio(base: Sequence[float], ours: Sequence[float]) -> float:
    """Return the median over the turns of our rate over the floor's."""
    return median(b / o for b, o in zip(base, ours, strict=True))


class Growth(NamedTuple):
    """What a number of hops at once took: time [s] and the process' greatest memory [MB]."""

    count: int
    wall_s: float
    peak_MB: float  # noqa: N815


def measured(robot: Robot, count: int, plan: Plan) -> Growth:
    """Run a number of hops at once; call it with growing numbers, the peak never falls."""
    jobs = [(robot, driven(plan.seconds))] * count
    begin = time.perf_counter()
    simulate_all(jobs, THREADS)
    wall = time.perf_counter() - begin
    return Growth(count, wall, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def import_s() -> float:
    """Return how long a new process takes to import the twin [s]."""
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import workbench.sim"], check=True)
    return time.perf_counter() - begin


def print_rates(lines: Sequence[Line], plan: Plan) -> None:
    """Print rates, ratios and whether the bars are met."""
    print(f"hops of {plan.seconds:g} s at {OMEGA:g} rad/s, medians of {plan.turns} turns and more")
    print(f"{'':60}{'sim s/s':>9}{'of floor':>10}{'bar':>7}")
    for name, rate, share, bar in lines:
        text = "" if share is None else f"{share:10.2f}"
        if share is not None and bar is not None:
            text += f"{bar:7.2f}  {'met' if share >= bar else 'missed'}"
        print(f"{name:60}{rate:9.1f}{text}")


def print_growth(growth: Sequence[Growth], plan: Plan) -> None:
    """Print time and memory over the number of hops."""
    print(f"\n{'hops at once':>12}{'wall s':>9}{'sim s/s':>9}{'peak MB':>9}{'MB a hop':>10}")
    first = growth[0]
    for count, wall, peak in growth:
        each = (peak - first.peak_MB) / (count - 1) if count > 1 else float("nan")
        rate = count * plan.seconds / wall
        print(f"{count:12d}{wall:9.2f}{rate:9.1f}{peak:9.0f}{each:10.2f}")


if __name__ == "__main__":
    main()
