"""How fast the twin is against the engine alone, and how it grows.

    python benchmarks/twin.py [--quick]

The floor is a bare `mj_step` loop in C of the same model without its ground law, on as many
threads. Floor and ours run in turn, so that both see the same machine; ratios are medians over
the turns. A rate is simulated seconds per second on the clock. The bars are on the clock; the ratio
of processor times beside it is that of a machine which nobody else uses.
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

from workbench.schemas import load_model, load_shape
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
        growth_s: of a hop when their number grows.
        hops: in a batch.
        turns: of floor and ours.
        python_s: of the loop in Python.
    """

    seconds: float = 10.0
    growth_s: float = 4.0
    hops: int = 64
    turns: int = 3
    python_s: float = 1.0


QUICK = Plan(seconds=1.0, growth_s=0.5, hops=8, turns=2, python_s=0.1)


class Times(NamedTuple):
    """What the turns took on the clock and of the processors [s]."""

    wall: list[float]
    cpu: list[float]


class Line(NamedTuple):
    """A row of the table: what ran, its times, those of its floor, the bar if there is one."""

    name: str
    simulated: float
    ours: Times
    base: Times
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
        Line(f"floor: {plan.hops} bare mj_step loops, {THREADS} threads", simulated, base, base),
        Line(f"ours: {plan.hops} hops, {THREADS} threads", simulated, ours, base, 2.50),
    ]


def single(robot: Robot, plan: Plan) -> list[Line]:
    """Time one hop on one thread, and the loop in Python scaled to the same length."""
    base, ours, python = in_turn(
        [
            lambda: floor(robot, plan.seconds, 1, 1),
            lambda: hop(robot, plan.seconds),
            lambda: python_loop(robot, plan.python_s),
        ],
        3 * plan.turns,
    )
    scale = plan.seconds / plan.python_s
    python = Times(*([scale * t for t in times] for times in python))
    loop = f"a Python loop over mj_step, same law, {plan.python_s:g} s scaled up"
    return [
        Line("floor: 1 bare mj_step loop, 1 thread", plan.seconds, base, base),
        Line("ours: 1 hop, start-up included", plan.seconds, ours, base, 0.70),
        Line(loop, plan.seconds, python, base),
    ]


def in_turn(runs: Sequence[Callable[[], object]], turns: int) -> list[Times]:
    """Return the times of each; every other turn goes backwards."""
    times = [Times([], []) for _ in runs]
    for turn in range(turns):
        order = range(len(runs))
        for k in order if turn % 2 == 0 else reversed(order):
            wall, cpu = time.perf_counter(), time.process_time()
            runs[k]()
            times[k].wall.append(time.perf_counter() - wall)
            times[k].cpu.append(time.process_time() - cpu)
    return times


def ratio(base: Sequence[float], ours: Sequence[float]) -> float:
    """Return the median over the turns of our rate over the floor's."""
    return median(b / o for b, o in zip(base, ours, strict=True))


class Growth(NamedTuple):
    """What a number of hops at once took: time [s] and the process' greatest memory [MB]."""

    hops: int
    wall_s: float
    peak_MB: float


def measured(robot: Robot, count: int, plan: Plan) -> Growth:
    """Run a number of hops at once; call it with growing numbers, the peak never falls."""
    jobs = [(robot, driven(plan.growth_s))] * count
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
    print(f"hops of {plan.seconds:g} s at {OMEGA:g} rad/s, medians over {plan.turns} turns or more")
    print(f"{'':60}{'sim s/s':>9}{'of floor':>10}{'of its cpu':>12}{'bar':>7}")
    for name, simulated, ours, base, bar in lines:
        share = ratio(base.wall, ours.wall)
        text = f"{share:10.2f}{ratio(base.cpu, ours.cpu):12.2f}"
        if bar is not None:
            text += f"{bar:7.2f}  {'met' if share >= bar else 'missed'}"
        print(f"{name:60}{simulated / median(ours.wall):9.1f}{text}")


def print_growth(growth: Sequence[Growth], plan: Plan) -> None:
    """Print time and memory over the number of hops."""
    print(f"\nhops of {plan.growth_s:g} s")
    print(f"{'hops at once':>12}{'wall s':>9}{'sim s/s':>9}{'peak MB':>9}{'MB a hop':>10}")
    for hops, wall, peak in growth:
        each = f"{(peak - growth[0].peak_MB) / (hops - 1):10.2f}" if hops > 1 else ""
        print(f"{hops:12d}{wall:9.2f}{hops * plan.growth_s / wall:9.1f}{peak:9.0f}{each}")


if __name__ == "__main__":
    main()
