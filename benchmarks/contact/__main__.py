"""The twin's ground law beside references, and how far each reading of the law hops.

    python -m benchmarks.contact [--quick]

References: `events`, sticking exact and changes of state located; `stepping`, Moreau and Jean's
scheme. Both are compared with themselves at half the step. The bars hold for the same reading.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.contact.events import READINGS, Name, solve_events
from benchmarks.contact.stepping import march
from benchmarks.contact.twin import begin, dropped, hop, reference, thesis_chain, thesis_robot
from workbench.design import draw_distances, tolerances_of
from workbench.motion import FOOT
from workbench.schemas import load_model
from workbench.sim import Condition, sample_times, simulate_all

Array = NDArray[np.float64]

SAME_MM, SAME_SHARE = 1.0, 0.05
"""Bars: foot over one second from the same state, distance in ten seconds."""
PROVEN = (17.0, 18.0, 19.0)
CHAOTIC = 16.0
LANDINGS = (
    (0.005, 0.0, 0.0), (0.02, 0.0, 0.0), (0.02, 0.1, 0.02), (0.05, -0.1, -0.03), (0.05, 0.3, 0.05),
)  # fmt: skip
"""Height [m], forward speed [m/s] and pitch [rad] of a robot that is let go."""


class Plan(NamedTuple):
    """How much is run.

    Args:
        seconds: of a hop.
        steps: of `events` from one sample to the next.
        marches: of `stepping`.
        speeds: of the table of readings [rad/s].
        starts: how many angles the rotor starts at where hopping is chaotic.
        draws: of what the robot may be, at each of the speeds.
    """

    seconds: float = 10.0
    steps: int = 100
    marches: int = 200
    speeds: tuple[float, ...] = (16.0, 17.0, 18.0, 19.0, 20.0, 21.0)
    starts: int = 12
    draws: int = 64


QUICK = Plan(1.5, 100, 100, (17.0,), 2, 4)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="Compare the ground law with references.")
    parser.add_argument("--quick", action="store_true", help="hops of 1.5 s")
    plan = QUICK if parser.parse_args().quick else Plan()
    print_themselves(plan)
    print_landings(plan)
    print_seconds(plan)
    print_distances(plan)
    print_readings(plan)
    print_spreads(plan)


def events(name: Name, omega: float, plan: Plan, finer: int = 1) -> Array:
    """Return the foot by `events` from rest, (n, 3)."""
    c = thesis_chain()
    start = reference(c, begin())
    return solve_events(c, READINGS[name], start, omega, plan.seconds, finer * plan.steps).foot


def moreau(static: bool, omega: float, plan: Plan, finer: int = 1) -> Array:
    """Return the foot by `stepping` from rest, (n, 3)."""
    c = thesis_chain()
    start = reference(c, begin())
    count, steps = len(sample_times(plan.seconds)), finer * plan.marches
    drive = np.array([start.act, omega])
    return march(c, static, start.q, start.v, drive, count, steps, 1 / 120 / steps)


def apart(one: Array, other: Array) -> float:
    """Return the greatest distance between two feet [mm]."""
    return 1000 * float(np.linalg.norm(one[:, :2] - other[:, :2], axis=1).max())


def far(foot: Array) -> float:
    """Return the distance [m]."""
    return float(foot[-1, 0] - foot[0, 0])


def verdict(met: bool) -> str:
    """Return whether a bar is met, in a word."""
    return "met" if met else "missed"


def print_themselves(plan: Plan) -> None:
    """Print what half the step changes, and how the references agree."""
    print(f"references from rest, {plan.seconds:g} s: distance [m], and what half the step moves")
    print(
        f"{'rad/s':>7}  {'reading':20}{'events':>9}{'half':>9}{'Moreau':>9}{'half':>9}{'apart':>8}"
    )
    readings: tuple[tuple[Name, bool], ...] = (("slides", False), ("static below v_th", True))
    for omega in PROVEN:
        for name, static in readings:
            one, fine = (far(events(name, omega, plan, n)) for n in (1, 2))
            other, finer = (far(moreau(static, omega, plan, n)) for n in (1, 2))
            print(
                f"{omega:7g}  {name:20}{one:9.4f}{fine / one - 1:9.2%}{other:9.4f}"
                f"{finer / other - 1:9.2%}{finer / fine - 1:8.2%}"
            )


def print_landings(plan: Plan) -> None:
    """Print how far the twin's foot is from the reference's after it was let go."""
    c = thesis_chain()
    print("\nlandings, half a second, rotor locked: foot of the twin from the reference's [mm]")
    print(f"{'fall mm':>9}{'m/s':>7}{'pitch':>8}{'foot apart':>12}{'bar':>6}")
    for height, forward, pitch in LANDINGS:
        state = dropped(height, forward, pitch)
        there = solve_events(c, READINGS["slides"], reference(c, state), 0.0, 0.5, plan.steps).foot
        off = apart(hop(state, 0.0, 0.5)[0], there)
        print(
            f"{1000 * height:9g}{forward:7g}{pitch:8g}{off:12.3f}{SAME_MM:6g}  "
            f"{verdict(off < SAME_MM)}"
        )


def print_seconds(plan: Plan) -> None:
    """Print how far the twin's foot leaves the reference's within a second of a hop."""
    c = thesis_chain()
    at = range(0, max(round(plan.seconds) - 1, 1), 2)
    print("\none second of a hop from the same state: greatest distance of the feet [mm]")
    print(f"{'rad/s':>7}" + "".join(f"{f'at {t} s':>9}" for t in at) + f"{'bar':>6}")
    for omega in PROVEN:
        _, states = hop(begin(), omega, max(at) + 0.1, [120 * t for t in at])
        offs = []
        for state in [begin(), *states]:
            start = reference(c, state)
            there = solve_events(c, READINGS["slides"], start, omega, 1.0, plan.steps).foot
            offs.append(apart(hop(state, omega, 1.0)[0], there))
        cells = "".join(f"{off:9.3f}" for off in offs)
        print(f"{omega:7g}{cells}{SAME_MM:6g}  {verdict(max(offs) < SAME_MM)}")


def twin_distances(
    static: float, jobs: Sequence[tuple[float, float]], seconds: float
) -> list[float]:
    """Return the twin's distances at speeds and start angles [m]."""
    count = len(sample_times(seconds))
    done = simulate_all(
        [
            (thesis_robot(static), Condition("hop", np.full(count, omega), start_angle=angle))
            for omega, angle in jobs
        ]
    )
    return [float(one.motion[FOOT[0]][-1] - one.motion[FOOT[0]][0]) for one in done]


