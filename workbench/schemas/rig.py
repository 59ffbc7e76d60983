"""`workbench/rig-1`: a mechanical system as an MJCF file, and what was measured of it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.schemas.experiment import Role
from workbench.schemas.quantity import UnitQuantity
from workbench.schemas.section import Section

__all__ = [
    "ActuatorEffect",
    "BodyEffect",
    "ChannelEffect",
    "GravityEffect",
    "InputEffect",
    "JointEffect",
    "RigChannel",
    "RigEffects",
    "RigField",
    "RigFile",
    "RigFound",
    "RigInput",
    "RigParameter",
    "RigRun",
    "RigStart",
]

RigField = Literal[
    "stiffness",
    "damping",
    "frictionloss",
    "armature",
    "springref",
    "mass",
    "distance",
    "gain",
    "bias",
    "gear",
]
"""What may be other than the MJCF file says: five numbers of a joint, two of a body, three of an
actuator. A body's mass takes its inertia along; its distance is that of its frame from its
parent's. A position actuator's gain is its kp."""

JointEffect = Literal[
    "stiffness",
    "even_stiffness",
    "cubic_stiffness",
    "rest_shift",
    "damping",
    "quadratic_damping",
    "cubic_damping",
    "coulomb_friction",
    "armature",
    "compliance",
]
BodyEffect = Literal["mass", "inertia"]
ActuatorEffect = Literal["gain", "bias"]
ChannelEffect = Literal["offset", "gain", "delay"]
InputEffect = Literal["offset", "gain", "delay", "lag"]
GravityEffect = Literal["tilt_x", "tilt_y"]

_OWNERS = {"mass": "body", "distance": "body"} | dict.fromkeys(("gain", "bias", "gear"), "actuator")
"""Field -> whose it is; the others are a joint's."""

Size = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1, pattern=r"^[^.\s]+$")]


class RigParameter(Section):
    """A number of the MJCF file that is refitted within its tolerance."""

    joint: str | None = None
    body: str | None = None
    actuator: str | None = None
    field: RigField
    value: Number | None = None
    """In the unit stated; the MJCF file's own if absent."""
    tolerance: Size
    """How far the true value may lie from the stated one, in the same unit."""
    unit: str
    """SI, as the field has it: `N m/rad` for the stiffness of a hinge, `N/m` for a slide's."""

    @model_validator(mode="after")
    def _one_owner(self) -> RigParameter:
        kind = self.kind
        named = [one for one in ("joint", "body", "actuator") if getattr(self, one) is not None]
        if named != [kind]:
            others = " and ".join(one for one in ("joint", "body", "actuator") if one != kind)
            words = f"field {self.field} is {_article(kind)}'s; name the {kind} and no {others}"
            raise ValueError(words)
        return self

    @property
    def kind(self) -> Literal["joint", "body", "actuator"]:
        """Return whose number it is."""
        kind = _OWNERS.get(self.field)
        return "body" if kind == "body" else "actuator" if kind == "actuator" else "joint"

    @property
    def owner(self) -> str:
        """Return the name of the joint, body or actuator."""
        return str(getattr(self, self.kind))


def _article(kind: str) -> str:
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"


class RigChannel(Section):
    """What a column of the data measures: a joint, or one coordinate of a site in the world."""

    joint: str | None = None
    quantity: Literal["position", "velocity", "acceleration"] = "position"
    site: str | None = None
    axis: Literal["x", "y", "z"] | None = None
    column: str | None = None
    """Of the data; the channel's own name if absent."""
    scale: Number = 1.0
    """SI over the column's unit: 0.001 for a column in mm."""
    noise: Size | None = None
    """Standard deviation of its noise, SI; estimated from the data if absent."""

    @model_validator(mode="after")
    def _one_source(self) -> RigChannel:
        if (self.joint is None) == (self.site is None):
            raise ValueError("a channel needs either joint or site")
        if (self.site is None) != (self.axis is None):
            raise ValueError("axis goes with site: name both, or a joint alone")
        if self.scale == 0:
            raise ValueError("scale is 0; it must be another number")
        return self


