"""Write a template's files: the pages with their record, the drawing for laser and CNC."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from workbench.errors import InputError
from workbench.template.dxf import dxf_drawing
from workbench.template.pages import pdf_pages
from workbench.template.record import confirmations_path, keep, record_of, record_path
from workbench.template.sheet import TemplatePages
from workbench.template.svg import svg_drawing

__all__ = ["FORMATS", "formats_named", "write_template"]

_WRITERS: dict[str, Callable[[TemplatePages], bytes]] = {
    "pdf": pdf_pages,
    "svg": lambda sheet: svg_drawing(sheet).encode("utf-8"),
    "dxf": lambda sheet: dxf_drawing(sheet).encode("utf-8"),
}
FORMATS = tuple(_WRITERS)


def formats_named(text: str) -> tuple[str, ...]:
    """Return the formats of a list such as `pdf,dxf`.

    Raises:
        InputError: for one that is unknown.
    """
    named = tuple(dict.fromkeys(word.strip().lower() for word in text.split(",")))
    for name in named:
        if name not in FORMATS:
            raise InputError(f"unknown format {name!r}; there is {', '.join(FORMATS)}")
    return named


def write_template(
    sheet: TemplatePages, folder: Path, shape_file: Path, formats: Sequence[str] = ("pdf",)
) -> list[Path]:
    """Write a template and return its files; beside the PDF lies its record.

    Args:
        sheet: the template.
        folder: to write into, made where it is missing.
        shape_file: that it shows.
        formats: of `FORMATS`.

    Raises:
        InputError: when the PDF would take the place of one whose print was measured.
    """
    contents = {name: _WRITERS[name](sheet) for name in formats}
    pdf = folder / f"{sheet.stem}.pdf"
    if "pdf" in contents:
        _spare_confirmed(pdf, contents["pdf"])
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name, content in contents.items():
        path = folder / f"{sheet.stem}.{name}"
        path.write_bytes(content)
        files.append(path)
        if name == "pdf":
            keep(record_path(pdf), record_of(sheet, content, shape_file))
    return files


def _spare_confirmed(pdf: Path, content: bytes) -> None:
    if confirmations_path(pdf).exists() and pdf.exists() and pdf.read_bytes() != content:
        raise InputError(
            f"{pdf}: a print of it was measured, so it is never overwritten; give another --out"
        )