def print_distances(plan: Plan) -> None:
    """Print the twin's distances beside the reference's."""
    print(f"\ndistance in {plan.seconds:g} s from rest [m]")
    print(f"{'rad/s':>7}  {'reading':20}{'twin':>9}{'events':>9}{'off':>8}{'bar':>6}")
    rows: tuple[tuple[Name, float], ...] = (("slides", 0.0), ("static below v_th", 1.0))
    for name, static in rows:
        ours = twin_distances(static, [(omega, np.pi / 2) for omega in PROVEN], plan.seconds)
        for omega, distance in zip(PROVEN, ours, strict=True):
            there = far(events(name, omega, plan))
            off = distance / there - 1
            bar = f"{SAME_SHARE:6.0%}  {verdict(abs(off) < SAME_SHARE)}" if not static else ""
            print(f"{omega:7g}  {name:20}{distance:9.4f}{there:9.4f}{off:8.1%}{bar}")


def print_readings(plan: Plan) -> None:
    """Print the distances of every reading, and statistics where hopping is chaotic."""
    print(f"\ndistance in {plan.seconds:g} s [m], every reading of the law, by events")
    print(f"{'':28}" + "".join(f"{f'{omega:g} rad/s':>11}" for omega in plan.speeds))
    for name in READINGS:
        cells = "".join(f"{far(events(name, omega, plan)):z11.4f}" for omega in plan.speeds)
        print(f"{name:28}{cells}")
    angles = np.linspace(0, 2 * np.pi, plan.starts, endpoint=False)
    print(f"\n{CHAOTIC:g} rad/s, rotor started at {plan.starts} angles: median, quartiles [m]")
    for name, static in (("slides", 0.0), ("static below v_th", 1.0)):
        jobs = [(CHAOTIC, float(angle)) for angle in angles]
        ours = twin_distances(static, jobs, plan.seconds)
        there = [far(started(static > 0, float(angle), plan)) for angle in angles]
        for which, found in (("twin", ours), ("Moreau", there)):
            low, middle, high = np.percentile(found, [25, 50, 75])
            print(f"{name:20}{which:8}{middle:.3f}, {low:.3f} to {high:.3f}")


def print_spreads(plan: Plan) -> None:
    """Print how the twin's distances spread over what the thesis' robot may be."""
    tolerances = tolerances_of(load_model("thesis", Path()).content)
    print(
        f"\ntwin, distance in {plan.seconds:g} s, {plan.draws} draws of start angle, friction and "
        "speed within their tolerances: median, the middle nine tenths [m]"
    )
    count = len(sample_times(plan.seconds))
    hops = [(thesis_robot(), Condition("hop", np.full(count, omega))) for omega in plan.speeds]
    for omega, drawn in zip(plan.speeds, draw_distances(hops, tolerances, plan.draws), strict=True):
        found = drawn.as_json()
        low, high = found["low_m"], found["high_m"]
        print(
            f"{omega:7g}{found['median_m']:z9.3f}{low:z9.3f} to {high:.3f}, {drawn.failed} failed"
        )


def started(static: bool, angle: float, plan: Plan) -> Array:
    """Return the foot by `stepping` from the robot at rest with its rotor at an angle."""
    c = thesis_chain()
    start = reference(c, begin(angle))
    count, steps = len(sample_times(plan.seconds)), plan.marches
    drive = np.array([start.act, CHAOTIC])
    return march(c, static, start.q, start.v, drive, count, steps, 1 / 120 / steps)


if __name__ == "__main__":
    main()