class RigInput(Section):
    """A column of the data that was the control of an actuator."""

    actuator: str
    column: str | None = None
    """Of the data; the input's own name if absent."""
    scale: Number = 1.0
    """The actuator's control over the column's unit."""
    between: Literal["line", "curve", "held"] = "line"
    """How it went from one sample to the next: straight, smoothly, or by steps, as a converter
    that holds its value does."""


class RigStart(Section):
    """Where a joint may be when a run starts, and how fast: for one that no channel measures."""

    position: Number = 0.0
    """[rad] or [m]."""
    tolerance: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    """How far it may lie from that; 0: it is known."""
    speed: Number = 0.0
    """[rad/s] or [m/s]."""
    speed_tolerance: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    """How far the speed may lie from that; 0: it is known."""


class RigRun(Section):
    """One file of data, or two where the inputs were recorded at another rate."""

    data: str
    """CSV or Parquet with a head line, path from the rig's folder."""
    inputs: str | None = None
    """File of the inputs with times of their own, of the same clock; `data` if absent."""
    name: str | None = None
    """The file's own name if absent."""
    mode: Name = "run"
    """What was done; runs of one mode are compared with each other."""
    role: Role = "train"
    begins: Annotated[float, UnitQuantity("time")] | None = None
    """Stamp at which the simulation begins; before it all is at rest. First sample if absent."""
    late: Annotated[float, UnitQuantity("time")] | None = None
    """How far `begins` may be off: the fit finds it. Exact if absent."""
    start: dict[str, Number | Literal["held", "free"] | RigStart] = {}
    """Joint -> its position then [rad, m]. `held`: at rest where the data say; `free`: place and
    speed as the data say; `{position, tolerance, speed, speed_tolerance}`: near that; a joint that
    is not named is at rest where the MJCF file has it."""

    @model_validator(mode="after")
    def _one_time_zero(self) -> RigRun:
        if self.late is None:
            return self
        if self.late <= 0:
            raise ValueError("late is not above 0 s; leave it out where begins is exact")
        if "free" in self.start.values():
            raise ValueError("late goes with a start at rest; a free start has no other time zero")
        return self


class RigEffects(Section):
    """Which causes come into question, each with how large it may well be, SI.

    Elements that share one number are named together: `hip + knee`.
    """

    joints: dict[str, dict[JointEffect, Size]] = {}
    bodies: dict[str, dict[BodyEffect, Size]] = {}
    actuators: dict[str, dict[ActuatorEffect, Size]] = {}
    channels: dict[str, dict[ChannelEffect, Size]] = {}
    inputs: dict[str, dict[InputEffect, Size]] = {}
    gravity: dict[GravityEffect, Size] = {}
    """How the model's vertical may lie off the machine's [rad], about x or y."""


class RigFound(Section):
    """A cause that a diagnosis found: part of the model from then on."""

    cause: str
    """Owner and effect: `pivot_coulomb_friction`, `hip+knee_coulomb_friction`."""
    parameters: dict[str, Number]
    """Quantity -> value, SI. A number of the MJCF file is given whole, under its name
    (`frictionloss`), one that elements share as what comes on top; `k`, `k2`, `k3`, `shift`, `d`,
    `d2`, `d3`, `friction` and `mass`, of older files, are added to it."""
    standard_errors: dict[str, Annotated[float, Field(ge=0)]] = {}
    diagnosis: str | None = None
    """The diagnosis it came from."""


class RigFile(Section):
    """A mechanical system that can be diagnosed: model, channels, runs and possible causes."""

    schema_: Annotated[Literal["workbench/rig-1"], Field(alias="schema")]
    name: Annotated[str, Field(min_length=1)]
    model: str
    """MJCF file, path from the rig's folder."""
    time: str = "time_s"
    """Column of the times [s]."""
    parameters: tuple[RigParameter, ...] = ()
    channels: Annotated[dict[Name, RigChannel], Field(min_length=1)]
    inputs: dict[Name, RigInput] = {}
    runs: Annotated[tuple[RigRun, ...], Field(min_length=1)]
    effects: RigEffects = RigEffects()
    found: tuple[RigFound, ...] = ()
    """Causes, among those named above, that the model has."""

    @model_validator(mode="after")
    def _two_names(self) -> RigFile:
        both = sorted(set(self.channels) & set(self.inputs))
        if both:
            raise ValueError(f"{both[0]!r} names a channel and an input; rename one of them")
        return self
