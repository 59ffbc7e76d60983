"""What a review shows: one run, measured and simulated, on one time axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workbench.bundle import Judgement
from workbench.motion import (
    DRIVEN,
    FOOT,
    FOOT_ERROR,
    ROTOR_ANGLE,
    TOP,
    TOP_ERROR,
    ClampedResponse,
    Misfit,
    Mode,
    RingDown,
    Summary,
    position,
)
from workbench.timeseries import TimeSeries

__all__ = [
    "NOISE_WIDTH",
    "Comparison",
    "ErrorSources",
    "Extended",
    "Figure",
    "Largest",
    "Phase",
    "PredictionError",
    "Replayed",
    "ValidationReplay",
]

NOISE_WIDTH = 2.0
"""Standard deviations from a measured curve to the edge of its noise band."""


@dataclass(frozen=True)
class Figure:
    """What the robot looks like in 3-D, from the model, all in metres.

    Args:
        foot_length: the foot along x.
        foot_width: the foot along y.
        beam_length: the curved beam along its own line.
        beam_root: x of the beam's root on the foot, from the foot's centre (L_Orig).
        rotor_radius: distance of the rotating mass from T.
    """

    foot_length: float
    foot_width: float
    beam_length: float
    beam_root: float
    rotor_radius: float


class Phase(NamedTuple):
    """A step of the protocol that starts at a time of the common axis [s] and lasts to the next."""

    time_s: float
    name: str


class PredictionError(NamedTuple):
    """How far a model is off [mm], so long after the state that was estimated [s].

    An infinite time is that of a free simulation, driven and released as was measured.
    """

    seconds: float
    mm: float


class ErrorSources(NamedTuple):
    """What the twin's error comes from: each number a root mean square over the same time [mm].

    Distance of foot and T, of T alone where the foot is held, from the raw track.

    Args:
        until_s: how much of the run is compared [s]: of a hop the first hops.
        commanded: of the twin, as commanded or as released.
        turned: where the rotor turns as measured; None where nothing drives it.
        started: where it starts as measured, too: what remains is the model's.
        noise: what the cameras' noise alone makes.
    """

    until_s: float
    commanded: float
    turned: float | None
    started: float
    noise: float


class Replayed(NamedTuple):
    """A model beside the run, started and turned as was measured.

    Args:
        name: of the model.
        motion: channels as the twin's.
        error: distance of foot and T, of T alone where the foot is held, over time.
        rms_mm: root mean square of all that was seen of it.
        ahead: time ahead [s] -> error of predictions from the estimated state [mm].
    """

    name: str
    motion: TimeSeries
    error: TimeSeries
    rms_mm: float
    ahead: Mapping[str, float | None]


@dataclass(frozen=True)
class ValidationReplay:
    """Base and extended model as a diagnosis compares them.

    Args:
        base: the model without the causes.
        extended: the model with them.
        noise_mm: what the cameras' noise alone makes of either error.
        until_s: how much of the run is compared [s]: of a hop the first hops.
        about: how both were driven, and from which diagnosis they are.
    """

    base: Replayed
    extended: Replayed
    noise_mm: float
    until_s: float
    about: str

    @property
    def both(self) -> tuple[tuple[str, Replayed], ...]:
        """Return base and extension, each with what it is called in entities."""
        return (("base", self.base), ("extended", self.extended))


class Largest(NamedTuple):
    """The greatest distance between robot and twin [mm], and when it was [s]."""

    mm: float
    time_s: float


@dataclass(frozen=True)
class Extended:
    """The twin of a model that a diagnosis extended.

    Args:
        model: its name.
        motion: channels as the twin's.
        summary: what it did.
        misfit: root mean square distance to the robot.
    """

    model: str
    motion: TimeSeries
    summary: Summary | ClampedResponse | RingDown
    misfit: Misfit


@dataclass(frozen=True)
class Comparison:
    """One run and its twin, ready to be shown.

    All times lie on one axis whose zero is the rotor's first motion, or the release.

    Args:
        title: headline in people's words.
        run: the run's id; also the recording's.
        mode: what the robot was put through.
        real: the track, channels of `workbench.motion`; the pitch may be missing.
        twin: the same channels and `hinge_0_rad` to `hinge_{N-1}_rad`.
        duration_s: end of the drive, or of the time after the release [s].
        phases: steps of the protocol in order of time.
        figure: the robot's dimensions.
        real_summary: what the robot did.
        twin_summary: what the twin did.
        misfit: root mean square distance between the two.
        supply: `set_voltage_V`, `voltage_V`, `current_A`, or None when nothing was recorded.
        floor_m: height of the floor against the foot at rest [m]; below zero before a drop.
        extended: a third robot, the twin of an extended model.
        noise: channel -> standard deviation of what the cameras make of a robot at rest, in the
            channel's unit; empty where it is not known.
        label: what distinguishes the run from others of its protocol: condition, beam, repeat.
        protocol: the protocol's, or the sheet's, own text.
        estimate: the whole pose of the real robot as the observer has it, channels as the twin's;
            None where it was not estimated.
        predictions: errors of predictions from the estimated state, in order of time.
        judged: results beside what the protocol expects of them.
        sources: what the twin's error comes from; None where it was not found out.
        validation: base and extended model as a diagnosis compares them; None without one.
        unestimated: why the real robot's pose was not estimated; empty where it was.
        mark: why this is not to be taken for a whole run, None where it is one.
        facts: rows of the report: protocol, model, shape, hashes, versions.
        log: lines of the journal with their times [s].
        warnings: what a reader must know before believing the numbers.
    """

    title: str
    run: str
    mode: Mode
    real: TimeSeries
    twin: TimeSeries
    duration_s: float
    phases: tuple[Phase, ...]
    figure: Figure
    real_summary: Summary | ClampedResponse | RingDown
    twin_summary: Summary | ClampedResponse | RingDown
    misfit: Misfit
    supply: TimeSeries | None
    facts: Mapping[str, str]
    log: tuple[tuple[float, str], ...]
    warnings: tuple[str, ...]
    floor_m: float = 0.0
    extended: Extended | None = None
    noise: Mapping[str, float] = field(default_factory=dict)
    label: tuple[str, ...] = ()
    protocol: str = ""
    mark: str | None = None
    estimate: TimeSeries | None = None
    predictions: tuple[PredictionError, ...] = ()
    judged: tuple[Judgement, ...] = ()
    sources: ErrorSources | None = None
    validation: ValidationReplay | None = None
    unestimated: str = ""

    @property
    def called(self) -> str:
        """Return the label in one line."""
        return ", ".join(self.label)

    @property
    def headline(self) -> str:
        """Return the title, behind the mark where there is one."""
        return self.title if self.mark is None else f"{self.mark.split(',')[0]} - {self.title}"

    @property
    def driven(self) -> bool:
        """Return whether the motor turned."""
        return self.mode in DRIVEN

    @property
    def time_zero(self) -> str:
        """Return in words what happened at time zero."""
        return "the rotor's first motion" if self.driven else "the release"

    @property
    def mover(self) -> tuple[str, str, str]:
        """Return the point whose path shows most: the foot where it hops, else T."""
        return FOOT if self.mode == "hop" else TOP

    @property
    def motions(self) -> tuple[TimeSeries, ...]:
        """Return the motions of the robot, its twin and, where there is one, the extended twin."""
        return (self.real, self.twin, *([self.extended.motion] if self.extended else []))

    def error(self) -> TimeSeries:
        """Return the distance between robot and twin over the robot's times.

        Measured in the hopping plane (x, z) like `motion.misfit`, whose root mean square this is.
        A sample is valid where both were seen.
        """
        return self._apart(self.twin)

    def extended_error(self) -> TimeSeries | None:
        """Return the same distance to the extended twin, None where there is none."""
        return None if self.extended is None else self._apart(self.extended.motion)

    def largest_error(self) -> dict[str, Largest]:
        """Return the greatest plotted distance of foot and T, and when; without one never seen."""
        error, largest = self.error(), {}
        for name, column in (("foot", FOOT_ERROR), ("T", TOP_ERROR)):
            seen = np.where(error.validity(column), error[column], np.nan)
            if np.isfinite(seen).any():
                at = int(np.nanargmax(seen))
                largest[name] = Largest(float(seen[at]), float(error.times[at]))
        return largest

    def error_noise(self) -> dict[str, float]:
        """Return the root mean square distance that noise alone makes of foot and T [mm]."""
        points = {"foot": FOOT, "T": TOP}
        return {
            name: 1000 * float(np.hypot(self.noise[x], self.noise[z]))
            for name, (x, _, z) in points.items()
            if x in self.noise and z in self.noise
        }

    def rotor_lag(self) -> TimeSeries:
        """Return by how much the twin's rotor is ahead of the robot's, `lag_deg`, over its times.

        Whole turns count; at time zero the two are less than half a turn apart.
        """
        twin = self.twin.at(self.real.times)
        lag = np.degrees(twin[ROTOR_ANGLE] - self.real[ROTOR_ANGLE])
        seen = self.real.validity(ROTOR_ANGLE) & twin.validity(ROTOR_ANGLE) & np.isfinite(lag)
        start = lag[seen & (self.real.times >= 0)][:1]
        turns = np.round(start / 360) if len(start) else 0.0
        return TimeSeries.of(self.real.times, {"lag_deg": lag - 360 * turns}, {"lag_deg": seen})

    def reach(self) -> tuple[float, float]:
        """Return the least and the greatest x of all feet [m], zero where none was seen."""
        paths = [position(motion, FOOT)[:, 0] for motion in self.motions]
        x = np.concatenate([[0.0], *paths])
        return float(np.nanmin(x)), float(np.nanmax(x))

    def _apart(self, motion: TimeSeries) -> TimeSeries:
        """Return the distance of the robot from another motion over the robot's times."""
        other = motion.at(self.real.times)
        return TimeSeries.of(
            self.real.times,
            {
                FOOT_ERROR: _distance_mm(self.real, other, FOOT),
                TOP_ERROR: _distance_mm(self.real, other, TOP),
            },
        )


def _distance_mm(
    real: TimeSeries, twin: TimeSeries, point: tuple[str, str, str]
) -> NDArray[np.float64]:
    apart = position(real, point) - position(twin, point)
    return 1000 * np.hypot(apart[:, 0], apart[:, 2])
