"""How often our intervals cover the truth: many drawn robots, one fit each, some at a time.

A repeat is one line of JSON. With a log file they are kept, and a later call does only those that
are missing.
"""

from __future__ import annotations

import json
import multiprocessing
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass
from itertools import count as counted
from pathlib import Path

import numpy as np
from identify_truth import NAMES, Take, drawn, taken, thesis_files

from workbench.fit import MeasuredRun
from workbench.identify import Identification, identify
from workbench.motion import FOOT, ROTOR, ROTOR_ANGLE, TOP, rotor_angle
from workbench.timeseries import TimeSeries

__all__ = ["Setting", "as_measured", "print_repeats"]

LEAST_SHARE, MOST_SHARE = 0.80, 0.98  # of the repeats that a 90 % interval must cover
BARS = {name: 0.01 if name.endswith("stiffness") else 0.10 for name in NAMES}
BAR_S = 180.0  # of one fit on two cores
SHORT = dict(zip(NAMES, ("k", "kT", "d", "dT"), strict=True))


@dataclass(frozen=True)
class Setting:
    """What all repeats of a table share: increments of the true beam, length of a run [s]."""

    increments: int
    run_s: float


@dataclass(frozen=True)
class Repeat:
    """What one repeat came to.

    Args:
        seed: of the truth and its runs.
        setting: shared by the table.
        truth: of each parameter, SI.
        value: of each parameter that was estimated.
        interval90: of the same.
        not_determined: in the fit's words.
        warnings: in the fit's words.
        fitted_increments: of the beam that the fit chose.
        misfit: in noise deviations.
        seconds: of the fit in one process, another one beside it.
    """

    seed: int
    setting: Setting
    truth: dict[str, float]
    value: dict[str, float]
    interval90: dict[str, tuple[float, float]]
    not_determined: list[str]
    warnings: list[str]
    fitted_increments: int
    misfit: float
    seconds: float

    def error(self, name: str) -> float:
        """Return the share by which a parameter is off, NaN where it was not estimated."""
        return self.value.get(name, np.nan) / self.truth[name] - 1

    def covers(self, name: str) -> bool:
        """Tell whether there is an interval and the truth lies in it."""
        low, high = self.interval90.get(name, (np.nan, np.nan))
        return low <= self.truth[name] <= high

    def as_line(self) -> str:
        """Return it as one line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_line(cls, line: str) -> Repeat:
        """Read a line that `as_line` wrote."""
        read = json.loads(line)
        pairs = {name: (low, high) for name, (low, high) in read["interval90"].items()}
        return cls(**(read | {"setting": Setting(**read["setting"]), "interval90": pairs}))


def as_measured(take: Take) -> MeasuredRun:
    """Return a take as our fit sees it: the angle at rest is read off the data."""
    columns = {
        name: column
        for names, path in ((TOP, take.top), (ROTOR, take.rotor), (FOOT, take.foot))
        for name, column in zip(names, path.T, strict=True)
    }
    columns[ROTOR_ANGLE] = rotor_angle(take.top, take.rotor)
    start = float(np.median(columns[ROTOR_ANGLE][take.times < 0]))
    series = TimeSeries.of(take.times, columns)
    return MeasuredRun(take.name, take.mode, series, take.steps, start, take.pull)


def repeat(seed: int, setting: Setting) -> Repeat | str:
    """Draw a robot, film it, fit it from the stated values on one thread.

    Returns:
        Why not, for a robot that falls in one of its runs.
    """
    truth = drawn(seed, setting.increments)
    try:
        runs = [as_measured(take) for take in taken(truth, setting.run_s, threads=1)]
    except RuntimeError as error:
        return str(error)
    begin = time.perf_counter()
    found = identify(runs, *thesis_files(), NAMES, threads=1)
    return _told(found, seed, setting, dict(truth.values), time.perf_counter() - begin)


def print_repeats(
    count: int, setting: Setting, log: Path | None = None, processes: int = 2
) -> None:
    """Do the repeats that the log lacks, print each as it ends, then the counts."""
    known = [one for one in _kept(log) if one.setting == setting][:count]
    print(
        f"{count} robots of {setting.increments} increments, parameters off by up to 30 %, "
        f"runs of {setting.run_s:g} s; {len(known)} of them in the log already"
    )
    head = "".join(f"{SHORT[name] + ' err %':>10} in" for name in NAMES)
    print(f"{'seed':>5}{head}{'beam':>6}{'misfit':>8}{'s':>7}")
    for one in known:
        _print_repeat(one)
    before = {one.seed for one in known}
    seeds = (seed for seed in counted() if seed not in before)
    for one in _done(seeds, count - len(known), setting, processes):
        if isinstance(one, str):
            print(f"{one}; another one is drawn", flush=True)
            continue
        known.append(one)
        _print_repeat(one)
        if log is not None:
            with log.open("a", encoding="utf-8") as file:
                file.write(one.as_line() + "\n")
    _print_counts(known)


def _done(
    seeds: Iterator[int], wanted: int, setting: Setting, processes: int
) -> Iterator[Repeat | str]:
    """Return repeats in the order in which they end, and why a robot gave none."""
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=fresh) as pool:
        running: set[Future[Repeat | str]] = set()
        while wanted:
            while len(running) < min(processes, wanted):
                running.add(pool.submit(repeat, next(seeds), setting))
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                result = future.result()
                wanted -= isinstance(result, Repeat)
                yield result


def _told(
    found: Identification, seed: int, setting: Setting, truth: dict[str, float], seconds: float
) -> Repeat:
    estimates = found.estimates
    return Repeat(
        seed=seed,
        setting=setting,
        truth=truth,
        value={name: one.value for name, one in estimates.items()},
        interval90={name: (one.low, one.high) for name, one in estimates.items()},
        not_determined=[str(one) for one in found.not_determined],
        warnings=list(found.warnings),
        fitted_increments=found.robot.increments,
        misfit=found.misfit,
        seconds=seconds,
    )


def _kept(log: Path | None) -> list[Repeat]:
    if log is None or not log.exists():
        return []
    return [Repeat.from_line(line) for line in log.read_text(encoding="utf-8").splitlines()]


def _print_repeat(one: Repeat) -> None:
    cells = ""
    for name in NAMES:
        given = name in one.value
        shown = f"{100 * one.error(name):10.3f}" if given else f"{'not estimated':>10}"
        cells += f"{shown} {'y' if one.covers(name) else 'n':>2}"
    print(
        f"{one.seed:5d}{cells}{one.fitted_increments:6d}{one.misfit:8.3f}{one.seconds:7.1f}",
        flush=True,
    )


def _print_counts(repeats: Sequence[Repeat]) -> None:
    count = len(repeats)
    low, high = LEAST_SHARE * count, MOST_SHARE * count
    print(f"\n{'':17}{'covered':>9}{'bar':>11}{'':8}{'worst err %':>12}{'bar %':>7}")
    for name in NAMES:
        covered = sum(one.covers(name) for one in repeats)
        given = [abs(one.error(name)) for one in repeats if name in one.value]
        worst, silent = max(given, default=np.inf), count - len(given)
        fits, near = low <= covered <= high, worst <= BARS[name]
        missing = f", not estimated in {silent}" if silent else ""
        print(
            f"{name:17}{covered:9d}{low:6.0f}-{high:.0f}{'':2}{_verdict(fits):8}"
            f"{100 * worst:12.3f}{100 * BARS[name]:7.0f}  {_verdict(near)}{missing}"
        )
    slowest = max(one.seconds for one in repeats)
    print(
        f"slowest fit {slowest:.0f} s on one core with another beside it; "
        f"bar {BAR_S:.0f} s on two cores, {_verdict(slowest <= BAR_S)}"
    )


def _verdict(met: bool) -> str:
    return "met" if met else "missed"
