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
from workbench.review.headline import HEADINGS, headline, misfit_rows, prediction_rows
from workbench.review.page import code, figure, table, warning_list
from workbench.review.plots import (
    error_plot,
    motion_plot,
    phase_plot,
    speed_plot,
    supply_plot,
    trajectory_plot,
)

__all__ = ["RECORDING", "RESULT", "SECTIONS", "Section"]


class Section(NamedTuple):
    """A part of the report.

    Args:
        title: its heading.
        body: makes its HTML; empty when there is nothing to say.
    """

    title: str
    body: Callable[[Comparison], Markup]


def _warnings(comparison: Comparison) -> Markup:
    mark = () if comparison.mark is None else (comparison.mark,)
    return warning_list((*mark, *comparison.warnings))


def _judged(comparison: Comparison) -> Markup:
    rows = [
        (*one.words, Markup('<span class="{0}">{0}</span>').format(one.mark))
        for one in comparison.judged
    ]
    heads = ("", "Measured", "Expected", "")
    return table(rows, heads, css="numbers judged") if rows else Markup()


def _headline(comparison: Comparison) -> Markup:
    return table(headline(comparison), HEADINGS, css="numbers compared")


def _misfit(comparison: Comparison) -> Markup:
    largest, noise = comparison.largest_error(), comparison.error_noise()
    rows = [
        (
            name[0].upper() + name[1:],
            rms,
            f"{largest[name].mm:.1f} mm at {largest[name].time_s:.2f} s" if name in largest else "",
            f"{noise[name]:.2f} mm" if name in noise else "",
        )
        for name, rms in misfit_rows(comparison.misfit)
    ]
    return table(rows, ("", "Root mean square", "Largest", "Of noise alone")) + figure(
        error_plot(comparison),
        "Distance between robot and twin in the hopping plane. Gaps: the cameras saw nothing. "
        "Grey: up to twice what noise alone would make.",
    )


def _prediction(comparison: Comparison) -> Markup:
    rows = prediction_rows(comparison)
    if not rows:
        return Markup()
    what = "the drive" if comparison.driven else "the release"
    words = (
        "<p>Root mean square distance of what is observed (foot and T, or T of a clamped foot) "
        "from where the model puts it, started where the robot was seen to be. What grows with the "
        f"time ahead is the model's; what is in the last line only is {what}'s.</p>"
    )
    return Markup(words) + table(rows, ("", "Root mean square"))


def _trajectory(comparison: Comparison) -> Markup:
    who = "the foot's centre" if comparison.mover == FOOT else "T, the tip of the beam,"
    when = "of drive" if comparison.driven else "after the release"
    if not any(len(motion) for motion in comparison.motions):
        return Markup()
    return figure(
        trajectory_plot(comparison),
        f"Path of {who} during the {comparison.duration_s:g} s {when}. The height is stretched.",
    )


def _motion(comparison: Comparison) -> Markup:
    return figure(
        motion_plot(comparison),
        "Foot and T, the tip of the beam, over time. Bands: twice the noise at rest.",
    )


def _speed(comparison: Comparison) -> Markup:
    if not comparison.driven:
        return Markup()
    return figure(
        speed_plot(comparison), "Speed of the rotor, as measured and as the twin was driven."
    ) + figure(
        phase_plot(comparison), "By how much the twin's rotor is ahead of the robot's; turns count."
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
    words = "<p>Both robots move side by side in the recording. Open it with</p>"
    elsewhere = (
        "<p>or, without a window on this computer, in the browser with <code>--web</code>. "
        "Where the runs do not lie in <code>runs</code>, name their folder with "
        "<code>--runs</code>. <code>--video run.mp4</code> films it.</p>"
    )
    return Markup(words) + code(f"workbench review {comparison.run}") + Markup(elsewhere)


RECORDING = Section("Recording", _recording)
RESULT = Section("Result", _headline)
SECTIONS = (
    Section("Warnings", _warnings),
    Section("Pass or fail", _judged),
    RESULT,
    Section("Path", _trajectory),
    Section("Error of the twin", _misfit),
    Section("Prediction", _prediction),
    Section("Motion over time", _motion),
    Section("Rotor speed", _speed),
    Section("Supply", _supply),
    RECORDING,
    Section("Journal", _journal),
    Section("Facts", _facts),
)
