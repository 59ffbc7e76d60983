"""The report of a run: one HTML page that needs nothing beside it, on screen and on paper."""

from __future__ import annotations

from pathlib import Path

import jinja2

from workbench.review import palette
from workbench.review.comparison import Comparison
from workbench.review.headline import verdict
from workbench.review.sections import SECTIONS

__all__ = ["write_report"]


def write_report(comparison: Comparison, path: Path) -> None:
    """Write the report to `path`; the same comparison gives the same bytes.

    Args:
        comparison: the run and its twin.
        path: the `.html` file; one that is there is replaced.
    """
    bodies = [(section.title, section.body(comparison)) for section in SECTIONS]
    page = _template().render(
        title=comparison.title,
        run=comparison.run,
        verdict=verdict(comparison),
        sections=[(title, body) for title, body in bodies if body],
        real=palette.REAL,
        twin=palette.TWIN,
    )
    path.write_text(page, encoding="utf-8", newline="\n")


def _template() -> jinja2.Template:
    rooms = jinja2.PackageLoader("workbench.review", package_path="")
    environment = jinja2.Environment(
        loader=rooms, autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    return environment.get_template("report.html.j2")
