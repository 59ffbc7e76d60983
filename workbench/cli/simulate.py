"""`workbench simulate`: one simulation without a bench."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, cast, get_args

import numpy as np
import typer

from workbench.cli.output import JsonFlag, emit, show_table
from workbench.errors import InputError
from workbench.motion import summarize
from workbench.protocol import Mode, load_model, load_shape
from workbench.sim import LIMITS, Condition, gait, make_robot, sample_times
from workbench.sim import simulate as simulate_robot

__all__ = ["simulate"]

MODES = get_args(Mode)
FASTEST = LIMITS["speed"].value
_REST_S = 0.6


def simulate(
    omega: Annotated[float, typer.Option(help="Rotor speed [rad/s]; negative turns back.")] = 17.0,
    duration: Annotated[float, typer.Option(help="Driven time [s].", min=0.1, max=600)] = 10.0,
    model: Annotated[str, typer.Option(help="Model name or file.")] = "thesis",
    shape: Annotated[str, typer.Option(help="Shape name or file.")] = "thesis-initial",
    mode: Annotated[str, typer.Option(help=f"One of {', '.join(MODES)}.")] = "hop",
    start_angle: Annotated[
        float, typer.Option(help="Rotor at rest [deg] from forward, 90 is down.")
    ] = 90.0,
    pull: Annotated[float, typer.Option(help="Force on T before its release [N], decay.")] = 0.39,
    height: Annotated[float, typer.Option(help="Height of the fall [m], drop.")] = 0.02,
    increments: Annotated[int, typer.Option(help="Of the beam.", min=4, max=128)] = 16,
    slope: Annotated[float, typer.Option(help="Of the floor, rising forward [deg].")] = 0.0,
    as_json: JsonFlag = False,
) -> None:
    """Simulate one run and tell distance, hop height and whether the robot fell.

    Example: workbench simulate --omega 17 --duration 10
    """
    if mode not in MODES:
        raise InputError(f"mode {mode!r} cannot be simulated; it must be one of {', '.join(MODES)}")
    if not abs(omega) <= FASTEST:
        raise InputError(f"omega {omega:g} rad/s is outside -{FASTEST:g} to {FASTEST:g} rad/s")
    begin = time.perf_counter()
    robot = make_robot(
        load_model(model, Path()).content.values(), load_shape(shape, Path()).content
    )
    robot = replace(robot, increments=increments, slope=math.radians(slope))
    command = np.full(len(sample_times(duration)), omega if mode in ("hop", "clamped") else 0.0)
    condition = Condition(
        cast(Mode, mode), command, math.radians(start_angle), _REST_S, pull, height
    )
    result = simulate_robot(robot, condition)
    wall = time.perf_counter() - begin
    summary = summarize(result.motion, duration)
    hops = gait(result, duration)
    found = {
        "distance_m": summary.distance_m,
        "hop_height_m": summary.hop_height_m,
        "speed_rad_s": summary.speed_rad_s,
        "fell": result.outcome == "fell",
        "outcome": result.outcome,
        "simulated_s": float(result.motion.times[-1]),
        "wall_s": wall,
    } | hops._asdict()
    if as_json:
        emit(found)
        return
    shown = (
        ("distance", f"{summary.distance_m:.3f} m"),
        ("hop height", f"{1000 * summary.hop_height_m:.1f} mm"),
        ("hops", f"{hops.hops} of {1000 * hops.stride_m:.1f} mm, in the air {hops.airborne:.0%}"),
        ("slip", f"{1000 * hops.slip_per_hop_m:.1f} mm a hop"),
        ("mean power", f"{1000 * hops.mean_power_W:.1f} mW"),
        ("cost of transport", f"{hops.cost_of_transport:.2f}"),
        ("outcome", result.outcome),
        ("wall time", f"{wall:.2f} s"),
    )
    show_table(f"{mode} at {omega:g} rad/s for {duration:g} s", ["", ""], shown)
