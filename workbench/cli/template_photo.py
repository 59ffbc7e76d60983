"""`workbench template board` and `read`: a marker board, and a bent strip read back from it."""

from __future__ import annotations

import math
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from workbench.cli.output import JsonFlag, emit, show_table, tell
from workbench.cli.template import template
from workbench.errors import InputError
from workbench.photo import (
    BOARDS,
    CHECK_BAR_MM,
    TAPES,
    AsBent,
    find_board,
    read_angles,
    read_photo,
    read_points,
    write_board,
)
from workbench.protocol import ModelFile, ShapeFile, load_model, load_shape
from workbench.readback import (
    Cost,
    Deviation,
    change_in_words,
    deviation_of,
    simulate_cost,
    write_as_bent,
    write_readback,
)
from workbench.template import free_angles

__all__ = ["board", "read", "template"]

_WORST_PRINT = 0.005  # of a length, as for templates


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
        float, typer.Option("--h", help="Measured length of the board's bar H [mm].")
    ] = CHECK_BAR_MM,
    vertical: Annotated[
        float | None, typer.Option("--v", help="Measured height V of a sheet's pattern [mm].")
    ] = None,
    out: Annotated[Path, typer.Option(help="The shape file; its page is put beside it.")] = Path(
        "as-bent.yaml"
    ),
    model: Annotated[str, typer.Option(help="Model name or file, for the distance.")] = "thesis",
    omega: Annotated[float, typer.Option(help="Rotor speed [rad/s].")] = 17.0,
    duration: Annotated[float, typer.Option(help="Of the hop [s].", min=0.1, max=600)] = 10.0,
    draws: Annotated[
        int, typer.Option(help="Of the angles' doubt, for the distance's spread.", min=0)
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
    target = _free(shape, robot.content)
    if photo is not None and angles is None and points is None:
        tell(f"read {photo}")
        printed = _printed(horizontal, vertical)
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
        tell(f"simulate target and beam at {omega:g} rad/s")
        cost = simulate_cost(bent, target, robot.content, omega, duration, draws)
    tell("draw the page")
    written = write_as_bent(out, bent, target)
    page = out.with_suffix(".html")
    digest = sha256(robot.text.encode()).hexdigest()
    rows = {"target": shape, "model": f"{model}, SHA-256 {digest}", "as bent": bent.source}
    write_readback(page, written.content.name, bent, deviation, cost, rows)
    files = [str(out), str(page), str(page.with_suffix(".svg"))]
    if as_json:
        emit(_numbers(bent, deviation, cost) | {"files": files})
        return
    _show(deviation, cost, files)


def _free(shape: str, model: ModelFile) -> ShapeFile:
    """Return the target as the free strip has it."""
    if not shape:
        raise InputError(
            "--shape is needed: what the strip was bent to, for example --shape thesis-initial"
        )
    target = load_shape(shape, Path()).content
    free = free_angles(target, model)
    return target.model_copy(update={"angles": tuple(free), "state": "unloaded"})


def _printed(horizontal: float, vertical: float | None) -> tuple[float, float]:
    """Return what a metre of the board became on paper, across and along [m]."""
    across = horizontal / CHECK_BAR_MM
    along = 1.0 if vertical is None else vertical / _stated_height(vertical)
    for bar, share, measured in (("--h", across, horizontal), ("--v", along, vertical)):
        if not abs(share - 1) <= _WORST_PRINT:
            raise InputError(
                f"{bar} {measured:g} mm is {100 * (share - 1):+.2f} % off, more than "
                f"{100 * _WORST_PRINT:g} %; print the board again at 100 %, without fitting to "
                "the page"
            )
    return across, along


def _stated_height(vertical: float) -> float:
    """Return the sheet's height of pattern that is nearest to the one measured [mm]."""
    heights = [1000 * one.square * one.rows_a_sheet for one in BOARDS.values()]
    return min(heights, key=lambda height: abs(height - vertical))


def _numbers(bent: AsBent, deviation: Deviation, cost: Cost | None) -> dict[str, object]:
    """Return the result under names with units."""
    found: dict[str, object] = {
        "angles_rad": bent.angles.tolist(),
        "uncertainty_rad": None if bent.uncertainty is None else bent.uncertainty.tolist(),
        "deviation_deg": np.degrees(deviation.difference).tolist(),
        "foot_seen": bent.foot_seen,
        "correct": [
            {"joint": k, "deg": -math.degrees(deviation.difference[k])} for k in deviation.correct
        ],
        "tip_error_mm": (1000 * deviation.tip_error).tolist(),
        "reading": bent.notes,
    }
    if cost is not None:
        found["distance"] = {
            "omega_rad_s": cost.omega,
            "target_m": cost.target,
            "bent_m": cost.bent,
            "around_target_m": cost.around_target.tolist(),
            "around_bent_m": cost.around_bent.tolist(),
            "change_m": cost.change,
            "change_error_m": cost.change_error,
            "falls": cost.falls,
        }
    return found


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
            f"distance {cost.target:.3f} m as designed, {cost.bent:.3f} m as bent; over the "
            f"angles' doubt {change_in_words(cost)}"
        )
    for path in files:
        print(path)
