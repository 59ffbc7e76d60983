"""The report of a run: one HTML page that needs nothing beside it, on screen and on paper."""

from __future__ import annotations

from pathlib import Path

from markupsafe import Markup

from workbench.report.comparison import Comparison
from workbench.report.headline import verdict
from workbench.report.page import picture, write_page
from workbench.report.sections import RECORDING, RESULT, SECTIONS

__all__ = ["write_report"]


def write_report(
    comparison: Comparison, path: Path, jpeg: bytes | None = None, beside: str = ""
) -> None:
    """Write the report to `path`; the same arguments give the same bytes.

    Args:
        comparison: the run and its twin.
        path: the `.html` file; one that is there is replaced.
        jpeg: of its recording in the viewer, where one was taken.
        beside: how the run compares with others, a sentence of the result.
    """
    more = {RECORDING: picture(jpeg, "The recording in the viewer.")}
    if beside:
        more[RESULT] = Markup("<p>{}</p>").format(beside)
    bodies = [
        (section.title, section.body(comparison) + more.get(section, "")) for section in SECTIONS
    ]
    write_page(path, comparison.headline, comparison.run, verdict(comparison), bodies)
