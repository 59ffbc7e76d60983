"""A template: the strip, how it is laid on paper, and what the printer's error is undone by."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import date

from workbench.template.canvas import NO_COMPENSATION, Compensation
from workbench.template.metal import Metal
from workbench.template.paper import Paper
from workbench.template.strip import Strip
from workbench.template.tiles import PageLayout, lay_out

__all__ = ["TemplatePages", "make_sheet"]

_UNSAFE = re.compile(r"[^\w.-]+")  # what a shape's name may hold and a file's may not


@dataclass(frozen=True)
class TemplatePages:
    """A template on its pages.

    Args:
        strip: that it shows.
        layout: on paper.
        mirror: whether it is for the strip's other side.
        day: it is dated.
        compensation: of the printer.
        metal: of the strip, where the radii to bend to are on a page of their own.
    """

    strip: Strip
    layout: PageLayout
    mirror: bool
    day: date
    compensation: Compensation = NO_COMPENSATION
    metal: Metal | None = None

    @property
    def pages(self) -> int:
        """Return how many pages it has."""
        return len(self.layout.tiles) + (self.metal is not None)

    @property
    def stem(self) -> str:
        """Return the name of its files without ending."""
        words = [self.strip.name, self.strip.short_hash, self.layout.paper.name]
        words += ["mirrored"] if self.mirror else []
        words += ["overbend"] if self.metal is not None else []
        if self.compensation != NO_COMPENSATION:
            words += [f"h{100 / self.compensation.h:.2f}", f"v{100 / self.compensation.v:.2f}"]
        return _UNSAFE.sub("_", "-".join(words))


def make_sheet(
    strip: Strip,
    paper: Paper,
    day: date,
    mirror: bool = False,
    compensation: Compensation = NO_COMPENSATION,
    metal: Metal | None = None,
) -> TemplatePages:
    """Return the template of a strip, laid on the fewest pages; arguments as for `Sheet`."""
    return TemplatePages(strip, lay_out(strip, paper, mirror), mirror, day, compensation, metal)
