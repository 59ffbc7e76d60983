"""What searches looked like: figures 6.2 to 6.4 of the thesis, and a front.

Each function adds axes to an empty figure, so that whoever owns the page owns the style.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workbench.optimize import Generation, History, Space, Trial

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_front", "draw_generations", "draw_repeats", "draw_variables"]

_BAND = 0.15  # opacity of a range
_MARK, _BAR = 4.0, 12.0  # size of a trial's mark, of the start's [pt]
_SHIFT = 0.25  # of the marks of several searches beside each other, of a variable's place


def draw_generations(figure: Figure, histories: Mapping[str, History], number: str) -> None:
    """Draw the best so far, the best and the mean of each generation, as figure 6.2 does.

    The best is the trial of the least fitness; the mean leaves out what failed, the thesis counted
    failures as -2 m.

    Args:
        figure: empty.
        histories: by what distinguishes them, `17 rad/s`.
        number: of the evaluations, with its unit, `distance_m`.
    """
    best, mean = figure.subplots(2, 1, sharex=True)
    for name, history in histories.items():
        counted = np.arange(1, len(history.generations) + 1)
        (line,) = best.step(counted, _best_so_far(history, number), where="post", label=name)
        of_each = [_number_of(g.best, number) for g in history.generations]
        best.plot(counted, of_each, "o", color=line.get_color(), alpha=0.5, markersize=5)
        mean.plot(counted, [_mean(g, number) for g in history.generations])
    best.set(title="line: best so far; dots: best of each generation", ylabel=_words(number))
    mean.set(title="mean of those that did not fail", ylabel=_words(number), xlabel="generation")
    mean.xaxis.get_major_locator().set_params(integer=True)
    if len(histories) > 1:
        best.legend(ncols=3, fontsize="small")


def _best_so_far(history: History, number: str) -> list[float]:
    """Return the number of the best trial up to each generation."""
    best, values = None, list[float]()
    for generation in history.generations:
        one = generation.best
        if best is None or one.evaluation.fitness[0] < best.evaluation.fitness[0]:
            best = one
        values.append(_number_of(best, number))
    return values


def draw_repeats(figure: Figure, histories: Sequence[History], number: str) -> None:
    """Draw the best so far of repeated searches over the evaluations, as figure 6.4 does.

    One line is one search; the thick one is their median, the band their range.

    Args:
        figure: empty.
        histories: of searches that differ in nothing but the seed.
        number: of the evaluations, with its unit.
    """
    axes = figure.subplots()
    steps = [_so_far(history, number) for history in histories]
    for asked, reached in steps:
        axes.step(asked, reached, where="post", linewidth=0.6, color="C0", alpha=0.6)
    if steps:
        grid = np.arange(max(asked[0] for asked, _ in steps), max(a[-1] for a, _ in steps) + 1)
        rows = np.array([r[np.searchsorted(a, grid, side="right") - 1] for a, r in steps])
        axes.fill_between(
            grid, rows.min(axis=0), rows.max(axis=0), step="post", color="C0", alpha=_BAND, lw=0
        )
        axes.step(grid, np.median(rows, axis=0), where="post", color="C0", linewidth=2)
        axes.set_title(f"best so far of {len(steps)} searches, median and range")
    axes.set(xlabel="evaluations", ylabel=_words(number))


def draw_variables(figure: Figure, space: Space, histories: Mapping[str, History]) -> None:
    """Draw the best candidates' variables between their bounds, beside the start.

    Args:
        figure: empty.
        space: that was searched.
        histories: by what distinguishes them.
    """
    axes = figure.subplots()
    at = np.arange(len(space), dtype=np.float64)
    axes.bar(at, np.ones(len(space)), width=0.7, color="0.5", alpha=_BAND, label="bounds")
    axes.plot(at, _between(space, space.start), "_", markersize=_BAR, color="0.3", label="start")
    shifts = np.linspace(-_SHIFT, _SHIFT, len(histories)) if len(histories) > 1 else np.zeros(1)
    for shift, (name, history) in zip(shifts, histories.items(), strict=True):
        fractions = _between(space, history.best.candidate)
        axes.plot(at + shift, fractions, "o", markersize=_MARK, label=name)
    axes.set(ylabel="place between the bounds", ylim=(-0.03, 1.03))
    axes.set_xticks(at, space.names, rotation=60, ha="right")
    figure.legend(ncols=4, fontsize="small", loc="outside upper right")


def draw_front(figure: Figure, history: History, numbers: tuple[str, str]) -> None:
    """Draw all trials that did not fail, and among them those that none beats in both goals.

    Args:
        figure: empty.
        history: of a search for two goals.
        numbers: of the evaluations, with their units, that the two goals are about.
    """
    axes = figure.subplots()
    good = [trial for trial in history.trials if trial.evaluation.failure is None]
    front = history.front()
    x, y = ([_number_of(trial, number) for trial in good] for number in numbers)
    axes.plot(x, y, "o", markersize=_MARK, color="0.6")
    x, y = ([_number_of(trial, number) for trial in front] for number in numbers)
    label = f"front, {len(front)} of {len(good)}"
    axes.plot(x, y, "o-", markersize=_MARK, color="C0", label=label)
    axes.set(xlabel=_words(numbers[0]), ylabel=_words(numbers[1]))
    axes.legend()


def _between(space: Space, candidate: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where each variable lies, 0 at its lower bound and 1 at its upper."""
    return np.asarray((candidate - space.lower) / space.widths, dtype=np.float64)


def _so_far(history: History, number: str) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return after how many evaluations a better trial came, and its number."""
    fitness = np.array([trial.evaluation.fitness[0] for trial in history.trials])
    rows = np.flatnonzero(np.minimum.accumulate(fitness) == fitness)
    rows = rows[np.r_[True, np.diff(fitness[rows]) < 0]]
    asked = np.append(rows + 1, len(fitness))
    reached = [_number_of(history.trials[row], number) for row in rows]
    return asked, np.array([*reached, reached[-1]])


def _number_of(trial: Trial, number: str) -> float:
    return trial.evaluation.numbers.get(number, float("nan"))


def _mean(generation: Generation, number: str) -> float:
    good = [_number_of(t, number) for t in generation.trials if t.evaluation.failure is None]
    return float(np.mean(good)) if good else float("nan")


def _words(number: str) -> str:
    """Return `distance [m]` of `distance_m`."""
    name, _, unit = number.rpartition("_")
    return f"{name.replace('_', ' ')} [{unit}]" if name else number
