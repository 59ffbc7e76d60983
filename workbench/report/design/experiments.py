"""The thesis' experiments (section 5.3), each as searches and a table beside the thesis' numbers.

The searches of all experiments lie in one folder, so that one that two of them need is done once,
and whatever was begun goes on where it was stopped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.design import Appraisal, Settings, Study, appraise
from workbench.errors import InputError
from workbench.optimize import History
from workbench.progress import Progress
from workbench.report.design.figures import path_figure, shape_figure
from workbench.report.design.search_figures import draw_generations, draw_repeats
from workbench.report.drawing import drawn
from workbench.schemas import Document, ModelFile, ShapeFile
from workbench.sim import Fanout

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["EXPERIMENTS", "SEEDS", "SPEEDS", "ExperimentFigure", "ExperimentTable", "Lab", "Part"]

SPEEDS = (17.0, 18.0, 19.0, 20.0, 21.0)
"""Of the thesis' table in section 6.1 [rad/s]; its figure 6.2 also has 16."""
SEEDS = tuple(range(7))
_SLOWEST, _MAIN, _OTHER = 16.0, 17.0, 19.0

_LEAST_M = 0.001  # of a distance that another is a share of
_THESIS_SHAPES = {
    17.0: (18.87, 21.27, 1.13, 2.88),
    18.0: (25.53, 20.58, 0.81, 2.99),
    19.0: (19.33, 20.75, 1.07, 3.00),
    20.0: (24.37, 18.29, 0.75, 3.20),
    21.0: (25.03, 19.71, 0.79, 3.21),
}
"""Speed [rad/s] -> L0 [cm], dh [cm], e, zeta_L [Hz] of the optimised shape (section 6.1)."""


class ExperimentTable(NamedTuple):
    """A table of an experiment.

    Args:
        title: of it.
        heads: of the columns.
        rows: cells as text.
        note: what the thesis says of it.
    """

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


class ExperimentFigure(NamedTuple):
    """A figure of an experiment.

    Args:
        name: keeps it apart from others on a page.
        title: heading.
        caption: of it.
        figure: drawn.
    """

    name: str
    title: str
    caption: str
    figure: Figure


Part = ExperimentTable | ExperimentFigure
"""What an experiment yields."""


class FinishedSearch(NamedTuple):
    """A search that is done."""

    study: Study
    history: History

    @property
    def best(self) -> NDArray[np.float64]:
        """The best candidate, (d,) [unit of each variable]."""
        return self.history.best.candidate

    @property
    def distance(self) -> float:
        """Of the best candidate [m]; NaN when every candidate failed."""
        return self.history.best.evaluation.numbers.get("distance_m", float("nan"))


@dataclass(frozen=True)
class Lab:
    """Where the experiments are done.

    Args:
        folder: of all their searches.
        settings: of every search, but for speed and seed.
        model: of the robot.
        start: the shape where every search begins.
        fanout: what simulates.
        progress: receives how far a search is after each generation.
        report: receives what is begun.
    """

    folder: Path
    settings: Settings
    model: Document[ModelFile]
    start: Document[ShapeFile]
    fanout: Fanout
    progress: Progress
    report: Progress

    def searched(self, omega: float, seed: int = 0) -> FinishedSearch:
        """Return the search for a speed; it is begun, gone on with, or read when it is done.

        Raises:
            InputError: when its folder holds a search with other settings.
        """
        settings = replace(self.settings, omega=omega, seed=seed)
        folder = self.folder / f"{settings.algorithm}-{omega:g}-seed-{seed}"
        if folder.exists():
            study = Study.resume(folder)
            if study.settings != settings:
                raise InputError(
                    f"{folder}: holds a search with other settings; give another --out"
                )
        else:
            study = Study.begin(folder, settings, self.model, self.start)
        self.report(f"{omega:g} rad/s, seed {seed}: {settings.evaluations} evaluations, {folder}")
        return FinishedSearch(study, study.run(self.fanout, self.progress))

    def first(self, omega: float) -> Appraisal:
        """Return what the first shape is at a speed."""
        problem = replace(self.settings, omega=omega).problem(
            self.model.content, self.start.content
        )
        return appraise(problem, problem.space.start)


