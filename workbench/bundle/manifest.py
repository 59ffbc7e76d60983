"""The manifest of a run, typed: one section for each moment at which facts become known.

On disk the sections lie flat in one JSON object, as they have from the first version on, so that
scripts and older programs read it as before. Only this module knows its keys.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from types import MappingProxyType
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from workbench.modes import Mode, Role

__all__ = [
    "SCHEMA",
    "SECTIONS",
    "Alignment",
    "AnswerFact",
    "Asked",
    "CameraWindow",
    "ChannelFacts",
    "Clocks",
    "CommandFacts",
    "Compared",
    "DelayFacts",
    "Driven",
    "FloorFacts",
    "Manifest",
    "ManifestSection",
    "Measured",
    "ObserverFacts",
    "ReleaseFacts",
    "Released",
    "RotorSpeedFacts",
    "SignalFacts",
    "Status",
    "SupplyIdentity",
    "Swung",
    "TrackFacts",
    "split",
]

SCHEMA = "workbench/bundle-1"
Status = Literal["failed", "complete", "interrupted", "safety-stop"]
_NAN = float("nan")


class _Frozen(BaseModel):
    """A part of the manifest; what a newer version has written beside it is kept."""

    model_config = ConfigDict(frozen=True, extra="allow")

    def as_json(self) -> dict[str, Any]:
        """Return what was set, in plain values."""
        return self.model_dump(by_alias=True, exclude_unset=True)


class ManifestSection(_Frozen):
    """Facts that become known together; on disk their keys lie in the manifest itself."""


class Asked(ManifestSection):
    """What was asked for, known before anything moves. What a mode does not have is None."""

    kind: Literal["run", "ingest"]
    title: str
    mode: Mode
    role: Role
    model: str
    shape: str
    operator: str | None = None
    """Name of the account; who typed a name is among the answers."""
    number: int = 1
    """Of the run in its protocol or sheet, from 1."""
    of: int = 1
    """How many runs the protocol or sheet has."""
    protocol: str | None = None
    """Name of the file; of a run."""
    sheet: str | None = None
    """Name of the file; of an ingest."""
    repeat: int | None = None
    experiment: str | None = None
    """Id that all runs of one execution of a protocol share."""
    inputs: dict[str, str] | None = None
    """Name of each input -> sha256 of what it came to."""
    attempt: int = 1
    rest_s: float | None = None
    duration_s: float | None = None
    voltage_V: float | None = None
    speed_rad_s: float | None = None
    ramp_s: float | None = None
    pull_N: float | None = None
    pull_up_N: float | None = None
    height_m: float | None = None
    levels: tuple[tuple[float, float, float | None], ...] | None = None
    """Of a staircase: (time [s], voltage [V], speed [rad/s])."""
    expect: dict[str, tuple[float | None, float | None]] = {}
    """Name of a result -> least and greatest value with which the run passes, in its unit."""
    bench: str | None = None
    calibration: str | None = None
    versions: dict[str, str] = {}

    @property
    def speeds(self) -> tuple[float, ...]:
        """Speeds that were asked for [rad/s]: one, those of a staircase, or none."""
        several = (*self.levels,) if self.levels else ((0.0, 0.0, self.speed_rad_s),)
        return tuple(speed for _, _, speed in several if speed is not None)


class SupplyIdentity(_Frozen):
    """What the supply says of itself."""

    model: str
    serial: str
    firmware: str

    @property
    def words(self) -> str:
        """Model, serial number and firmware, for people."""
        return f"{self.model} {self.serial} {self.firmware}"


class CameraWindow(_Frozen):
    """When the cameras recorded."""

    began: datetime
    seconds: float


class AnswerFact(_Frozen):
    """What the operator typed, with its unit."""

    value: str | int | float | None
    unit: str | None


class Measured(ManifestSection):
    """What happened at the bench; each fact is None until it is known."""

    supply: SupplyIdentity | None = None
    sent: tuple[tuple[float, float], ...] | None = None
    """(time [s], voltage [V]) on the cameras' clock; the last one is 0 V."""
    output_off: str | None = None
    """A verdict of `OutputState`."""
    cameras: CameraWindow | None = None
    answers: dict[str, AnswerFact] = {}
    take_forced: tuple[str, ...] | None = None
    """Why the take seemed not to belong, where it was added all the same."""


class ReleaseFacts(_Frozen):
    """From where the robot was let go."""

    pull_N: float = 0.0
    pull_up_N: float = 0.0
    height_m: float = 0.0
    standard_error: float | None = None
    """In the unit of what was found in the data; None where it was stated."""


class CommandFacts(_Frozen):
    """What the motor was commanded: (time [s], rotor speed [rad/s]) and the whole length [s]."""

    steps: tuple[tuple[float, float], ...] = ()
    duration_s: float


class _Done(_Frozen):
    """What a run did; `outcome` is that of a simulation."""

    outcome: str = "completed"

    @property
    def travel_m(self) -> float | None:
        """Return the distance that was hopped [m]; None in a mode that does not hop."""
        return None


class Driven(_Done):
    """What a driven robot did."""

    distance_m: float
    hop_height_m: float = _NAN
    speed_rad_s: float = _NAN

    @property
    def travel_m(self) -> float | None:
        """Return the distance that was hopped [m]."""
        return self.distance_m


class Swung(_Done):
    """What a driven robot did whose foot was clamped."""

    amplitude_m: float
    swing_hz: float = _NAN
    phase_rad: float = _NAN
    speed_rad_s: float = _NAN


class Released(_Done):
    """What a released robot did."""

    displacement_m: float
    ring_hz: float = _NAN
    damping_ratio: float = _NAN


