"""Report a deviation and its cost on one page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from markupsafe import Markup

from workbench.as_built import Cost, Deviation
from workbench.photo import AsBent
from workbench.report.as_built.figure import deviation_figure
from workbench.report.drawing import as_svg
from workbench.report.page import figure, table, warning_list, write_page

__all__ = ["change_in_words", "write_readback"]

_NOTES = {
    "corners": "corners of the board that were used",
    "board_residual_mm": "misfit of the board's corners [mm]",
    "edge_noise_mm": "scatter of the strip's contour [mm]",
    "noise_mm": "scatter of the points [mm]",
    "points": "points",
    "scale": "how much larger the strip appears",
    "camera_height_mm": "height of the camera [mm]",
    "mirrored": "seen from the strip's other side",
}


def write_readback(
    path: Path,
    name: str,
    bent: AsBent,
    deviation: Deviation,
    cost: Cost | None,
    made_from: Mapping[str, str],
) -> None:
    """Write the page; an `.svg` of the picture is put beside it.

    Args:
        path: the `.html` file; one that is there is replaced.
        name: of the beam.
        bent: as it was read.
        deviation: from its target.
        cost: in distance; None when it was not simulated.
        made_from: rows of what the page was made from.
    """
    svg = as_svg(deviation_figure(deviation), "deviation")
    caption = (
        "Target and beam from the same root, as equal-length arcs. Rings: joints to correct; to "
        "close is to bend on, tip clockwise. Bars: one standard error."
    )
    sections = [
        ("Warnings", warning_list(_warnings(bent))),
        ("Target and as bent", figure(svg, caption)),
        ("Joints", _joints(deviation)),
        ("Distance", _distances(cost)),
        ("Reading", _notes(bent)),
        ("Made from", table(list(made_from.items()), css="facts")),
    ]
    write_page(path, f"{name}, as bent", bent.source, _verdict(deviation, cost), sections)
    path.with_suffix(".svg").write_text(svg, encoding="utf-8", newline="\n")


def change_in_words(cost: Cost) -> str:
    """Return what the deviation costs, with its doubt."""
    change = f"{1000 * cost.change:+.0f} mm"
    if cost.change_error is not None:
        change += f" \N{PLUS-MINUS SIGN} {1000 * cost.change_error:.0f} mm"
    return f"{change} in {cost.duration:g} s at {cost.omega:g} rad/s"


def _verdict(deviation: Deviation, cost: Cost | None) -> str:
    count = len(deviation.correct)
    joints = {0: "No joint needs", 1: "One joint needs"}.get(count, f"{count} joints need")
    tip = 1000 * float(np.linalg.norm(deviation.tip_error))
    text = f"{joints} correction; the tip is off by {tip:.1f} mm"
    return (
        f"{text}."
        if cost is None
        else f"{text}; that changes the distance by {change_in_words(cost)}."
    )


def _warnings(bent: AsBent) -> list[str]:
    warnings = []
    if not bent.foot_seen:
        warnings.append(
            "The angle at the foot, alpha_0, is the target's: a strip without its foot does not "
            "show it. Lay the foot along the board's foot line and give --foot-aligned."
        )
    if bent.uncertainty is None:
        warnings.append("How certain the angles are is not known, so no spread is simulated.")
    return warnings


def _joints(deviation: Deviation) -> Markup:
    target, bent, off = (
        np.degrees(one) for one in (deviation.target, deviation.bent, deviation.difference)
    )
    rows = []
    for k in range(len(bent)):
        error = "unknown" if deviation.error is None else f"{np.degrees(deviation.error[k]):.2f}"
        seen = (f"{bent[k]:.2f}", f"{off[k]:+.2f}")
        if k == 0 and not deviation.foot_seen:
            seen = ("not seen", "")
        to_do = deviation.in_words(k) if k in deviation.correct else ""
        rows.append((str(k), f"{target[k]:.2f}", *seen, error, to_do))
    return table(rows, ("Joint", "Target [deg]", "Bent [deg]", "Off [deg]", "Error [deg]", "To do"))


def _distances(cost: Cost | None) -> Markup:
    if cost is None:
        return Markup()
    rows = [
        (name, f"{1000 * one:.0f}", *_rows(around))
        for name, one, around in (
            ("target", cost.target, cost.around_target),
            ("as bent", cost.bent, cost.around_bent),
        )
    ]
    words = (
        f"Simulated hop of {cost.duration:g} s at {cost.omega:g} rad/s. The spread is over "
        f"{len(cost.around_bent)} draws of the angles' uncertainty, the same draws around both. "
        f"{cost.falls} of {2 + 2 * len(cost.around_bent)} fell or blew up. "
        f"Bent less target: {change_in_words(cost)}."
    )
    heads = ("Shape", "Distance [mm]", "Mean of draws [mm]", "Spread (1 sd) [mm]")
    return Markup("<p>{}</p>").format(words) + table(rows, heads)


def _rows(around: np.ndarray) -> tuple[str, str]:
    if len(around) < 2:
        return "", ""
    return f"{1000 * np.mean(around):.0f}", f"{1000 * np.std(around, ddof=1):.0f}"


def _notes(bent: AsBent) -> Markup:
    rows = [(_NOTES[key], f"{value:.5g}") for key, value in bent.notes.items()]
    return table(rows, css="facts") if rows else Markup()