def _increase(lab: Lab, seeds: Sequence[int], speeds: Sequence[float]) -> Iterator[Part]:
    """Compare the distance before and after (5.3.1, figure 6.1)."""
    first = lab.first(_MAIN)
    found = lab.searched(_MAIN, seeds[0])
    before = first.values.get("distance", float("nan"))
    yield ExperimentTable(
        f"distance in {lab.settings.duration:g} s at {_MAIN:g} rad/s",
        ["", "first [m]", "best [m]", "increase [%]"],
        [
            [
                "ours",
                f"{before:.3f}",
                f"{found.distance:.3f}",
                _increase_of(before, found.distance),
            ],
            ["thesis", "about 0.2", "1.2 to 1.5", "almost 600"],
        ],
        "figure 6.1, section 7.1",
    )
    best = appraise(found.study.problem, found.best)
    paths = path_figure({"first shape": first.motion, "best shape": best.motion})
    yield ExperimentFigure("path", "Paths", "The foot before and after, as in figure 6.1.", paths)


def _speeds(lab: Lab, seeds: Sequence[int], speeds: Sequence[float]) -> Iterator[Part]:
    """Search at every speed (figures 6.2 and 6.3, table of section 6.1)."""
    rows, shapes = [], []
    histories, drawings = {}, {}
    root = np.array([lab.model.content.values()["beam_root"], 0.0])
    for omega in (_SLOWEST, *speeds):
        first, found = lab.first(omega), lab.searched(omega, seeds[0])
        histories[f"{omega:g} rad/s"] = found.history
        before = first.values.get("distance", float("nan"))
        rows.append(
            [f"{omega:g}", f"{before:.3f}", f"{found.distance:.3f}",
             _increase_of(before, found.distance)]
        )  # fmt: skip
        if omega in _THESIS_SHAPES:
            best = appraise(found.study.problem, found.best)
            shapes.append(_shape_row(omega, best))
            drawings[f"{omega:g} rad/s"] = [best.standing, best.free + root]
    yield ExperimentTable(
        f"distance in {lab.settings.duration:g} s, before and after",
        ["speed [rad/s]", "first [m]", "best [m]", "increase [%]"],
        rows,
        "the thesis shows these in figure 6.2 only: every speed gains, 18 and 19 begin higher",
    )
    yield ExperimentTable(
        "shape of the free strip, ours / thesis",
        ["speed [rad/s]", "L0 [cm]", "dh [cm]", "e", "zeta L [Hz]"],
        shapes,
        "table of section 6.1; the thesis finds no formula for a good shape either (7.1)",
    )
    progress = drawn(lambda f: draw_generations(f, histories, "distance_m"), 4.6)
    yield ExperimentFigure("progress", "Searches", "As in figure 6.2.", progress)
    foot = lab.model.content.values()["foot_length"]
    caption = "As in figure 6.3: standing, and thin the free strip."
    yield ExperimentFigure("shapes", "Shapes found", caption, shape_figure(drawings, foot))


def _repeatability(lab: Lab, seeds: Sequence[int], speeds: Sequence[float]) -> Iterator[Part]:
    """Repeat one search with other seeds (5.3.2, figure 6.4)."""
    before = lab.first(_MAIN).values.get("distance", float("nan"))
    found = {seed: lab.searched(_MAIN, seed) for seed in seeds}
    best = {seed: one.distance for seed, one in found.items()}
    rows = [
        [str(seed), f"{distance:.3f}", _increase_of(before, distance)]
        for seed, distance in best.items()
    ]
    middle = median(best.values())
    scatter = (max(best.values()) - min(best.values())) / middle
    rows += [
        ["median", f"{middle:.3f}", _increase_of(before, middle)],
        ["spread (max - min) / median", f"{100 * scatter:.0f} %", ""],
        ["thesis", "0.97 to 1.48, once 2.05", "at least 200"],
    ]
    yield ExperimentTable(
        f"best distance at {_MAIN:g} rad/s, {len(seeds)} seeds; the first shape {before:.3f} m",
        ["seed", "best [m]", "increase [%]"],
        rows,
        "figure 6.4, section 7.2: a spread of about 40 % without the outlier",
    )
    histories = [one.history for one in found.values()]
    repeats = drawn(lambda f: draw_repeats(f, histories, "distance_m"), 3.4)
    yield ExperimentFigure(
        "repeats", "Searches", "Best so far of every seed, as in figure 6.4.", repeats
    )


