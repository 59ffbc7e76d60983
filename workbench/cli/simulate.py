"""`workbench simulate`: one simulation without a bench."""

from __future__ import annotations

import math
import time
from typing import Annotated, Any, cast, get_args

import typer

from workbench.api import simulate as simulate_one
from workbench.cli.completion import model_names, shape_names
from workbench.cli.console import progress, show_table, summary_rows
from workbench.cli.number_option import number
from workbench.cli.plain_output import JsonFlag, emit
from workbench.design import DRAWS
from workbench.modes import Mode

__all__ = ["simulate"]


def simulate(
    omega: Annotated[
        float,
        typer.Option(
            help="Rotor speed [rad/s]; negative turns back.", parser=number("speed", "rad/s")
        ),
    ] = 17.0,
    duration: Annotated[
        float, typer.Option(help="From time zero [s].", parser=number("time", "s", 0.1, 600))
    ] = 10.0,
    model: Annotated[
        str, typer.Option(help="Model name or file.", autocompletion=model_names)
    ] = "thesis",
    shape: Annotated[
        str, typer.Option(help="Shape name or file.", autocompletion=shape_names)
    ] = "thesis-initial",
    mode: Annotated[str, typer.Option(help=f"One of {', '.join(get_args(Mode))}.")] = "hop",
    start_angle: Annotated[
        float,
        typer.Option(
            help="Rotor at rest [deg] from forward, 90 is down.", parser=number("angle", "deg")
        ),
    ] = 90.0,
    pull: Annotated[
        float,
        typer.Option(help="Force on T before its release [N], decay.", parser=number("force", "N")),
    ] = 0.39,
    height: Annotated[
        float,
        typer.Option(help="Height of the fall [mm], drop.", parser=number("length", "mm", 0, 1000)),
    ] = 20.0,
    increments: Annotated[
        int | None, typer.Option(help="Of the beam; by default the model's.", min=4, max=128)
    ] = None,
    slope: Annotated[
        float,
        typer.Option(help="Of the floor, rising forward [deg].", parser=number("angle", "deg")),
    ] = 0.0,
    spread: Annotated[
        int,
        typer.Option(
            help="Hops that determine the spread of the distance over start angle, friction and "
            "speed within their tolerances; 0 for none.",
            min=0,
            max=1000,
        ),
    ] = DRAWS,
    as_json: JsonFlag = False,
) -> None:
    """Simulate one run and report how far it went, how it rang, and whether the robot fell.

    Example: workbench simulate --omega 17 --duration 10

    Example: workbench simulate --mode decay --pull 0.39
    """
    begin = time.perf_counter()
    progress(f"simulate {duration:g} s")
    done = simulate_one(
        omega, duration, model, shape, cast(Mode, mode), start_angle=math.radians(start_angle),
        pull=pull, height=height / 1000, increments=increments, slope=math.radians(slope),
    )  # fmt: skip
    wall = time.perf_counter() - begin
    found: dict[str, Any] = dict(done.summary)
    spreads: list[tuple[str, str]] = []
    if mode == "hop" and spread > 1:
        progress(f"simulate {spread} more hops")
        drawn = done.spread(spread)
        found["distance_spread"] = drawn.as_json()
        spreads = [("its spread", drawn.text())]
    if as_json:
        simulated = float(done.series.times[-1])
        end = {"fell": done.outcome == "fell", "outcome": done.outcome, "simulated_s": simulated}
        emit(found | end | {"wall_s": wall})
        return
    words = {"decay": f"pulled with {pull:g} N", "drop": f"from {height:g} mm"}
    asked = words.get(mode, f"at {omega:g} rad/s")
    last = [("outcome", done.outcome), ("wall time", f"{wall:.2f} s")]
    show_table(f"{mode} {asked} for {duration:g} s", ["", ""], [*_rows(found, spreads), *last])


def _rows(found: dict[str, Any], spreads: list[tuple[str, str]]) -> list[tuple[str, str]]:
    rows = summary_rows(found)
    rows[1:1] = spreads
    if "hop_height_m" not in found:
        return rows
    hop = f"{found['hops']} of {1000 * found['stride_m']:.1f} mm"
    return [
        *rows,
        ("hops", f"{hop}, the whole foot off the ground for {found['airborne']:.0%}"),
        ("slip", f"{1000 * found['slip_per_hop_m']:.1f} mm a hop"),
        ("mean power", f"{1000 * found['mean_power_W']:.1f} mW"),
        ("cost of transport", f"{found['cost_of_transport']:.2f}"),
    ]
