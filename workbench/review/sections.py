"""The sections of the report, each a title and what makes its body.

To add one, write a function from a `Comparison` to HTML and name it in `SECTIONS`. A section whose
body is empty is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from markupsafe import Markup

from workbench.motion import FOOT
from workbench.review.comparison import Comparison
from workbench.review.headline import HEADINGS, headline, misfit_rows
from workbench.review.page import figure, table, warning_list
from workbench.review.plots import (
    error_plot,
    motion_plot,
    speed_plot,
    supply_plot,
    trajectory_plot,
)

__all__ = ["SECTIONS", "Section"]


class Section(NamedTuple):
    """A part of the report.

    Args:
        title: its heading.
        body: makes its HTML; empty when there is nothing to say.
    """

    title: str
    body: Callable[[Comparison], Markup]


def _warnings(comparison: Comparison) -> Markup:
    return warning_list(comparison.warnings)


def _headline(comparison: Comparison) -> Markup:
    return table(headline(comparison), HEADINGS, css="numbers compared")


def _misfit(comparison: Comparison) -> Markup:
    rows = [(name[0].upper() + name[1:], rms) for name, rms in misfit_rows(comparison.misfit)]
    return table(rows, ("", "Root mean square")) + figure(
        error_plot(comparison),
        "Distance between robot and twin in the hopping plane. Gaps: the cameras saw nothing.",
    )


def _trajectory(comparison: Comparison) -> Markup:
    who = "the foot's centre" if comparison.mover == FOOT else "T, the tip of the beam,"
    when = "of drive" if comparison.driven else "after the release"
    return figure(
        trajectory_plot(comparison),
        f"Path of {who} during the {comparison.duration_s:g} s {when}. The height is stretched.",
    )


def _motion(comparison: Comparison) -> Markup:
    return figure(motion_plot(comparison), "Foot and T, the tip of the beam, over time.")


def _speed(comparison: Comparison) -> Markup:
    if not comparison.driven:
        return Markup()
    return figure(
        speed_plot(comparison), "Speed of the rotor, as measured and as the twin was driven."
    )


def _supply(comparison: Comparison) -> Markup:
    if comparison.supply is None:
        return Markup()
    return figure(
        supply_plot(comparison.supply, comparison.time_zero),
        "What was set on the supply and read back.",
    )


def _facts(comparison: Comparison) -> Markup:
    return table([("Run", comparison.run), *comparison.facts.items()], css="facts")


def _journal(comparison: Comparison) -> Markup:
    rows = [(f"{time:.2f} s", text) for time, text in comparison.log]
    return table(rows, ("Time", "Event"), css="facts") if rows else Markup()


def _recording(comparison: Comparison) -> Markup:
    return Markup(
        "<p>Both robots move side by side in the recording. "
        "Open it with</p>"
        "<pre>workbench review {}</pre>"
        "<p>or, without a window on this computer, in the browser with <code>--web</code>.</p>"
    ).format(comparison.run)


SECTIONS = (
    Section("Warnings", _warnings),
    Section("Result", _headline),
    Section("Path", _trajectory),
    Section("Error of the twin", _misfit),
    Section("Motion over time", _motion),
    Section("Rotor speed", _speed),
    Section("Supply", _supply),
    Section("Recording", _recording),
    Section("Journal", _journal),
    Section("Facts", _facts),
)
