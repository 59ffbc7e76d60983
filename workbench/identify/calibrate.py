"""The speed-voltage line from runs: which of them count, the line, what speaks against it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np

from workbench.bundle import Bundle
from workbench.errors import InputError
from workbench.fit import measured_run
from workbench.identify.line_checks import Check, check_line, voltage_groups
from workbench.identify.shaft import shaft_speed
from workbench.identify.speed_line import LineInterval, SpeedLine, SpeedPoint, fit_line
from workbench.motion import Mode
from workbench.progress import Progress, counted

__all__ = ["OmittedRun", "SpeedCalibration", "calibrate", "speed_point", "speed_points"]

LEAST_VOLTAGES = 3
LEAST_SPAN_V = 1.0
WIDEST_SLOPE = 0.05  # half of the slope's interval, as a share of the slope
_WAVERS_V = 0.05  # a supply that reads back more change than this is at its current limit
_HOUR_S = 3600.0
_UNITS = {"slope": "rad/s/V", "offset": "rad/s"}


@dataclass(frozen=True)
class OmittedRun:
    """A run that gives no speed at a voltage, and why."""

    name: str
    reason: str


@dataclass(frozen=True, eq=False)
class SpeedCalibration:
    """What the runs say about the motor.

    Args:
        points: that count.
        line: through them, None where they cannot determine one.
        checks: by name, empty without a line.
        held_out: points that were not fitted, only compared.
        omitted: runs that give nothing.
        open: why there is no line.
    """

    points: tuple[SpeedPoint, ...]
    line: SpeedLine | None
    checks: Mapping[str, Check]
    held_out: tuple[SpeedPoint, ...]
    omitted: tuple[OmittedRun, ...]
    open: str | None

    @property
    def parameters(self) -> dict[str, tuple[LineInterval, str]]:
        """Return slope and offset with their units, nothing where they are not determined."""
        if self.line is None:
            return {}
        return {
            "slope": (self.line.slope, _UNITS["slope"]),
            "offset": (self.line.offset, _UNITS["offset"]),
        }

    @property
    def mode(self) -> Mode:
        """Return the mode of the last run that counts, clamped where none does."""
        return self.points[-1].mode if self.points else "clamped"

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return what speaks against the line, as sentences."""
        outside = [
            f"held-out run {name} lies {apart:+.3f} rad/s off the line, outside the 90 % interval "
            f"of one run, {half:.3f} rad/s"
            for name, apart, half in self.held_out_errors
            if abs(apart) > half
        ]
        return (*(one.text for one in self.checks.values() if one.found), *outside)

    @property
    def held_out_errors(self) -> list[tuple[str, float, float]]:
        """Return name, distance from the line and half width of its 90 % interval [rad/s]."""
        if self.line is None:
            return []
        return [
            (
                point.name,
                self.line.residual(point),
                float(self.line.half_width(np.array([point.voltage]), point.standard_error)[0]),
            )
            for point in self.held_out
        ]

    def as_json(self) -> dict[str, Any]:
        """Return the object that the command line prints."""
        return {
            "parameters": {
                name: {"value": found.value, "interval90": [found.low, found.high], "unit": unit}
                for name, (found, unit) in self.parameters.items()
            },
            "not_determined": [] if self.open is None else [self.open],
            "validation": self._validation(),
            "runs": [point.name for point in self.points],
            "left_out": [{"run": one.name, "reason": one.reason} for one in self.omitted],
            "warnings": list(self.warnings),
        }

    def _validation(self) -> dict[str, Any] | None:
        if self.line is None:
            return None
        residuals = zip(self.points, self.line.residuals, strict=True)
        return {
            "scatter_rad_s": self.line.scatter,
            "birge_ratio": self.line.fit.birge,
            "residual_rad_s": {point.name: float(apart) for point, apart in residuals},
            "held_out": [
                {"run": name, "error_rad_s": apart, "interval90_rad_s": half}
                for name, apart, half in self.held_out_errors
            ],
            "checks": {
                name: {"size": one.size, "unit": one.unit, "p_value": one.p_value,
                       "found": one.found, "untested": one.untested}
                for name, one in self.checks.items()
            },
        }  # fmt: skip


