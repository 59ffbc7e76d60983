"""`workbench simulate`: one simulation without a bench."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Annotated, Literal

import typer

from workbench.cli.output import JsonFlag, emit, show_table
from workbench.errors import InputError
from workbench.motion import summarize
from workbench.protocol import load_model, load_shape
from workbench.sim import make_robot, staircase, step_times
from workbench.sim import simulate as simulate_robot

__all__ = ["simulate"]

_REST_S = 0.6


def simulate(
    omega: Annotated[float, typer.Option(help="Rotor speed [rad/s]; negative turns back.")] = 17.0,
    duration: Annotated[float, typer.Option(help="Driven time [s].", min=0.1, max=600)] = 10.0,
    model: Annotated[str, typer.Option(help="Model name or file.")] = "thesis",
    shape: Annotated[str, typer.Option(help="Shape name or file.")] = "thesis-initial",
    mode: Annotated[str, typer.Option(help="hop or clamped.")] = "hop",
    start_angle: Annotated[
        float, typer.Option(help="Rotor at rest [deg] from forward, 90 is down.")
    ] = 90.0,
    as_json: JsonFlag = False,
) -> None:
    """Simulate one run and tell distance, hop height and whether the robot fell.

    Example: workbench simulate --omega 17 --duration 10
    """
    if mode not in ("hop", "clamped"):
        raise InputError(f"mode {mode!r} cannot be simulated; it must be hop or clamped")
    chosen: Literal["hop", "clamped"] = mode
    if not abs(omega) <= 60:
        raise InputError(f"omega {omega:g} rad/s is outside -60 to 60 rad/s, the motor's range")
    begin = time.perf_counter()
    robot = make_robot(
        load_model(model, Path()).content.values(), load_shape(shape, Path()).content
    )
    speed = staircase(step_times(_REST_S + duration), [(_REST_S, omega)])
    result = simulate_robot(robot, chosen, speed, math.radians(start_angle))
    wall = time.perf_counter() - begin
    summary = summarize(result.motion.shifted(-_REST_S), duration)
    found = {
        "distance_m": summary.distance_m,
        "hop_height_m": summary.hop_height_m,
        "speed_rad_s": summary.speed_rad_s,
        "fell": result.outcome == "fell",
        "outcome": result.outcome,
        "cost_of_transport": None,
        "simulated_s": float(result.motion.times[-1]),
        "wall_s": wall,
    }
    if as_json:
        emit(found)
        return
    shown = (
        ("distance", f"{summary.distance_m:.3f} m"),
        ("hop height", f"{1000 * summary.hop_height_m:.1f} mm"),
        ("outcome", result.outcome),
        ("wall time", f"{wall:.2f} s"),
    )
    show_table(f"{mode} at {omega:g} rad/s for {duration:g} s", ["", ""], shown)
