"""How well drops and hops tell ground and friction: errors, coverage of the intervals, time.

    python benchmarks/contact.py [--quick] [--repeats N]

Each repeat films the same true robot anew: two falls, and three hops from rest, with white noise
of 0.3 mm. The fit starts from the thesis' values. The beam is known, or off by what the fit of
clamped runs leaves (0.1 % of stiffness, 3 % of damping), which the intervals do not know of.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from workbench.identify import CONTACT, MeasuredRun, identify_contact
from workbench.identify.drive import lagged_command
from workbench.motion import FOOT, ROTOR_ANGLE, TOP
from workbench.protocol import ModelFile, ShapeFile, load_model, load_shape
from workbench.sim import Condition, make_robot, sample_times, simulate
from workbench.timeseries import TimeSeries

MODEL: ModelFile = load_model("thesis", Path()).content
SHAPE: ShapeFile = load_shape("thesis-initial", Path()).content
TRUE = {"ground_stiffness": 155.0, "ground_damping": 13.0, "friction_slide": 0.38,
        "friction_stick": 0.47}  # fmt: skip
NOISE_M = 3e-4
ARM_M = 0.035
REST_S = 0.5
LAG_S = 0.05
BEAM_ERRORS = {"hinge_stiffness": 0.001, "root_stiffness": 0.001, "hinge_damping": 0.03,
               "root_damping": 0.03}  # fmt: skip


class Plan(NamedTuple):
    """What is filmed: heights [m], speeds [rad/s], seconds of each, and how often."""

    heights: Sequence[float] = (0.01, 0.03)
    speeds: Sequence[float] = (17.0, 18.5, 20.0)
    fall_s: float = 1.2
    hop_s: float = 3.0
    repeats: int = 20


QUICK = Plan(heights=(0.02,), speeds=(18.5,), fall_s=0.8, hop_s=1.4, repeats=1)


class Repeat(NamedTuple):
    """Log share of the true value: estimate, low and high of each parameter; and the time."""

    ends: Mapping[str, tuple[float, float, float]]
    wall_s: float
    cpu_s: float


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="Measure the fit of ground and friction.")
    parser.add_argument(
        "--quick", action="store_true", help="one drop, one hop, once, the beam known"
    )
    parser.add_argument("--repeats", type=int, help="how often the robot is filmed")
    asked = parser.parse_args()
    plan = QUICK if asked.quick else Plan()
    plan = plan._replace(repeats=asked.repeats or plan.repeats)
    films = f"{len(plan.heights)} drops, {len(plan.speeds)} hops, noise {1000 * NOISE_M:g} mm"
    beams = {"beam known": True, "beam off as a fit leaves it": False}
    for title, known in list(beams.items())[: 1 if asked.quick else 2]:
        repeats = [once(plan, seed, beam_known=known) for seed in range(plan.repeats)]
        print(f"{films}, {title}, {plan.repeats} repeats")
        print_table(repeats)


def once(plan: Plan, seed: int, *, beam_known: bool) -> Repeat:
    """Film and fit once."""
    rng = np.random.default_rng(seed)
    values = MODEL.values() | TRUE
    if not beam_known:
        values |= {name: values[name] * (1 + share * rng.standard_normal())
                   for name, share in BEAM_ERRORS.items()}  # fmt: skip
    runs = [filmed(values, rng, drop(h, plan.fall_s), f"drop {h}") for h in plan.heights]
    runs += [filmed(values, rng, hop(w, plan.hop_s), f"hop {w}", w) for w in plan.speeds]
    wall, cpu = time.perf_counter(), time.process_time()
    found = identify_contact(runs, MODEL, SHAPE)
    return Repeat(
        {
            name: (share(one.value, name), share(one.low, name), share(one.high, name))
            for name, one in found.estimates.items()
        },
        time.perf_counter() - wall,
        time.process_time() - cpu,
    )


def share(value: float, name: str) -> float:
    """Return how far a value is off, as a logarithm of its share of the true one."""
    return float(np.log(value / TRUE[name]))


def drop(height: float, seconds: float) -> Condition:
    """Return a fall."""
    still = np.zeros(len(sample_times(seconds)))
    return Condition("drop", still, rest=REST_S, height=height)


def hop(omega: float, seconds: float) -> Condition:
    """Return a hop from rest."""
    command = lagged_command(sample_times(seconds), ((0.0, omega),), LAG_S, 1.0)
    return Condition("hop", command, rest=REST_S)


def filmed(
    values: Mapping[str, float],
    rng: np.random.Generator,
    condition: Condition,
    name: str,
    omega: float = 0.0,
) -> MeasuredRun:
    """Return what the cameras see of a condition."""
    motion = simulate(make_robot(values, SHAPE), condition).motion
    motion = motion.select([*FOOT, *TOP, ROTOR_ANGLE])
    deviation = np.array([NOISE_M] * 6 + [NOISE_M / ARM_M])
    noisy = motion.values + deviation * rng.standard_normal(motion.values.shape)
    seen = TimeSeries(motion.times, noisy, motion.names, motion.valid)
    steps = ((0.0, omega),) if omega else ()
    return MeasuredRun(name, condition.mode, seen, steps, height=condition.height)


def print_table(repeats: Sequence[Repeat]) -> None:
    """Print errors and coverage by parameter, and the time of a fit."""
    print(f"{'':18}{'told in':>9}{'worst %':>9}{'rms %':>9}{'interval +- %':>15}{'covered':>9}")
    for name in CONTACT:
        ends = np.array([one.ends[name] for one in repeats if name in one.ends])
        if not len(ends):
            print(f"{name:18}{0:9d}")
            continue
        value, low, high = ends.T
        covered = np.count_nonzero((low <= 0) & (high >= 0))
        print(f"{name:18}{len(ends):9d}{percent(np.max, np.abs(value)):9.2f}"
              f"{100 * float(np.sqrt(np.mean(value**2))):9.2f}"
              f"{percent(np.median, (high - low) / 2):15.2f}{covered:9d}")  # fmt: skip
    wall, cpu = (float(np.median([getattr(r, k) for r in repeats])) for k in ("wall_s", "cpu_s"))
    print(f"median time of a fit: {wall:.0f} s on the clock, {cpu:.0f} s of the processors\n")


def percent(of: Callable[..., np.floating], values: np.ndarray) -> float:
    """Return a statistic of shares in percent."""
    return 100 * float(of(values))


if __name__ == "__main__":
    main()
