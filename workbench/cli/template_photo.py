"""`workbench template board` and `read`: a marker board, and a bent strip measured on it."""

from __future__ import annotations

import math
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from workbench.as_built import (
    Cost,
    Deviation,
    deviation_of,
    numbers_of,
    simulate_cost,
    write_as_bent,
)
from workbench.cli.console import progress, show_table
from workbench.cli.number_option import number
from workbench.cli.plain_output import JsonFlag, emit
from workbench.cli.template import template
from workbench.errors import InputError
from workbench.photo import (
    BOARDS,
    CHECK_BAR_MM,
    TAPES,
    find_board,
    printed_scale,
    read_angles,
    read_photo,
    read_points,
    write_board,
)
from workbench.report import change_in_words, write_readback
from workbench.schemas import load_model, load_shape
from workbench.template import free_shape

__all__ = ["board", "read", "template"]


@template.command()
def board(
    paper: Annotated[str, typer.Option(help=f"One of {', '.join(BOARDS)}.")] = "A3",
    out: Annotated[Path | None, typer.Option(help="The PDF file.")] = None,
    as_json: JsonFlag = False,
) -> None:
    """Print the marker board that a bent strip is photographed on (extra `photo`).

    Example: workbench template board --paper A3
    """
    chosen = find_board(paper)
    path = out or Path("templates") / f"board-{chosen.paper}.pdf"
    write_board(path, chosen)
    if as_json:
        emit({"files": [str(path)], "pages": chosen.sheets + 1, "paper": chosen.paper})
        return
    print(f"{path}: print at 100 %; its last page says how to use it")


@template.command()
def read(
    photo: Annotated[Path | None, typer.Argument(help="Photograph of the strip.")] = None,
    shape: Annotated[str, typer.Option(help="What it was bent to, name or file.")] = "",
    angles: Annotated[
        Path | None, typer.Option(help="CSV of 16 measured angles [deg], instead of a photograph.")
    ] = None,
    points: Annotated[
        Path | None, typer.Option(help="CSV of points x,y [mm] from root to tip, instead.")
    ] = None,
    forward: Annotated[
        str | None, typer.Option(help="Axis of the points that is forward, such as +x.")
    ] = None,
    up: Annotated[str | None, typer.Option(help="Axis that is up, such as +y.")] = None,
    tape: Annotated[str, typer.Option(help=f"On the edge: {', '.join(TAPES)}.")] = "none",
    foot_aligned: Annotated[
        bool, typer.Option("--foot-aligned", help="The foot lay along the board's foot line.")
    ] = False,
    horizontal: Annotated[
        float,
        typer.Option(
            "--h", help="Measured length of the board's bar H [mm].", parser=number("length", "mm")
        ),
    ] = CHECK_BAR_MM,
    vertical: Annotated[
        float | None,
        typer.Option(
            "--v",
            help="Measured height V of a sheet's pattern [mm].",
            parser=number("length", "mm"),
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="The shape file; its page is put beside it.")] = Path(
        "as-bent.yaml"
    ),
    model: Annotated[str, typer.Option(help="Model name or file, for the distance.")] = "thesis",
    omega: Annotated[
        float, typer.Option(help="Rotor speed [rad/s].", parser=number("speed", "rad/s"))
    ] = 17.0,
    duration: Annotated[
        float, typer.Option(help="Of the hop [s].", parser=number("time", "s", 0.1, 600))
    ] = 10.0,
    draws: Annotated[
        int, typer.Option(help="Of the uncertain angles, for the distance's spread.", min=0)
    ] = 12,
    simulated: Annotated[
        bool, typer.Option("--simulate/--no-simulate", help="What it costs in distance.")
    ] = True,
    as_json: JsonFlag = False,
) -> None:
    """Read a bent strip back: angles, joints to correct, and what the deviation costs.

    Example: workbench template read photo.jpg --shape thesis-initial --out as-bent.yaml

    Example: workbench template read --angles measured.csv --shape thesis-initial
    """
    robot = load_model(model, Path())
    if not shape:
        raise InputError(
            "--shape is needed: what the strip was bent to, for example --shape thesis-initial"
        )
    target = free_shape(load_shape(shape, Path()).content, robot.content)
    if photo is not None and angles is None and points is None:
        progress(f"read {photo}")
        printed = printed_scale(horizontal, vertical)
        bent = read_photo(photo, target, tape=tape, foot_aligned=foot_aligned, printed=printed)
    elif photo is None and angles is not None and points is None:
        bent = read_angles(angles, target)
    elif photo is None and angles is None and points is not None:
        bent = read_points(points, target, forward, up)
    else:
        raise InputError("give one of: a photograph, --angles, --points")
    deviation = deviation_of(bent, target)
    cost = None
    if simulated:
        progress(f"simulate target and beam at {omega:g} rad/s")
        cost = simulate_cost(bent, target, robot.content, omega, duration, draws)
    progress("draw the page")
    written = write_as_bent(out, bent, target)
    page = out.with_suffix(".html")
    digest = sha256(robot.text.encode()).hexdigest()
    rows = {"target": shape, "model": f"{model}, SHA-256 {digest}", "as bent": bent.source}
    write_readback(page, written.content.name, bent, deviation, cost, rows)
    files = [str(out), str(page), str(page.with_suffix(".svg"))]
    if as_json:
        emit(numbers_of(bent, deviation, cost) | {"files": files})
        return
    _show(deviation, cost, files)


def _show(deviation: Deviation, cost: Cost | None, files: list[str]) -> None:
    rows = []
    for k, (target, bent) in enumerate(
        zip(np.degrees(deviation.target), np.degrees(deviation.bent), strict=True)
    ):
        error = "" if deviation.error is None else f"{math.degrees(deviation.error[k]):.2f}"
        seen = k > 0 or deviation.foot_seen
        rows.append([
            str(k), f"{target:.2f}", f"{bent:.2f}" if seen else "not seen",
            f"{bent - target:+.2f}" if seen else "", error,
            deviation.in_words(k) if k in deviation.correct else "",
        ])  # fmt: skip
    head = ["joint", "target [deg]", "bent [deg]", "off [deg]", "error [deg]", "to do"]
    show_table("as bent", head, rows)
    tip = 1000 * deviation.tip_error
    print(f"tip off by {math.hypot(*tip):.1f} mm: {tip[0]:+.1f} forward, {tip[1]:+.1f} up")
    if cost is not None:
        print(
            f"distance {1000 * cost.target:.0f} mm as designed, {1000 * cost.bent:.0f} mm as bent; "
            f"change averaged over the angles' uncertainty: {change_in_words(cost)}"
        )
    for path in files:
        print(path)
