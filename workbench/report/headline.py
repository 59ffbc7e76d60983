"""The numbers that a reader looks for first, as text with units and sensible digits."""

from __future__ import annotations

import math
from typing import NamedTuple

from workbench.motion import ClampedResponse, Misfit, RingDown, Summary
from workbench.quantities import QUANTITIES, DisplayedQuantity
from workbench.report.comparison import Comparison

__all__ = [
    "HEADINGS",
    "HeadlineRow",
    "headline",
    "largest_rows",
    "millimetres",
    "misfit_rows",
    "prediction_rows",
    "source_rows",
    "source_sentence",
    "validation_rows",
    "verdict",
]

HEADINGS = ("", "Real", "Twin", "Difference")
_UNKNOWN = "not measured"
_DOUBTFUL = 1.5  # times the noise: an error below says next to nothing about the model


class HeadlineRow(NamedTuple):
    """One quantity of the run beside its twin; the difference is twin minus real."""

    quantity: str
    real: str
    twin: str
    difference: str


def headline(comparison: Comparison) -> list[HeadlineRow]:
    """Return the numbers of robot and twin: those of a drive or those of a release."""
    real, twin = comparison.real_summary.as_json(), comparison.twin_summary.as_json()
    return [
        _row(quantity, real[key], twin[key]) for key, quantity in QUANTITIES.items() if key in real
    ]


def misfit_rows(misfit: Misfit) -> list[tuple[str, str]]:
    """Return the root mean square errors of foot, T and both."""
    return [
        ("foot", _quantity(misfit.foot_mm, "mm", 1)),
        ("T", _quantity(misfit.top_mm, "mm", 1)),
        ("foot and T", _quantity(misfit.both_mm, "mm", 1)),
    ]


def prediction_rows(comparison: Comparison) -> list[tuple[str, str]]:
    """Return how far the model is off so long after the estimated state, last freely."""
    measured = "turned as measured" if comparison.driven else "released as measured"
    rows = [
        (
            f"{seconds:g} s ahead, from the estimated state"
            if math.isfinite(seconds)
            else f"Free simulation, {measured}",
            millimetres(mm),
        )
        for seconds, mm in comparison.predictions
    ]
    if any(math.isinf(seconds) for seconds, _ in comparison.predictions):  # of an older run
        foot = comparison.mode in ("hop", "drop")
        free = comparison.misfit.both_mm if foot else comparison.misfit.top_mm
        asked = "turned as commanded" if comparison.driven else "the twin's release"
        rows.append((f"Free simulation, {asked}", _quantity(free, "mm", 1)))
    if rows and comparison.sources is not None:
        rows.append(("Noise alone", millimetres(comparison.sources.noise)))
    return rows


def source_rows(comparison: Comparison) -> list[tuple[str, str, str]]:
    """Return the twin's error as commanded, turned as measured and started as measured."""
    found = comparison.sources
    if found is None:
        return []
    first = "The twin, as commanded" if comparison.driven else "The twin, as it was to be released"
    rows, before = [(first, millimetres(found.commanded), "")], found.commanded
    if found.turned is not None:
        rows.append(("Rotor turned as measured", millimetres(found.turned),
                     _part("drive", before, found.turned)))  # fmt: skip
        before = found.turned
    started = "Also rested where it rested" if comparison.driven else "Released as measured"
    rows.append((started, millimetres(found.started), _part("start", before, found.started)))
    remains = found.started > _DOUBTFUL * found.noise
    rows[-1] = (*rows[-1][:2], f"{rows[-1][2]}; what remains is the model's" if remains else
                f"{rows[-1][2]}; what remains is little more than noise")  # fmt: skip
    return [*rows, ("Noise alone", millimetres(found.noise), "")]