def speed_point(bundle: Bundle) -> SpeedPoint:
    """Return the mean speed of a run and the voltage at which it turned.

    Raises:
        InputError: with the reason why the run says nothing about the line.
    """
    run = measured_run(bundle)
    voltage, source = _voltage(bundle)
    speed = shaft_speed(run)
    return SpeedPoint(
        name=run.name,
        voltage=voltage,
        speed=abs(speed.value),
        standard_error=speed.standard_error,
        mode=run.mode,
        sense=1 if speed.value > 0 else -1,
        hours=_hours(bundle),
        source=source,
    )


def speed_points(
    bundles: Sequence[Bundle], progress: Progress = lambda text: None
) -> tuple[list[SpeedPoint], list[SpeedPoint], list[OmittedRun]]:
    """Return the points to fit, those held out, and the runs that give none, with the reason.

    Args:
        bundles: of the runs.
        progress: receives each run.
    """
    points: list[SpeedPoint] = []
    held_out: list[SpeedPoint] = []
    omitted: list[OmittedRun] = []
    for k, bundle in enumerate(bundles):
        progress(counted(f"rotor speed of {bundle.path.name}", k + 1, len(bundles)))
        try:
            point = speed_point(bundle)
        except InputError as error:
            omitted.append(OmittedRun(bundle.path.name, str(error)))
            continue
        (points if bundle.asked.role == "train" else held_out).append(point)
    return points, held_out, omitted


def calibrate(
    points: Sequence[SpeedPoint],
    held_out: Sequence[SpeedPoint] = (),
    omitted: Sequence[OmittedRun] = (),
) -> SpeedCalibration:
    """Fit the line and look for what speaks against it.

    Args:
        points: of the runs to fit.
        held_out: of the runs to compare with.
        omitted: kept for the report.
    """
    kept = (tuple(held_out), tuple(omitted))
    reason = _undetermined(points)
    if reason is not None:
        return SpeedCalibration(tuple(points), None, {}, *kept, reason)
    line = fit_line(points)
    half = (line.slope.high - line.slope.low) / 2
    if half > WIDEST_SLOPE * abs(line.slope.value):
        reason = (
            f"the slope is only known within \N{PLUS-MINUS SIGN}{half:.2g} rad/s/V of "
            f"{line.slope.value:.3g} rad/s/V; more runs, farther apart, would determine it"
        )
        return SpeedCalibration(tuple(points), None, {}, *kept, reason)
    return SpeedCalibration(tuple(points), line, check_line(line), *kept, None)


def _undetermined(points: Sequence[SpeedPoint]) -> str | None:
    """Return why the voltages cannot determine a line, None where they can."""
    volts = np.array([point.voltage for point in points])
    count = len(points) and int(voltage_groups(volts).max()) + 1
    if count < LEAST_VOLTAGES:
        listed = ", ".join(f"{volt:.2f} V" for volt in sorted(set(volts.round(2)))) or "none"
        return (
            f"the runs have {count} different voltage{'s' * (count != 1)} ({listed}); a line and a "
            f"test of it need at least {LEAST_VOLTAGES}"
        )
    if np.ptp(volts) < LEAST_SPAN_V:
        return (
            f"the voltages span only {np.ptp(volts):.2f} V, from {volts.min():.2f} to "
            f"{volts.max():.2f} V; a line needs at least {LEAST_SPAN_V:g} V"
        )
    return None


def _voltage(bundle: Bundle) -> tuple[float, str]:
    """Return the voltage of the steady part [V] and whether it was read back or asked."""
    asked, sent = bundle.asked.voltage_V, bundle.manifest.measured.sent
    if sent is not None and bundle.series.has("supply"):
        drive = bundle.series.read("supply").between(sent[-2][0], sent[-1][0])
        drive = drive["voltage_V"]
        if len(drive) > 1:
            drive = drive[1:]  # the first reading may still see the step
            if np.ptp(drive) > _WAVERS_V:
                raise InputError(
                    f"the supply read back {drive.min():.2f} to {drive.max():.2f} V while "
                    f"{asked:g} V was set; is it at its current limit?"
                )
            return float(drive.mean()), "read back"
    if asked is None:
        raise InputError("no voltage is known, neither read back nor asked; the sheet gives omega")
    return float(asked), "asked"


def _hours(bundle: Bundle) -> float:
    """Return when the run was measured [h]; a take that was ingested does not say."""
    if bundle.asked.kind != "run":
        return float("nan")
    return datetime.fromisoformat(bundle.manifest.created).timestamp() / _HOUR_S
