"""How near the cleaning recipes come to a known truth, and what they cost.

    python benchmarks/cleaning.py [--quick]

The truth is the twin's motion. The cameras add 0.2 mm to each coordinate of each marker and lose
2 % of the marker samples; then 0.5 % of each body's samples are set aside by 5 to 300 mm, one, two
or up to eight in a row. The error is that of each coordinate of a body's position, over the samples
that the recipe calls valid. The bar is 1.2 times the noise of a marker's coordinate; the strict one
is 1.2 times the noise of the body's own point, which is the mean of its markers. The blur is the
recipe's error without any noise, in the worst twelfth of a turn.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.motion import FOOT, ROTOR, ROTOR_ANGLE, TOP
from workbench.run import load_bench
from workbench.run.virtual import film, move
from workbench.schemas import BenchFile, VirtualSection, load_model, load_shape
from workbench.sim import make_robot
from workbench.timeseries import TimeSeries
from workbench.tracking import (
    CLEANING,
    Axes,
    BodyNames,
    Cleaned,
    SampleStatus,
    Take,
    Track,
    make_track,
    mean_speed,
    raw_points,
)

NOISE_M = 2e-4
GAP_SHARE, GLITCH_SHARE = 0.02, 0.005
GLITCH_M = (5e-3, 0.3)
LENGTHS = (1, 1, 1, 2, 2, 3, 5, 8)
BAR = 1.2
SPEED_BAR = 1e-3
SECONDS_BAR = 0.25
SAMPLES = 72_000
REST_S = 1.0
STEADY_S = 2.0  # of the drive, until the ramp is forgotten
TWELFTHS = 12
ROLES = {"foot": FOOT, "top": TOP, "rotor": ROTOR}


class Case(NamedTuple):
    """A run: its mode and the rotor's speed [rad/s]."""

    mode: Literal["hop", "clamped"]
    speed: float


Truths = dict[Case, TimeSeries]
CASES = (Case("hop", 13.0), Case("hop", 17.0), Case("hop", 20.0), Case("clamped", 9.0))


class Filmed(NamedTuple):
    """A take, its truth in the cameras' place, and the samples that were set aside, by body."""

    take: Take
    truth: TimeSeries
    glitches: dict[str, NDArray[np.bool_]]


class Error(NamedTuple):
    """What a recipe left of one body [m], and what it made of its glitches.

    Args:
        rms: over the valid samples and three coordinates.
        blur: without noise, in the worst twelfth of a turn.
        missed: glitches that count as seen.
        wronged: true samples that were rejected.
        valid: share of all samples.
    """

    rms: float
    blur: float
    missed: float
    wronged: float
    valid: float


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="Measure the cleaning recipes against a truth.")
    parser.add_argument("--quick", action="store_true", help="shorter runs, fewer seeds")
    quick = parser.parse_args().quick
    bench = load_bench("virtual").content
    seconds, seeds, samples = (6.0, 1, 6_000) if quick else (10.0, 5, SAMPLES)
    truths = {case: true_motion(bench, case, seconds) for case in CASES}
    print_errors(bench, truths, range(seeds))
    print_speeds(bench, truths, range(seeds))
    print_time(bench, truths[CASES[1]], samples)


def true_motion(bench: BenchFile, case: Case, seconds: float) -> TimeSeries:
    """Return the twin's motion, sampled at the cameras' rate, resting for the first second."""
    section = virtual(bench)
    volts = (case.speed - section.motor_offset) / section.motor_slope
    values = load_model("thesis", Path()).content.values()
    robot = make_robot(values, load_shape("thesis-initial", Path()).content)
    return move(robot, case.mode, [(-1.0, 0.0), (REST_S, volts)], seconds, section)


def virtual(bench: BenchFile, **changed: float) -> VirtualSection:
    """Return the section of the virtual bench."""
    if bench.virtual is None:
        raise InputError("the bench has no section 'virtual'")
    return bench.virtual.model_copy(update=changed)


def filmed(bench: BenchFile, truth: TimeSeries, seed: int) -> Filmed:
    """Return a take with noise, gaps and glitches."""
    section = virtual(bench, noise=NOISE_M, gap_share=GAP_SHARE)
    take = film(truth, bench.tracking, section, np.random.default_rng(seed))
    rng = np.random.default_rng(1000 + seed)
    glitches: dict[str, NDArray[np.bool_]] = {}
    bodies = dict(take.bodies)
    for name, body in take.bodies.items():
        aside = set_aside(len(take), rng)
        glitches[name] = np.asarray(aside.any(axis=1))
        bodies[name] = replace(
            body,
            measured=body.measured + aside[:, None],
            solved=body.solved + aside[:, None],
            position=body.position + aside,
        )
    return Filmed(replace(take, bodies=bodies), truth, glitches)