def source_sentence(comparison: Comparison) -> str:
    """Say in one line how much of the twin's error is drive, start and model; empty if unknown."""
    found = comparison.sources
    if found is None:
        return ""
    point = "foot and T" if comparison.mode in ("hop", "drop") else "T"
    when = f" over the first {found.until_s:.1f} s" if comparison.mode == "hop" else ""
    turned = found.commanded if found.turned is None else found.turned
    parts = [("drive", found.commanded - turned), ("start", turned - found.started)]
    rows = [
        f"{millimetres(mm)} are the {name}'s" if mm >= 0 else
        f"as measured, the {name} makes it {millimetres(-mm)} more"
        for name, mm in parts[0 if found.turned is not None else 1:]
    ]  # fmt: skip
    return (
        f"Of the {millimetres(found.commanded)} at {point}{when}, {', '.join(rows)}, and "
        f"{millimetres(found.started)} the model's; noise alone makes {millimetres(found.noise)}."
    )


def validation_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """Return the errors of base and extended model as compared, freely and some time ahead."""
    validation = comparison.validation
    if validation is None:
        return []
    free = f"Free simulation, {validation.until_s:.1f} s"
    rows = [(free, *(millimetres(one.rms_mm) for _, one in validation.both))]
    for seconds in validation.base.ahead:
        values = (one.ahead.get(seconds) for _, one in validation.both)
        rows.append((f"{seconds} s ahead", *("-" if mm is None else millimetres(mm)
                                              for mm in values)))  # fmt: skip
    return [*rows, ("Noise alone", *[millimetres(validation.noise_mm)] * 2)]


def _part(name: str, before: float, after: float) -> str:
    """Return what a step takes off an error."""
    if after > before:
        return f"{millimetres(after - before)} more: not the {name}"
    return f"{millimetres(before - after)} less: the {name}"


def largest_rows(comparison: Comparison) -> list[tuple[str, str, str, str]]:
    """Return the greatest plotted distance of foot and T, with its time, as rows of a headline."""
    return [
        (f"Largest error, {name}", "", "", f"{at.mm:.1f} mm at {at.time_s:.2f} s")
        for name, at in comparison.largest_error().items()
    ]


def verdict(comparison: Comparison) -> str:
    """Say in one sentence what the robot and its twin did and how far apart they were."""
    match comparison.real_summary, comparison.twin_summary:
        case (Summary(distance_m=real), Summary(distance_m=twin)):
            rows = f"In {comparison.duration_s:g} s the robot travelled {_quantity(real, 'm', 3)} "
            rows += f"and its twin {_quantity(twin, 'm', 3)}"
        case (ClampedResponse(amplitude_m=real), ClampedResponse(amplitude_m=twin)):
            rows = f"T of the robot swung by {_quantity(1e3 * real, 'mm', 1)} "
            rows += f"and that of its twin by {_quantity(1e3 * twin, 'mm', 1)}"
        case (RingDown(ring_hz=real), RingDown(ring_hz=twin)):
            rows = f"Let go, the robot rang at {_quantity(real, 'Hz', 3)} "
            rows += f"and its twin at {_quantity(twin, 'Hz', 3)}"
        case _:
            raise TypeError("robot and twin are summarized in different ways")
    if comparison.mark is not None:
        return f"{comparison.mark}. What is left of it is shown."
    if not math.isfinite(real + twin + comparison.misfit.both_mm):
        return "Too little of the run was seen to compare the robot with its twin."
    apart = _quantity(comparison.misfit.both_mm, "mm", 1)
    rows = f"{rows}; over that time they were {apart} apart (root mean square of foot and T)."
    return f"{rows} {source_sentence(comparison)}".strip()


def millimetres(value: float) -> str:
    """Return an error in mm with the digits that count."""
    return _quantity(value, "mm", 1 if abs(value) >= 10 else 2)


def _row(quantity: DisplayedQuantity, real: float, twin: float) -> HeadlineRow:
    name, unit, factor, digits = quantity
    gap = quantity.apart(real, twin)
    comparable = math.isfinite(gap) and real != 0 and unit != "deg"
    share = f" ({100 * (twin - real) / abs(real):+.0f} %)" if comparable else ""
    difference = f"{gap:+.{digits}f} {unit}{share}" if math.isfinite(gap) else "-"
    return HeadlineRow(
        name,
        _quantity(factor * real, unit, digits),
        _quantity(factor * twin, unit, digits),
        difference,
    )


def _quantity(value: float, unit: str, digits: int) -> str:
    return f"{value:.{digits}f} {unit}" if math.isfinite(value) else _UNKNOWN
