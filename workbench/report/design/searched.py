"""A search that has ended, with all that it leaves in its folder: designs, history, report."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from workbench.design import (
    DesignFiles,
    DistanceDraws,
    Study,
    draw_distances,
    found_by,
    found_object,
    tolerances_of,
    write_history,
)
from workbench.optimize import History
from workbench.report.design.page import write_report
from workbench.versions import versions

__all__ = ["Searched", "finish_search", "search_folder"]


@dataclass(frozen=True, eq=False, repr=False)
class Searched:
    """What a search found.

    Args:
        study: that searched.
        history: of all candidates.
        found: the best design, or those of the Pareto front, best first.
        spread: distances of the first of them over start angle, friction and speed, in draws that
            the search did not use.
        report: HTML page.
    """

    study: Study
    history: History
    found: tuple[DesignFiles, ...]
    spread: DistanceDraws
    report: Path

    @property
    def shape(self) -> Path:
        """Shape file of the best design."""
        return self.found[0].shape

    def as_json(self) -> dict[str, Any]:
        """Return what the command line prints; units are in the names."""
        found = found_object(self.study, self.history, self.found)
        return found | {"distance_spread": self.spread.as_json(), "report": str(self.report)}

    def __repr__(self) -> str:
        """Return it in four lines: the search, its best design, that design's spread, the files."""
        best = self.found[0]
        values = ", ".join(f"{name} {value:.4g}" for name, value in best.values.items())
        return (
            f"Searched: {self.study.problem.words}, {self.history.asked} evaluations\n"
            f"  {best.name}: {values}\n  distance spread: {self.spread.text()}\n"
            f"  shape: {best.shape}, report: {self.report}"
        )


def finish_search(study: Study, history: History) -> Searched:
    """Write designs, history and report of a search into its folder.

    Raises:
        WorkbenchError: when no candidate hopped to its end.
    """
    write_history(study.folder / "history.csv", study, history)
    found = tuple(found_by(study, history, datetime.now().date()))
    page = study.folder / "report.html"
    spread = _spread(study, found[0])
    write_report(page, study, history, found, spread, versions())
    return Searched(study, history, found, spread, page)


def _spread(study: Study, design: DesignFiles) -> DistanceDraws:
    problem, candidate = study.problem, design.trial.candidate
    job = problem.robot(candidate), problem.condition(candidate)
    # a robust search drew by its own seed: its best was chosen for those draws, and not for others
    (spread,) = draw_distances([job], tolerances_of(problem.model), seed=study.settings.seed + 1)
    return spread


def search_folder(searches: Path) -> Path:
    """Return the folder of a new search among others, named by the time."""
    return searches / datetime.now().strftime("%Y-%m-%d_%H%M%S")
