"""Judge a print by its check bars: at 1:1, to be printed again compensated, or refused."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import NamedTuple

from workbench.errors import PrintRefused
from workbench.schemas import load
from workbench.template.canvas import Compensation
from workbench.template.files import write_template
from workbench.template.paper import BAR_MM
from workbench.template.record import (
    Confirmations,
    MeasuredBars,
    confirmations_path,
    keep,
    sheet_of,
    unchanged_record,
)

__all__ = ["AT_SCALE_MM", "REFUSED_MM", "ConfirmedPrint", "confirm_template"]

AT_SCALE_MM = 0.1
"""How far a bar may be off for a print at 1:1: what a steel rule can measure."""
REFUSED_MM = 0.5
"""Beyond this it is not the printer's error but a wrong setting, such as fit to page."""

_SLACK_MM = 1e-9  # of binary fractions


class ConfirmedPrint(NamedTuple):
    """What became of a print.

    Args:
        measured: the verdict, as it is kept.
        kept: where.
        files: the compensated template's, where one was written.
    """

    measured: MeasuredBars
    kept: Path
    files: tuple[Path, ...]


def confirm_template(pdf: Path, horizontal: float, vertical: float, day: date) -> ConfirmedPrint:
    """Take the measured check bars of a print, and write a compensated template where needed.

    A compensated template is itself confirmed by its own print.

    Args:
        pdf: the template that was printed.
        horizontal: measured length of the bar H [mm].
        vertical: of the bar V [mm].
        day: of the measurement.

    Raises:
        PrintRefused: when a bar is off by more than 0.5 %; nothing is written then.
        InputError: when the template or its shape was changed since it was drawn.
    """
    record = unchanged_record(pdf)
    sheet = sheet_of(record)
    stretch = Compensation(
        sheet.compensation.h * BAR_MM / horizontal, sheet.compensation.v * BAR_MM / vertical
    )
    for axis, bar, total in (("H", horizontal, stretch.h), ("V", vertical, stretch.v)):
        _require_near(pdf, axis, bar, BAR_MM / total)
    files: tuple[Path, ...] = ()
    if max(abs(horizontal - BAR_MM), abs(vertical - BAR_MM)) > AT_SCALE_MM + _SLACK_MM:
        again = replace(sheet, compensation=stretch)
        files = tuple(write_template(again, pdf.parent, Path(record.shape_file)))
    measured = MeasuredBars(
        day=day,
        horizontal_mm=horizontal,
        vertical_mm=vertical,
        verdict="compensated" if files else "confirmed",
        compensated=files[0].name if files else None,
    )
    return ConfirmedPrint(measured, _add(pdf, record.pdf_sha256, measured), files)


def _add(pdf: Path, pdf_sha256: str, measured: MeasuredBars) -> Path:
    """Add a measurement to those of the template and return where they are kept."""
    kept = confirmations_path(pdf)
    before = load(kept, Confirmations).content.measured if kept.exists() else ()
    keep(
        kept,
        Confirmations.model_construct(
            schema_="workbench/template-confirmation-1",
            template=pdf.name,
            pdf_sha256=pdf_sha256,
            measured=(*before, measured),
        ),
    )
    return kept


def _require_near(pdf: Path, axis: str, bar: float, uncompensated: float) -> None:
    """Refuse a bar that no printer's own error explains, as it is or before compensation."""
    if max(abs(bar - BAR_MM), abs(uncompensated - BAR_MM)) <= REFUSED_MM + _SLACK_MM:
        return
    before = f", {uncompensated:.2f} mm without compensation" if uncompensated != bar else ""
    raise PrintRefused(
        f"{pdf}: bar {axis} measures {bar:g} mm{before}, more than {REFUSED_MM / BAR_MM:.1%} off "
        f"{BAR_MM:g} mm; do not bend against this print: set the printer to 100 % (actual size), "
        "not to fit the page, print again and measure again"
    )
