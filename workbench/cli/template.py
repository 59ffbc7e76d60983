"""`workbench template`: 1:1 pages of a shape, and whether a print of them is at 1:1."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperGroup

from workbench.cli.completion import shape_names
from workbench.cli.console import progress, show_table
from workbench.cli.number_option import number
from workbench.cli.plain_output import JsonFlag, emit
from workbench.errors import InputError
from workbench.schemas import load_model, load_shape, parse_quantity
from workbench.template import (
    AT_SCALE_MM,
    TemplatePages,
    confirm_template,
    formats_named,
    free_angles,
    make_sheet,
    make_strip,
    metal_of,
    paper_named,
    write_template,
)

__all__ = ["template"]

_DRAW = "draw"


class _DrawsByDefault(TyperGroup):
    """Takes `template SHAPE` for `template draw SHAPE`."""

    def parse_args(  # pyright: ignore[reportIncompatibleMethodOverride] # typer's base is private
        self, ctx: typer.Context, args: list[str]
    ) -> list[str]:
        """Put the default command before anything that is no command."""
        known = {*self.commands, *ctx.help_option_names}
        return super().parse_args(ctx, args if not args or args[0] in known else [_DRAW, *args])


template = typer.Typer(
    name="template",
    help="Draw a shape at 1:1 to bend the strip against: `workbench template SHAPE` is short for "
    "`workbench template draw SHAPE`.",
    cls=_DrawsByDefault,
    no_args_is_help=True,
)


@template.command(_DRAW)
def draw(
    shape: Annotated[str, typer.Argument(help="Shape name or file.", autocompletion=shape_names)],
    paper: Annotated[
        str, typer.Option(help="A4, A3, Letter, Tabloid, roll, or a size such as 330x480mm.")
    ] = "A4",
    roll_width: Annotated[
        str | None, typer.Option(help='Of the roll, for example "610 mm".')
    ] = None,
    formats: Annotated[str, typer.Option("--format", help="Of pdf, svg, dxf.")] = "pdf",
    out: Annotated[
        Path, typer.Option(help="Folder for the files.", envvar="WORKBENCH_TEMPLATES")
    ] = Path("templates"),
    thickness: Annotated[
        str | None, typer.Option(help='Of the strip, where its file has none, such as "2 mm".')
    ] = None,
    mirror: Annotated[bool, typer.Option("--mirror", help="For the strip's other side.")] = False,
    model: Annotated[
        str, typer.Option(help="Model name or file; computes the free shape of a loaded one.")
    ] = "thesis",
    yield_strength: Annotated[
        str | None,
        typer.Option("--yield", help='Of the metal, "200 MPa": adds the radii to bend to.'),
    ] = None,
    modulus: Annotated[str | None, typer.Option(help='Of the metal, "70 GPa".')] = None,
    as_json: JsonFlag = False,
) -> None:
    """Draw the free strip at 1:1 on the fewest pages, and for laser and CNC.

    Example: workbench template draw thesis-initial --thickness "2 mm" --paper A3
    """
    document = load_shape(shape, Path())
    robot = load_model(model, Path()).content
    loaded = document.content.state == "loaded"
    progress("draw the template")
    strip = make_strip(
        document,
        _quantity(thickness, "length", "--thickness"),
        free_angles(document.content, robot) if loaded else None,
        robot.name if loaded else None,
    )
    page = paper_named(paper, _quantity(roll_width, "length", "--roll-width"))
    metal = metal_of(
        _quantity(yield_strength, "stress", "--yield"), _quantity(modulus, "stress", "--modulus")
    )
    sheet = make_sheet(strip, page, date.today(), mirror, metal=metal)
    files = write_template(sheet, out, document.path, formats_named(formats))
    if as_json:
        emit(_numbers(sheet, files))
    else:
        show_table(f"{strip.name} {strip.short_hash}", ["", ""], _rows(sheet, files))


@template.command()
def confirm(
    pdf: Annotated[Path, typer.Argument(metavar="FILE", help="The PDF that was printed.")],
    horizontal: Annotated[
        float, typer.Option("--h", help="Length of bar H [mm].", parser=number("length", "mm", 1))
    ],
    vertical: Annotated[
        float, typer.Option("--v", help="Length of bar V [mm].", parser=number("length", "mm", 1))
    ],
    as_json: JsonFlag = False,
) -> None:
    """Judge a print by its check bars; write a compensated template where it is a little off.

    Example: workbench template confirm templates/thesis-initial-07eb4c66-A4.pdf --h 99.6 --v 100.1
    """
    found = confirm_template(pdf, horizontal, vertical, date.today())
    if as_json:
        emit(
            {
                "template": str(pdf),
                "verdict": found.measured.verdict,
                "horizontal_mm": horizontal,
                "vertical_mm": vertical,
                "confirmation": str(found.kept),
                "files": [str(path) for path in found.files],
            }
        )
        return
    if not found.files:
        print(f"{pdf}: confirmed, the print is at 1:1; kept in {found.kept.name}")
        return
    print(f"{pdf}: this print does not count, it is off by more than {AT_SCALE_MM:g} mm")
    print(f"print {found.files[0]} on the same printer at 100 % and confirm that one")


def _numbers(sheet: TemplatePages, files: Sequence[Path]) -> dict[str, object]:
    layout, strip = sheet.layout, sheet.strip
    return {
        "files": [str(path) for path in files],
        "pages": sheet.pages,
        "paper": layout.paper.name,
        "page_mm": [layout.paper.width, layout.paper.height],
        "turned_deg": layout.turn_deg,
        "shape": strip.name,
        "shape_sha256": strip.sha256,
        "thickness_mm": 1000 * strip.thickness,
        "freed_by_model": strip.model,
    }


def _rows(sheet: TemplatePages, files: Sequence[Path]) -> list[tuple[str, str]]:
    layout, strip = sheet.layout, sheet.strip
    freed = "of the free strip, as listed" if strip.model is None else f"freed by {strip.model}"
    return [
        ("pages", f"{sheet.pages} of {layout.paper.name}, turned by {layout.turn_deg:g}°"),
        ("strip", f"{1000 * strip.thickness:g} mm thick, {1000 * strip.length:.2f} mm long"),
        ("angles", freed),
        *(("file", str(path)) for path in files),
    ]


def _quantity(text: str | None, dimension: str, option: str) -> float | None:
    """Return an option's value, SI."""
    if text is None:
        return None
    try:
        value, _ = parse_quantity(text, dimension)
    except ValueError as error:
        raise InputError(f"{option}: {error}") from None
    if value <= 0:
        raise InputError(f"{option}: {text} is not possible; it must be above 0")
    return value
