"""The sections of the report, each a title and what makes its body.

To add one, write a function from a `Comparison` to HTML and name it in `SECTIONS`. A section whose
body is empty is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from markupsafe import Markup

from workbench.motion import FOOT
from workbench.report.comparison import Comparison
from workbench.report.evidence_plots import missing_plot, pose_plot, pose_times, validation_plot
from workbench.report.geometry import MISSING
from workbench.report.headline import (
    HEADINGS,
    headline,
    misfit_rows,
    prediction_rows,
    source_rows,
    validation_rows,
)
from workbench.report.page import code, figure, folded, table, warning_list
from workbench.report.plots import (
    error_plot,
    motion_plot,
    phase_plot,
    speed_plot,
    supply_plot,
    trajectory_plot,
)

__all__ = ["RECORDING", "RESULT", "SECTIONS", "ReportSection"]


class ReportSection(NamedTuple):
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
    picture = figure(
        error_plot(comparison),
        "Distance between robot and twin in the hopping plane, on a logarithmic scale. Gaps: the "
        "cameras saw nothing. Grey: up to twice what noise alone would make.",
    )
    return picture + table(rows, ("", "Root mean square", "Largest", "Of noise alone"))


def _sources(comparison: Comparison) -> Markup:
    rows = source_rows(comparison)
    if not rows:
        return Markup()
    hop = comparison.mode == "hop" and comparison.sources is not None
    caution = (
        f" A hop is compared over its first {comparison.sources.until_s:.1f} s only: then it is "
        "chaotic, and a free simulation is off however good its model. Judge the model by the "
        "predictions below."
        if hop and comparison.sources is not None
        else ""
    )
    words = Markup("<p>{}{}</p>").format(
        "Free simulations of the same model, each given more of what was measured; root mean "
        "square distance from the cameras' raw track.",
        caution,
    )
    return words + table(rows, ("", "Error", "Change"), css="numbers worded")


def _validation(comparison: Comparison) -> Markup:
    validation = comparison.validation
    if validation is None:
        return Markup()
    names = (f"Base: {validation.base.name}", f"Extended: {validation.extended.name}")
    words = Markup("<p>{}</p>").format(validation.about)
    return words + figure(
        validation_plot(validation),
        "Distance from where the cameras saw foot and T (T of a clamped foot), root mean square "
        "over 0.25 s, logarithmic. Grey: noise alone.",
    ) + table(validation_rows(comparison), ("Root mean square", *names))  # fmt: skip


def _prediction(comparison: Comparison) -> Markup:
    rows = prediction_rows(comparison)
    if not rows:
        return Markup()
    words = (
        "<p>Root mean square distance of what is observed (foot and T, or T of a clamped foot) "
        "from where the model puts it, started where the robot was seen to be"
        f"{', its rotor turned as measured' if comparison.driven else ''}. What grows with the "
        "time ahead is the model's.</p>"
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


def _pose(comparison: Comparison) -> Markup:
    if not len(comparison.real) or not len(comparison.twin):
        return Markup()
    if comparison.estimate is None:
        beam = "thin line: from the foot to T, for the beam's pose was not estimated"
        beam += f" ({comparison.unestimated})" if comparison.unestimated else ""
    else:
        beam = "its beam as estimated from foot and T, fainter where that is less certain"
    return figure(
        pose_plot(comparison),
        f"From the side, at {len(pose_times(comparison))} instants, the last where T is farthest "
        f"from its twin. Orange: the robot, {beam}. Blue: the twin.",
    )


def _missing(comparison: Comparison) -> Markup:
    if comparison.estimate is None or MISSING["top"][0] not in comparison.estimate:
        return Markup()
    return figure(
        missing_plot(comparison.estimate, comparison.time_zero),
        "The force that the model misses at T, mean over 0.05 s: what it would need in addition to "
        "do as the robot did. Grey: two standard deviations; what lies within may be noise.",
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


def _words(comparison: Comparison) -> Markup:
    """Return what the words of the page mean."""
    del comparison
    return folded("What the words mean", table(_GLOSSARY, css="facts"))


def _recording(comparison: Comparison) -> Markup:
    words = "<p>Both robots move side by side in the recording. Open it with</p>"
    elsewhere = (
        "<p>or, without a window on this computer, in the browser with <code>--web</code>. "
        "Where the runs do not lie in <code>runs</code>, name their folder with "
        "<code>--runs</code>. <code>--video run.mp4</code> films it. What the model gets wrong in "
        "several such runs, and why: <code>workbench diagnose runs</code>.</p>"
    )
    return Markup(words) + code(f"workbench review {comparison.run}") + Markup(elsewhere)


_GLOSSARY = (
    ("T", "the tip of the curved beam, where the rotor sits"),
    ("twin", "the simulation of exactly this run: the same commands, the same release"),
    ("hop height", "how high the foot's centre rises in a turn of the rotor: median of all turns"),
    ("role", "train: a fit may see the run; held out: it only judges models"),
    ("root mean square", "the root of the mean of the squared distances over the run"),
    ("noise", "the scatter of the cameras' track; a perfect model is off by that much"),
    ("estimated state", "the pose that a model has which is corrected towards each picture"),
)

RECORDING = ReportSection("Recording", _recording)
RESULT = ReportSection("Result", _headline)
SECTIONS = (
    ReportSection("Warnings", _warnings),
    ReportSection("Pass or fail", _judged),
    ReportSection("Base and extended model as compared", _validation),
    RESULT,
    ReportSection("Error of the twin", _misfit),
    ReportSection("How much of it is drive, start and model", _sources),
    ReportSection("Prediction", _prediction),
    ReportSection("Pose", _pose),
    ReportSection("Path", _trajectory),
    ReportSection("Motion over time", _motion),
    ReportSection("Missing force", _missing),
    ReportSection("Rotor speed", _speed),
    ReportSection("Supply", _supply),
    RECORDING,
    ReportSection("Journal", _journal),
    ReportSection("Facts", _facts),
    ReportSection("Words", _words),
)