class TrackFacts(_Frozen):
    """How the take became a track."""

    recipe: str
    zero_in_take_s: float
    start_angle_rad: float
    rest_s: float
    cleaning: dict[str, Any] = {}
    """Report of the cleaning, for people."""


class Compared(ManifestSection):
    """The run beside its twin."""

    release: ReleaseFacts | None = None
    command: CommandFacts | None = None
    real: Driven | Swung | Released
    twin: Driven | Swung | Released
    error_mm: float
    error_foot_mm: float = _NAN
    error_top_mm: float = _NAN
    track: TrackFacts | None = None
    warnings: tuple[str, ...] = ()


class ObserverFacts(ManifestSection):
    """How well the model predicts the run."""

    state: str
    """`estimated`, or why the run could not be observed."""
    prediction_mm: dict[str, float | None] = {}
    """Time ahead [s] -> root mean square error."""
    compared_s: float | None = None
    """Until when free simulations are compared: a hop to its first hops. None in older bundles."""
    commanded_mm: float | None = None
    """Error of the twin over that time: as commanded, or released as asked."""
    measured_input_mm: float | None = None
    """Error of a free simulation whose rotor turns as measured."""
    measured_start_mm: float | None = None
    """Error of one that starts as measured, too."""
    noise_floor_mm: float | None = None
    """What the cameras' noise alone makes of these errors."""


class ChannelFacts(_Frozen):
    """Noise of one channel; None where there are too few samples."""

    rest: float | None
    white: float | None
    synchronous: float | None = None
    correlation_s: float | None = None


class RotorSpeedFacts(_Frozen):
    """Mean speed of the rotor while driven [rad/s]."""

    value: float
    standard_error: float
    turns: float


class FloorFacts(_Frozen):
    """The plane that the foot stood on."""

    slope_x_rad: float
    slope_x_error_rad: float
    slope_y_rad: float | None
    slope_y_error_rad: float | None
    contacts: int
    left_m: float


class DelayFacts(_Frozen):
    """How much later T is than the twin's [s]."""

    seconds: float
    standard_error: float
    left: float


class Clocks(_Frozen):
    """The cameras' clock against the bench's."""

    offset_s: float
    offset_error_s: float
    drift_ppm: float | None
    drift_error_ppm: float | None
    lag_s: float
    speed_ratio: float
    left_rad: float


class Alignment(_Frozen):
    """The run against its twin and its bench, in time; None where it cannot be determined."""

    twin_delay: DelayFacts | None
    clocks: Clocks | None


class SignalFacts(ManifestSection):
    """What the channels themselves show."""

    noise_mm: dict[str, ChannelFacts] = {}
    noise_rad: dict[str, ChannelFacts] = {}
    rotor_speed_rad_s: RotorSpeedFacts | None = None
    floor: FloorFacts | None = None
    alignment: Alignment | None = None


SECTIONS: Mapping[str, type[ManifestSection]] = MappingProxyType(
    {"asked": Asked, "measured": Measured, "compared": Compared, "observed": ObserverFacts,
     "signals": SignalFacts}
)  # fmt: skip


class Manifest(_Frozen):
    """What a run was and how it ended. A section is None until its facts are known."""

    schema_: Literal["workbench/bundle-1"] = Field(default=SCHEMA, alias="schema")
    id: str
    status: Status = "failed"
    created: str = ""
    """Local time, ISO 8601."""
    error: str | None = None
    asked: Asked | None = None
    measured: Measured = Measured()
    compared: Compared | None = None
    observed: ObserverFacts | None = None
    signals: SignalFacts | None = None

    @classmethod
    def read(cls, facts: Mapping[str, Any]) -> Manifest:
        """Return the manifest of a JSON object.

        Raises:
            ValueError: when a fact is missing or of another type; the message names all of them.
        """
        sections, head = split(facts)
        try:
            found = {name: SECTIONS[name].model_validate(part) for name, part in sections.items()}
            return cls.model_validate(dict(head) | found)
        except ValidationError as error:
            raise ValueError(_faults(error)) from None

    def flat(self) -> dict[str, Any]:
        """Return the JSON object: head and sections in one, only what was set."""
        head_facts = self.model_dump(by_alias=True, exclude_unset=True, exclude=set(SECTIONS))
        head = {"schema": self.schema_} | head_facts
        for name in SECTIONS:
            section = getattr(self, name)
            head |= {} if section is None else section.as_json()
        return head

    def noting(self, *sections: ManifestSection) -> Manifest:
        """Return the manifest with more facts; those that are new replace those of before."""
        merged: dict[str, ManifestSection] = {}
        for section in sections:
            name = next(name for name, kind in SECTIONS.items() if kind is type(section))
            before = merged.get(name) or getattr(self, name)
            known = {} if before is None else before.as_json()
            merged[name] = type(section).model_validate(known | section.as_json())
        return self.model_copy(update=merged)

    def ended(self, status: Status, error: str | None) -> Manifest:
        """Return the manifest of a run that ended; a reason of before goes where there is none."""
        changed: dict[str, Any] = {"status": status}
        if error is not None or self.error is not None:
            changed["error"] = error
        return self.model_copy(update=changed)


def split(facts: Mapping[str, Any]) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """Return the facts of each section that has some, and those of the head."""
    remaining = dict(facts)
    sections = {
        name: {key: remaining.pop(key) for key in kind.model_fields if key in remaining}
        for name, kind in SECTIONS.items()
    }
    return {name: values for name, values in sections.items() if values}, remaining


def _faults(error: ValidationError) -> str:
    faults = (f"{'.'.join(map(str, one['loc']))}: {one['msg']}" for one in error.errors())
    return "; ".join(faults)
