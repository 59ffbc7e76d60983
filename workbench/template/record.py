"""What is kept beside a template: all that it was drawn from, and that its print was measured."""

from __future__ import annotations

import hashlib
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from workbench.errors import InputError
from workbench.schemas import Section, ShapeFile, load
from workbench.template.canvas import Compensation
from workbench.template.metal import metal_of
from workbench.template.paper import ROLL, paper_named
from workbench.template.sheet import TemplatePages, make_sheet
from workbench.template.strip import Strip, digest

__all__ = [
    "Confirmations",
    "MeasuredBars",
    "TemplateRecord",
    "confirmations_path",
    "keep",
    "record_of",
    "record_path",
    "sha256_of",
    "sheet_of",
    "unchanged_record",
]


class TemplateRecord(Section):
    """What a template's PDF was drawn from, so that it can be drawn again."""

    schema_: Annotated[Literal["workbench/template-1"], Field(alias="schema")]
    pdf_sha256: str
    shape: str
    shape_sha256: str
    """Of the shape file's text."""
    shape_file: str
    """Where it was."""
    angles_rad: tuple[float, ...]
    """Of the free strip."""
    length_m: float
    thickness_m: float
    model: str | None
    """That took the load off the listed angles; null where the file lists the free strip."""
    paper: str
    roll_width_m: float | None
    mirror: bool
    day: date
    compensation_h: float
    compensation_v: float
    yield_strength_Pa: float | None
    modulus_Pa: float | None
    """Of the metal, where the template states the radii to bend to."""


class MeasuredBars(Section):
    """The check bars of one print, as the operator measured them."""

    day: date
    horizontal_mm: float
    vertical_mm: float
    verdict: Literal["confirmed", "compensated"]
    """Whether the print is at 1:1, or a compensated template was written in its place."""
    compensated: str | None
    """That template's file."""


class Confirmations(Section):
    """Every measurement of a template's prints."""

    schema_: Annotated[Literal["workbench/template-confirmation-1"], Field(alias="schema")]
    template: str
    pdf_sha256: str
    measured: tuple[MeasuredBars, ...]


def record_path(pdf: Path) -> Path:
    """Return where a template's record lies."""
    return pdf.with_suffix(".json")


def confirmations_path(pdf: Path) -> Path:
    """Return where the measurements of its prints lie."""
    return pdf.with_suffix(".confirmed.json")


def sha256_of(content: bytes) -> str:
    """Return the hash of a file's content."""
    return hashlib.sha256(content).hexdigest()


def keep(path: Path, content: Section) -> None:
    """Write a record as JSON."""
    path.write_text(content.model_dump_json(by_alias=True, indent=2) + "\n", encoding="utf-8")


def record_of(sheet: TemplatePages, pdf: bytes, shape_file: Path) -> TemplateRecord:
    """Return the record of a template that was drawn.

    Args:
        sheet: the template.
        pdf: its pages.
        shape_file: that it shows.
    """
    strip, paper = sheet.strip, sheet.layout.paper
    return TemplateRecord.model_construct(
        schema_="workbench/template-1",
        pdf_sha256=sha256_of(pdf),
        shape=strip.name,
        shape_sha256=strip.sha256,
        shape_file=str(shape_file.resolve()),
        angles_rad=strip.angles,
        length_m=strip.length,
        thickness_m=strip.thickness,
        model=strip.model,
        paper=paper.name,
        roll_width_m=paper.width / 1000 if paper.name == ROLL else None,
        mirror=sheet.mirror,
        day=sheet.day,
        compensation_h=sheet.compensation.h,
        compensation_v=sheet.compensation.v,
        yield_strength_Pa=sheet.metal.yield_strength if sheet.metal else None,
        modulus_Pa=sheet.metal.modulus if sheet.metal else None,
    )


def sheet_of(record: TemplateRecord) -> TemplatePages:
    """Return the template again that a record describes."""
    strip = Strip(
        record.shape,
        record.shape_sha256,
        record.angles_rad,
        record.length_m,
        record.thickness_m,
        record.model,
    )
    paper = paper_named(record.paper, record.roll_width_m)
    compensation = Compensation(record.compensation_h, record.compensation_v)
    metal = metal_of(record.yield_strength_Pa, record.modulus_Pa)
    return make_sheet(strip, paper, record.day, record.mirror, compensation, metal)


def unchanged_record(pdf: Path) -> TemplateRecord:
    """Return a template's record, when neither the template nor its shape was changed since.

    Raises:
        InputError: when one was, when there is no record, or no such template.
    """
    if pdf.suffix != ".pdf" or not pdf.is_file():
        raise InputError(f"{pdf}: no such template; give the PDF that was printed")
    beside = record_path(pdf)
    if not beside.is_file():
        raise InputError(
            f"{pdf}: its record {beside.name} is not beside it; draw the template again"
        )
    record = load(beside, TemplateRecord).content
    if sha256_of(pdf.read_bytes()) != record.pdf_sha256:
        raise InputError(
            f"{pdf}: was changed since it was drawn on {record.day.isoformat()}, so its bars show "
            "nothing; draw the template again, print it and measure that print"
        )
    shape_file = Path(record.shape_file)
    if shape_file.is_file() and digest(load(shape_file, ShapeFile)) != record.shape_sha256:
        raise InputError(
            f"{shape_file}: was changed since {pdf.name} was drawn from it on "
            f"{record.day.isoformat()}; draw the template again"
        )
    return record
