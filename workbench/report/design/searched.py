"""A search that has ended, with all that it leaves in its folder: designs, history, report."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from workbench.design import DesignFiles, Study, found_by, found_object, write_history
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
        report: HTML page.
    """

    study: Study
    history: History
    found: tuple[DesignFiles, ...]
    report: Path

    @property
    def shape(self) -> Path:
        """Shape file of the best design."""
        return self.found[0].shape

    def as_json(self) -> dict[str, Any]:
        """Return what the command line prints; units are in the names."""
        return found_object(self.study, self.history, self.found) | {"report": str(self.report)}

    def __repr__(self) -> str:
        """Return it in three lines: the search, its best design, the files."""
        best = self.found[0]
        values = ", ".join(f"{name} {value:.4g}" for name, value in best.values.items())
        return (
            f"Searched: {self.study.problem.words}, {self.history.asked} evaluations\n"
            f"  {best.name}: {values}\n  shape: {best.shape}, report: {self.report}"
        )


def finish_search(study: Study, history: History) -> Searched:
    """Write designs, history and report of a search into its folder.

    Raises:
        WorkbenchError: when no candidate hopped to its end.
    """
    write_history(study.folder / "history.csv", study, history)
    found = tuple(found_by(study, history, datetime.now().date()))
    page = study.folder / "report.html"
    write_report(page, study, history, found, versions())
    return Searched(study, history, found, page)


def search_folder(searches: Path) -> Path:
    """Return the folder of a new search among others, named by the time."""
    return searches / datetime.now().strftime("%Y-%m-%d_%H%M%S")