def _cross(lab: Lab, seeds: Sequence[int], speeds: Sequence[float]) -> Iterator[Part]:
    """Run shapes designed for two speeds at both (5.3.3, section 6.3)."""
    designed = [lab.searched(omega, seeds[0]) for omega in (_MAIN, _OTHER)]
    rows = [["first shape", *(_distance(lab.first(omega)) for omega in (_MAIN, _OTHER))]]
    for found in designed:
        driven = (replace(found.study.problem, omega=omega) for omega in (_MAIN, _OTHER))
        distances = [_distance(appraise(problem, found.best)) for problem in driven]
        rows.append([f"designed for {found.study.settings.omega:g} rad/s", *distances])
    yield ExperimentTable(
        f"distance in {lab.settings.duration:g} s at both speeds, simulated",
        ["", f"at {_MAIN:g} rad/s [m]", f"at {_OTHER:g} rad/s [m]"],
        rows,
        "figures 6.5 to 6.7, no numbers: each shape goes farther at its own speed. On the bench: "
        "protocols/hop-both-speeds.yaml",
    )


def _resonance(lab: Lab, seeds: Sequence[int], speeds: Sequence[float]) -> Iterator[Part]:
    """Ask whether zeta_L of the shapes found follows the drive (table of 6.1, section 7.1)."""
    first = lab.first(_MAIN).resonances.zeta_L_hz
    rows, drives, found = [], [], []
    for omega in speeds:
        search = lab.searched(omega, seeds[0])
        drives.append(omega / (2 * np.pi))
        found.append(appraise(search.study.problem, search.best).resonances.zeta_L_hz)
        nearer = abs(found[-1] - drives[-1]) < abs(first - drives[-1])
        theirs = _THESIS_SHAPES[omega][3] if omega in _THESIS_SHAPES else float("nan")
        rows.append(
            [f"{omega:g}", f"{drives[-1]:.2f}", f"{first:.2f}", f"{found[-1]:.2f}",
             "yes" if nearer else "no", f"{theirs:.2f}"]
        )  # fmt: skip
    slope = float(np.polyfit(drives, found, 1)[0]) if len(found) > 1 else float("nan")
    yield ExperimentTable(
        f"longitudinal resonance of the shapes found, {slope:.2f} Hz per Hz of drive",
        ["speed [rad/s]", "drive [Hz]", "first [Hz]", "found [Hz]", "nearer", "thesis [Hz]"],
        rows,
        "section 7.1: shifted towards the actuation speed; the thesis' own rise by "
        f"{_thesis_slope():.2f} Hz per Hz",
    )


def _thesis_slope() -> float:
    drives = np.array(list(_THESIS_SHAPES)) / (2 * np.pi)
    return float(np.polyfit(drives, [row[3] for row in _THESIS_SHAPES.values()], 1)[0])


def _shape_row(omega: float, found: Appraisal) -> list[str]:
    free = found.free_metrics
    ours = (100 * free.L0_m, 100 * free.dh_m, free.e, found.resonances.zeta_L_hz)
    pairs = zip(ours, _THESIS_SHAPES[omega], strict=True)
    return [f"{omega:g}", *(f"{mine:.2f} / {theirs:.2f}" for mine, theirs in pairs)]


def _increase_of(before: float, after: float) -> str:
    return f"{100 * (after / before - 1):+.0f}" if before > _LEAST_M else "-"


def _distance(found: Appraisal) -> str:
    return f"{found.values['distance']:.3f}" if found.values else found.outcome


EXPERIMENTS: Mapping[str, Callable[[Lab, Sequence[int], Sequence[float]], Iterable[Part]]] = {
    "increase": _increase,
    "speeds": _speeds,
    "repeatability": _repeatability,
    "cross": _cross,
    "resonance": _resonance,
}
"""Name -> what yields its tables and figures."""
