"""`workbench modes`: natural modes of the clamped robot, and its response to the rotor's speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from workbench.cli.completion import model_names, shape_names
from workbench.cli.console import progress, show_table
from workbench.cli.number_option import number
from workbench.cli.plain_output import JsonFlag, emit
from workbench.schemas import load_model, load_shape
from workbench.sim import (
    DrivenPeak,
    DrivenResponse,
    NaturalMode,
    Robot,
    driven_peaks,
    driven_response,
    linear_modes,
    make_robot,
)

__all__ = ["modes"]

_STEP = 0.5  # [rad/s] from one speed to the next
_STEADY = 0.05  # relative change of the amplitude from five turns to the next five


def modes(
    model: Annotated[
        str, typer.Option(help="Model name or file.", autocompletion=model_names)
    ] = "thesis",
    shape: Annotated[
        str, typer.Option(help="Shape name or file.", autocompletion=shape_names)
    ] = "thesis-initial",
    rotor_angle: Annotated[
        float | None,
        typer.Option(
            help="Lock the rotor at this angle in degrees from forward, 90 is down; without it the "
            "rotor is a point mass at T."
        ),
    ] = None,
    increments: Annotated[
        int | None, typer.Option(help="Of the beam; by default the model's.", min=4, max=128)
    ] = None,
    driven: Annotated[
        bool, typer.Option("--driven", help="Also sweep the rotor's speed up and down.")
    ] = False,
    slowest: Annotated[
        float,
        typer.Option(
            help="First rotor speed of the sweep [rad/s].", parser=number("speed", "rad/s", 1)
        ),
    ] = 4.0,
    fastest: Annotated[
        float,
        typer.Option(
            help="Last rotor speed of the sweep [rad/s].", parser=number("speed", "rad/s", high=60)
        ),
    ] = 22.0,
    hold: Annotated[
        float, typer.Option(help="Time at each speed [s].", parser=number("time", "s", high=600))
    ] = 20.0,
    as_json: JsonFlag = False,
) -> None:
    """Report the natural modes of the clamped robot, and with --driven the peaks when driven.

    Example: workbench modes --shape thesis-initial --driven
    """
    file = load_model(model, Path()).content
    robot = make_robot(
        file.values(),
        load_shape(shape, Path()).content,
        increments or file.increments,
        file.quantities(),
    )
    angle = None if rotor_angle is None else math.radians(rotor_angle)
    natural = linear_modes(robot, rotor_angle=angle)
    result: dict[str, Any] = {
        "clamped": [mode._asdict() for mode in natural],
        "rotor_angle_deg": rotor_angle,
    }
    if not as_json:
        _show_modes(natural, rotor_angle)
    if driven:
        result["driven"] = _drive(
            robot, np.arange(slowest, fastest + _STEP / 2, _STEP), hold, as_json
        )
    if as_json:
        emit(result)


def _drive(
    robot: Robot, speeds: NDArray[np.float64], hold: float, as_json: bool
) -> dict[str, list[Any]]:
    progress(f"driving the clamped robot at {len(speeds)} speeds for {hold:g} s each, up and down")
    up, down = driven_response(robot, speeds.tolist(), hold=hold)
    peaks = driven_peaks([up, down])
    if not as_json:
        _show_driven(up, down, peaks)
    return {"up": _rows(up), "down": _rows(down), "peaks": [peak._asdict() for peak in peaks]}


def _rows(response: DrivenResponse) -> list[dict[str, float]]:
    names = ("speed_rad_s", "amplitude_x_m", "amplitude_z_m", "change")
    columns = (response.speed, response.x, response.z, response.change)
    return [dict(zip(names, map(float, row), strict=True)) for row in zip(*columns, strict=True)]


def _show_modes(natural: Sequence[NaturalMode], rotor_angle: float | None) -> None:
    where = "a point mass at T" if rotor_angle is None else f"locked at {rotor_angle:g} deg"
    head = ["mode", "frequency [Hz]", "speed [rad/s]", "damping ratio [%]", "T moves along (x, z)"]
    rows = [
        [
            str(k + 1),
            f"{mode.hz:.3f}",
            f"{2 * math.pi * mode.hz:.2f}",
            f"{100 * mode.damping_ratio:.2f}",
            "({:+.2f}, {:+.2f})".format(*mode.top_direction),
        ]
        for k, mode in enumerate(natural)
    ]
    show_table(f"linear modes, foot clamped, rotor {where}", head, rows)


def _show_driven(up: DrivenResponse, down: DrivenResponse, peaks: Sequence[DrivenPeak]) -> None:
    head = ["speed [rad/s]", "up: x [mm]", "up: z [mm]", "down: x [mm]", "down: z [mm]"]
    ups = [_cells(*row) for row in zip(up.x, up.z, up.change, strict=True)]
    downs = [_cells(*row) for row in zip(down.x, down.z, down.change, strict=True)]
    rows = [
        [f"{speed:g}", *rising, *falling]
        for speed, rising, falling in zip(up.speed, ups, downs[::-1], strict=True)
    ]
    show_table("driven amplitude of T, half of peak to peak; ~ where it is not steady", head, rows)
    rows = [
        [peak.direction, peak.axis, f"{peak.speed_rad_s:g}", _millimetres(peak.amplitude_m)]
        for peak in peaks
    ]
    head = ["sweep", "axis", "speed [rad/s]", "amplitude [mm]"]
    show_table("driven peaks, which are not the linear modes", head, rows)


def _cells(x: float, z: float, change: float) -> list[str]:
    mark = "~" if abs(change) > _STEADY else ""
    return [mark + _millimetres(amplitude) for amplitude in (x, z)]


def _millimetres(amplitude: float) -> str:
    return "fell" if math.isnan(amplitude) else f"{1000 * amplitude:.1f}"