def set_aside(count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return displacements (count, 3) [m]: half of the bursts stand still, half jump about."""
    aside = np.zeros((count, 3))
    while np.count_nonzero(aside.any(axis=1)) < GLITCH_SHARE * count:
        length = int(rng.choice(LENGTHS))
        start = int(rng.integers(1, count - length))
        size = np.exp(rng.uniform(*np.log(GLITCH_M)))
        ways = rng.normal(size=(length, 3))
        if rng.random() < 0.5:
            ways[:] = ways[0]
        aside[start : start + length] = size * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    return aside


class Layout(NamedTuple):
    """How the cameras see the robot: what `raw_points` and `make_track` need beside a take."""

    bodies: BodyNames
    axes: Axes
    markers: dict[str, NDArray[np.float64]]


def layout(bench: BenchFile) -> Layout:
    """Return what a bench says about its cameras."""
    cameras = bench.tracking
    return Layout(
        BodyNames(cameras.bodies.foot, cameras.bodies.top, cameras.bodies.rotor),
        Axes(up=cameras.axes.up, forward=cameras.axes.forward),
        {name: np.array(places) for name, places in cameras.markers.items()},
    )


def track(bench: BenchFile, take: Take) -> Track:
    """Return the track of a take."""
    bodies, axes, markers = layout(bench)
    return make_track(take, bodies=bodies, axes=axes, markers=markers)


def cleaned(bench: BenchFile, take: Take, recipe: str) -> Cleaned:
    """Return what a recipe makes of a take."""
    return CLEANING[recipe](raw_points(take, *layout(bench)))


def deviation(columns: TimeSeries, truth: TimeSeries) -> dict[str, NDArray[np.float64]]:
    """Return where a recipe has the bodies, less where they are, by role, (k, 3) [m].

    Recipes differ in their origin and in the point of a body that they follow; each body's median
    deviation at rest is taken off.
    """
    k = len(columns)
    apart = {
        role: columns.select(names).values - truth.select(names).values[:k]
        for role, names in ROLES.items()
    }
    rest = truth.times[:k] < 0.9 * REST_S
    return {role: path - np.nanmedian(path[rest], axis=0) for role, path in apart.items()}


def errors(
    bench: BenchFile, truth: TimeSeries, recipe: str, seeds: Sequence[int]
) -> dict[str, Error]:
    """Return what a recipe leaves of each body, over all seeds."""
    left: dict[str, list[NDArray[np.float64]]] = {role: [] for role in ROLES}
    counts = {role: np.zeros(3) for role in ROLES}
    for seed in seeds:
        scene = filmed(bench, truth, seed)
        done = cleaned(bench, scene.take, recipe)
        apart = deviation(done.columns, truth)
        for (role, names), aside in zip(ROLES.items(), scene.glitches.values(), strict=True):
            valid = done.columns.validity(names[0])
            status = done.raw_missing[role]
            left[role].append(apart[role][valid])
            missed = np.count_nonzero(aside & (status == SampleStatus.SEEN))
            wronged = np.count_nonzero(~aside & (status == SampleStatus.GLITCH))
            counts[role] += [missed, wronged, np.mean(valid) / len(seeds)]
    blurred = blur(bench, truth, recipe)
    return {
        role: Error(rms(np.concatenate(left[role])), blurred[role], *counts[role].tolist())
        for role in ROLES
    }


def blur(bench: BenchFile, truth: TimeSeries, recipe: str) -> dict[str, float]:
    """Return the error without noise in the worst twelfth of a turn, by role [m]."""
    still = virtual(bench, noise=0.0, gap_share=0.0)
    take = film(truth, bench.tracking, still, np.random.default_rng(0))
    columns = cleaned(bench, take, recipe).columns
    phase = truth[ROTOR_ANGLE][: len(columns)] / (2 * np.pi)
    twelfth = np.floor(TWELFTHS * phase).astype(int) % TWELFTHS
    steady = columns.times > REST_S + STEADY_S
    return {
        role: max(rms(path[steady & (twelfth == k)]) for k in range(TWELFTHS))
        for role, path in deviation(columns, truth).items()
    }


def rms(values: NDArray[np.float64]) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def own_noise(bench: BenchFile, role: str) -> float:
    """Return the noise of a body's point, the mean of its markers [m]."""
    return NOISE_M / np.sqrt(len(bench.tracking.markers[getattr(bench.tracking.bodies, role)]))


def met(value: float, bar: float) -> str:
    """Return the verdict in a word."""
    return "met" if value <= bar else "missed"


def print_errors(bench: BenchFile, truths: Truths, seeds: Sequence[int]) -> None:
    """Print the position errors of both recipes beside the bars."""
    print(f"position error [mm], {len(seeds)} seed(s), bar {1e3 * BAR * NOISE_M:.2f} mm")
    print(
        f"{'recipe':9}{'run':14}{'body':7}{'rms':>7}  {'bar':7}{'strict':>6}  {'':7}"
        f"{'blur':>6}{'missed':>8}{'wronged':>9}{'valid':>8}"
    )
    for recipe in CLEANING:
        for case, truth in truths.items():
            for role, error in errors(bench, truth, recipe, seeds).items():
                strict = BAR * own_noise(bench, role)
                print(
                    f"{recipe:9}{case.mode:8}{case.speed:4.0f}  {role:7}{1e3 * error.rms:7.3f}  "
                    f"{met(error.rms, BAR * NOISE_M):7}{1e3 * strict:6.3f}  "
                    f"{met(error.rms, strict):7}{1e3 * error.blur:6.2f}"
                    f"{error.missed:8.0f}{error.wronged:9.0f}{100 * error.valid:7.1f}%"
                )


def print_speeds(bench: BenchFile, truths: Truths, seeds: Sequence[int]) -> None:
    """Print the error of the rotor's mean speed beside what it says of itself.

    The true speed is that of the direction from T to the rotor. The motor turns the rotor against
    the tip of the beam; where the tip sways widely, the two differ over a few seconds.
    """
    print(f"\nrotor's mean speed over the steady part, bar {100 * SPEED_BAR:g} %")
    print(f"{'run':14}{'worst error %':>14}{'stated %':>10}  {'bar':7}{'motor against it %':>19}")
    for case, truth in truths.items():
        true = mean_speed(truth.times, truth[ROTOR_ANGLE], REST_S + STEADY_S).value
        found = []
        for seed in seeds:
            done = track(bench, filmed(bench, truth, seed).take)
            times = done.motion.times + done.zero_in_take_s
            found.append(mean_speed(times, done.motion[ROTOR_ANGLE], REST_S + STEADY_S))
        worst = max(abs(speed.value / true - 1) for speed in found)
        stated = median(speed.standard_error for speed in found) / true
        figures = f"{100 * worst:14.4f}{100 * stated:10.4f}"
        motor = 100 * (case.speed / true - 1)
        print(f"{case.mode:8}{case.speed:4.0f}  {figures}  {met(worst, SPEED_BAR):7}{motor:19.4f}")


def print_time(bench: BenchFile, truth: TimeSeries, samples: int) -> None:
    """Print what a long take costs; the motion is repeated."""
    scene = filmed(bench, repeated(truth, samples), 1)
    given = layout(bench)
    points = raw_points(scene.take, *given)
    print(f"\n{samples} samples, best of 5 on the clock [s], bar {SECONDS_BAR:g} s at {SAMPLES}")
    print(f"{'points out of the take':28}{best(lambda: raw_points(scene.take, *given)):7.3f}")
    print(f"{'recipe default':28}{best(lambda: CLEANING['default'](points)):7.3f}")
    print(f"{'recipe thesis':28}{best(lambda: CLEANING['thesis'](points)):7.3f}")
    whole = best(lambda: track(bench, scene.take))
    print(f"{'make_track, all of it':28}{whole:7.3f}  {met(whole, SECONDS_BAR)}")


def repeated(truth: TimeSeries, samples: int) -> TimeSeries:
    """Return a motion of many samples: the run forth and back, so that nothing jumps."""
    both = np.concatenate([truth.values, truth.values[::-1]])
    values = np.tile(both, (samples // len(both) + 1, 1))[:samples]
    rate = (len(truth) - 1) / (truth.times[-1] - truth.times[0])
    return TimeSeries(
        np.arange(samples) / rate, values, truth.names, np.ones(values.shape, dtype=bool)
    )


def best(run: Callable[[], object]) -> float:
    """Return the shortest of five runs on the clock [s]."""
    times = []
    for _ in range(5):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return min(times)


if __name__ == "__main__":
    main()
