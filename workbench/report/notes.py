"""The notes beside the curves, as markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from workbench.motion import CORNER_FORCES
from workbench.report.comparison import Comparison
from workbench.report.geometry import MISSING, missing_scale
from workbench.report.headline import (
    HEADINGS,
    headline,
    largest_rows,
    misfit_rows,
    source_rows,
    validation_rows,
)

__all__ = ["labels", "notes", "overview"]

_UNSEEN = (
    "The thin orange line from the foot to T is in place of the real beam; "
    "the beam between them was not measured."
)
_ESTIMATED = (
    "The orange curve from the foot to T is the real beam as it was estimated: a model corrected "
    "towards foot and T after each picture, fainter where that is less certain. The beam itself "
    "was not measured; the eye beside `real/beam` hides it."
)
_FORCES = (
    "Red arrows: what the ground does to each corner of the twin's foot, 50 mm for each newton. "
    "Nobody measures it on the robot."
)
_AXES = "x points forward, z up. Twin lead: how far the twin's rotor is ahead of the robot's."
_PICK = (
    "A tab shows one robot beside its twin. In the tree on the left the eye beside `real` or "
    "`twin` of a run hides or shows that robot in this view."
)


def notes(comparison: Comparison) -> str:
    """Return the headline table with the errors, warnings, facts and what was not measured."""
    parts = [
        f"**{comparison.title}**",
        f"**{comparison.mark}**" if comparison.mark else "",
        _validation(comparison),
        _numbers(comparison, HEADINGS),
        _sources(comparison),
        _extended(comparison),
        "\n".join(f"- **Warning:** {warning}" for warning in comparison.warnings),
        _beam(comparison),
        _FORCES if any(CORNER_FORCES[0][0] in motion for motion in comparison.motions) else "",
        _noise(comparison),
        _AXES,
        _table(("Fact", ""), comparison.facts.items()),
    ]
    return "\n\n".join(part for part in parts if part)


def _beam(comparison: Comparison) -> str:
    """Say what the real beam in the picture is, and what the arrows at it are."""
    estimate, why = comparison.estimate, comparison.unestimated
    if estimate is None:
        return f"{_UNSEEN} Its pose was not estimated: {why}." if why else _UNSEEN
    if MISSING["top"][0] not in estimate:
        return _ESTIMATED
    newton = 1000 * missing_scale(estimate)
    return (
        f"{_ESTIMATED}\n\nViolet arrows at T, and at a free foot: the force that the model misses, "
        f"{newton:g} mm for each newton, where it is more than noise."
    )


def _validation(comparison: Comparison) -> str:
    """Return base and extended model as compared."""
    if comparison.validation is None:
        return ""
    heads = ("As compared", *(f"{name.capitalize()}: {one.name}" for name, one in
                              comparison.validation.both))  # fmt: skip
    return f"{_table(heads, validation_rows(comparison))}\n\n{comparison.validation.about}"


def _sources(comparison: Comparison) -> str:
    rows = source_rows(comparison)
    return _table(("Error", "", "Change"), rows) if rows else ""


def overview(title: str, comparisons: Sequence[Comparison]) -> str:
    """Return a table of several runs beside their twins."""
    rows = [
        (
            f"{number}",
            label + (f" **{comparison.mark}**" if comparison.mark else ""),
            headline(comparison)[0].real,
            headline(comparison)[0].twin,
            misfit_rows(comparison.misfit)[-1][1],
        )
        for number, (label, comparison) in enumerate(
            zip(labels(comparisons), comparisons, strict=True), start=1
        )
    ]
    what = " / ".join(dict.fromkeys(headline(one)[0].quantity for one in comparisons))
    heads = ("Run", "", f"{what}, real", "Twin", "Error")
    return "\n\n".join([f"**{title}**", _table(heads, rows), _PICK])


def labels(comparisons: Sequence[Comparison]) -> list[str]:
    """Return what distinguishes each run from the others; what is the same of all is left out."""
    every = [comparison.label for comparison in comparisons]
    same = set.intersection(*map(set, every)) if len(every) > 1 else set()
    short = [", ".join(part for part in label if part not in same) for label in every]
    return [name or comparison.called for name, comparison in zip(short, comparisons, strict=True)]


def _noise(comparison: Comparison) -> str:
    texts = [f"{name} {rms:.2f} mm" for name, rms in comparison.error_noise().items()]
    if not texts:
        return ""
    return (
        f"Thin grey lines: the measured curve and twice its noise at rest to either side. Noise "
        f"alone puts real and twin apart by {' and '.join(texts)} (root mean square)."
    )


def _numbers(comparison: Comparison, heads: Sequence[str]) -> str:
    errors = [(f"Error, {name}", "", "", rms) for name, rms in misfit_rows(comparison.misfit)]
    errors += largest_rows(comparison) if heads is HEADINGS else []
    return _table(heads, [*headline(comparison), *errors])


def _extended(comparison: Comparison) -> str:
    """Return the same table of the extended twin in the twin's place."""
    extended = comparison.extended
    if extended is None:
        return ""
    there = replace(comparison, twin_summary=extended.summary, misfit=extended.misfit)
    heads = [f"Extended twin, {extended.model}" if h == "Twin" else h for h in HEADINGS]
    return _numbers(there, heads)


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(map(_cell, line)) + " |" for line in lines)


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split())
