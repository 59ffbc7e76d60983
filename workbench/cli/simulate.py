"""`workbench simulate`: one simulation without a bench."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, cast, get_args

import numpy as np
import typer

from workbench.clamped import summarize_clamped
from workbench.cli.amount import amount
from workbench.cli.completing import model_names, shape_names
from workbench.cli.output import JsonFlag, emit, show_table, summary_rows, tell
from workbench.design.distance_draws import DRAWS, VARIED, draw_distances
from workbench.errors import InputError
from workbench.motion import DRIVEN, Mode, summarize
from workbench.protocol import load_model, load_shape
from workbench.ringdown import summarize_release
from workbench.sim import LIMITS, Condition, Simulation, gait, make_robot, sample_times
from workbench.sim import simulate as simulate_robot

__all__ = ["simulate"]

MODES = get_args(Mode)
FASTEST = LIMITS["speed"].value
_REST_S = 0.6


def simulate(
    omega: Annotated[
        float,
        typer.Option(
            help="Rotor speed [rad/s]; negative turns back.", parser=amount("speed", "rad/s")
        ),
    ] = 17.0,
    duration: Annotated[
        float, typer.Option(help="From time zero [s].", parser=amount("time", "s", 0.1, 600))
    ] = 10.0,
    model: Annotated[
        str, typer.Option(help="Model name or file.", autocompletion=model_names)
    ] = "thesis",
    shape: Annotated[
        str, typer.Option(help="Shape name or file.", autocompletion=shape_names)
    ] = "thesis-initial",
    mode: Annotated[str, typer.Option(help=f"One of {', '.join(MODES)}.")] = "hop",
    start_angle: Annotated[
        float,
        typer.Option(
            help="Rotor at rest [deg] from forward, 90 is down.", parser=amount("angle", "deg")
        ),
    ] = 90.0,
    pull: Annotated[
        float,
        typer.Option(help="Force on T before its release [N], decay.", parser=amount("force", "N")),
    ] = 0.39,
    height: Annotated[
        float,
        typer.Option(help="Height of the fall [mm], drop.", parser=amount("length", "mm", 0, 1000)),
    ] = 20.0,
    increments: Annotated[
        int | None, typer.Option(help="Of the beam; by default the model's.", min=4, max=128)
    ] = None,
    slope: Annotated[
        float,
        typer.Option(help="Of the floor, rising forward [deg].", parser=amount("angle", "deg")),
    ] = 0.0,
    spread: Annotated[
        int,
        typer.Option(
            help="Hops that tell how the distance spreads over start angle, friction and speed "
            "within their tolerances; 0 for none.",
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
    _require(mode, omega)
    begin = time.perf_counter()
    file = load_model(model, Path()).content
    robot = make_robot(
        file.values(),
        load_shape(shape, Path()).content,
        increments or file.increments,
        file.quantities(),
    )
    robot = replace(robot, slope=math.radians(slope))
    command = np.full(len(sample_times(duration)), omega if mode in DRIVEN else 0.0)
    condition = Condition(
        cast(Mode, mode), command, math.radians(start_angle), _REST_S, pull, height / 1000
    )
    tell(f"simulate {duration:g} s")
    result = simulate_robot(robot, condition)
    wall = time.perf_counter() - begin
    found: dict[str, Any] = _numbers(condition.mode, result, duration)
    spreads: list[tuple[str, str]] = []
    if mode == "hop" and spread > 1:
        tell(f"simulate {spread} more hops")
        tolerances = {name: getattr(file.parameters, name).tolerance for name in VARIED}
        (drawn,) = draw_distances([(robot, condition)], tolerances, spread)
        found["distance_spread"] = drawn.as_json()
        spreads = [("its spread", drawn.text())]
    end = {
        "fell": result.outcome == "fell",
        "outcome": result.outcome,
        "simulated_s": float(result.motion.times[-1]),
        "wall_s": wall,
    }
    if as_json:
        emit(found | end)
        return
    words = {"decay": f"pulled with {pull:g} N", "drop": f"from {height:g} mm"}
    asked = words.get(mode, f"at {omega:g} rad/s")
    last = [("outcome", result.outcome), ("wall time", f"{end['wall_s']:.2f} s")]
    show_table(f"{mode} {asked} for {duration:g} s", ["", ""], [*_rows(found, spreads), *last])


def _require(mode: str, omega: float) -> None:
    if mode not in MODES:
        raise InputError(f"mode {mode!r} cannot be simulated; it must be one of {', '.join(MODES)}")
    if not abs(omega) <= FASTEST:
        raise InputError(f"omega {omega:g} rad/s is outside -{FASTEST:g} to {FASTEST:g} rad/s")


def _numbers(mode: Mode, result: Simulation, duration: float) -> dict[str, float]:
    """Return what the robot did under names with units."""
    if mode in DRIVEN:
        told = summarize_clamped if mode == "clamped" else summarize
        return told(result.motion, duration).as_json() | gait(result, duration)._asdict()
    return summarize_release(result.motion, mode, duration).as_json()


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
