"""`workbench/protocol-1`: the experiment, a list of steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from workbench.modes import DRIVEN, Mode, Role
from workbench.schemas.expect import Expectation
from workbench.schemas.levels import Heights, Pulls, Speeds, Voltages
from workbench.schemas.prompt import PromptOrText
from workbench.schemas.quantity import UnitQuantity
from workbench.schemas.section import Section
from workbench.schemas.stop import StopLimit

__all__ = [
    "Mode",
    "PartFile",
    "Pause",
    "Protocol",
    "ProtocolLimits",
    "Role",
    "RunFields",
    "RunStep",
    "Staircase",
    "Step",
    "Sweep",
    "wrong_release",
]


Speed = Annotated[float, UnitQuantity("speed", above=0)]
Volts = Annotated[float, UnitQuantity("voltage", above=0)]
Force = Annotated[float, UnitQuantity("force", above=0)]
Height = Annotated[float, UnitQuantity("length", above=0, high=1)]

_RELEASE_KEYS: dict[str, tuple[Mode, str]] = {
    "pull": ("decay", "0.39 N"),
    "height": ("drop", "20 mm"),
    "pulls": ("decay", "[0.2 N, 0.4 N]"),
    "heights": ("drop", "[10 mm, 20 mm]"),
}
"""Key -> the one mode it belongs to, an example."""


def wrong_release(mode: Mode, given: Mapping[str, object]) -> str | None:
    """Return what is wrong with keys of a release beside a mode, or None."""
    for key, value in given.items():
        owner = _RELEASE_KEYS[key][0]
        if value is not None and mode != owner:
            return f"mode {mode} has no {key}, only mode {owner} has; remove it"
    return None


class RunFields(Section):
    """What every run of a step has in common."""

    mode: Mode
    shape: str | None = None
    """Beam of these runs, a name or a path; by default the protocol's."""
    rest: Annotated[float, UnitQuantity("time", low=0.5, high=60)] = 2.0
    """Still time before the motor starts or the robot is let go, in which the cameras see it."""
    ramp: Annotated[float, UnitQuantity("time", low=0, high=60)] = 0.5
    """Time from the lowest voltage to the first one asked for."""
    role: Role = "train"
    """Whether a later diagnosis may fit this run or only test on it."""
    repeats: Annotated[int, Field(ge=1, le=1000)] = 1
    expect: Expectation | None = None
    """What these runs should come to: a run outside of a range fails."""
    stop_when: StopLimit | None = None
    """What ends such a run by itself, on a bench whose cameras stream; see `live` of a bench."""
    before: tuple[PromptOrText, ...] = ()
    """Prompts before each of these runs, with the output off."""
    after: tuple[PromptOrText, ...] = ()
    """Prompts after each of these runs, with the output off, such as a distance by tape."""

    def _require_release(self, *keys: str) -> None:
        """Refuse a release that the mode does not have or that is not given."""
        given = {key: getattr(self, key) for key in keys}
        wrong = wrong_release(self.mode, given)
        if wrong is not None:
            raise ValueError(wrong)
        for key, value in given.items():
            owner, example = _RELEASE_KEYS[key]
            if self.mode == owner and value is None:
                raise ValueError(f"mode {owner} needs {key}, for example '{key}: {example}'")
        unfit = None if self.expect is None else self.expect.wrong_for(self.mode)
        if unfit is not None:
            raise ValueError(unfit)
        if self.mode not in DRIVEN:
            for key in ("ramp", "stop_when"):
                if key in self.model_fields_set:
                    raise ValueError(f"mode {self.mode} has no drive; remove {key}")

    def _require_drive(self, first: str, second: str) -> None:
        """Require one of two keys in the modes with a drive, and neither in the others."""
        given = [name for name in (first, second) if getattr(self, name) is not None]
        if self.mode in DRIVEN and len(given) != 1:
            raise ValueError(
                f"mode {self.mode} needs either {first} or {second}, found {len(given)}"
            )
        if self.mode not in DRIVEN and given:
            raise ValueError(f"mode {self.mode} has no drive; remove {given[0]}")


class _Timed(RunFields):
    """A condition of one level."""

    duration: Annotated[float, UnitQuantity("time", above=0, high=3600)] = 10.0
    """Time from switching the output on to switching it off, or from the release to the end."""


class RunStep(_Timed):
    """One condition."""

    speed: Speed | None = None
    """Rotor speed; the bench's calibration turns it into a voltage."""
    voltage: Volts | None = None
    pull: Force | None = None
    """Force on T before the release, in mode decay."""
    height: Height | None = None
    """Height of the fall, in mode drop."""

    @model_validator(mode="after")
    def _complete(self) -> RunStep:
        self._require_drive("speed", "voltage")
        self._require_release("pull", "height")
        return self


class Sweep(_Timed):
    """The same condition at several speeds, voltages, pulls or heights, a run each."""

    speeds: Speeds | None = None
    voltages: Voltages | None = None
    pulls: Pulls | None = None
    """Forces on T before the release, in mode decay."""
    heights: Heights | None = None
    """Heights of the fall, in mode drop."""
    order: Literal["as listed", "random"] = "as listed"
    """Random mixes all runs of the sweep, repeats included."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the random order; the same seed gives the same order."""

    @model_validator(mode="after")
    def _complete(self) -> Sweep:
        self._require_drive("speeds", "voltages")
        self._require_release("pulls", "heights")
        return self


class Staircase(RunFields):
    """One run that goes from level to level without a pause, for example up and down again."""

    speeds: Speeds | None = None
    voltages: Voltages | None = None
    dwell: Annotated[float, UnitQuantity("time", low=0.1, high=3600)]
    """Time at each level, its ramp included."""
    step_ramp: Annotated[float, UnitQuantity("time", low=0, high=60)] = 0.0
    """Time from one level to the next; the bench's slew is kept in any case."""
    down: bool = False
    """Go back through the levels afterwards; the last one is not repeated."""

    @model_validator(mode="after")
    def _complete(self) -> Staircase:
        if self.mode not in DRIVEN:
            raise ValueError(f"mode {self.mode} has no drive; use the step 'run' or 'sweep'")
        self._require_drive("speeds", "voltages")
        if self.step_ramp >= self.dwell:
            raise ValueError(
                f"step_ramp {self.step_ramp:g} s is not shorter than dwell {self.dwell:g} s"
            )
        return self


class Pause(Section):
    """A wait with the output off."""

    time: Annotated[float, UnitQuantity("time", above=0, high=24 * 3600)]
    why: str | None = None
    """Shown while waiting."""


def _pause(given: object) -> object:
    return {"time": given} if isinstance(given, (str, int, float)) else given


PauseOrTime = Annotated[Pause, BeforeValidator(_pause, json_schema_input_type=str | Pause)]
"""A pause, or its time alone."""


class Step(Section):
    """One step: exactly one of its keys."""

    prompt: PromptOrText | None = None
    """For the operator, before the next run; after the last run where none follows."""
    pause: PauseOrTime | None = None
    """Wait before the next run."""
    run: RunStep | None = None
    sweep: Sweep | None = None
    staircase: Staircase | None = None
    include: str | None = None
    """Path of a file of steps (schema workbench/part-1) from this file's folder."""

    @model_validator(mode="after")
    def _one(self) -> Step:
        names = list(type(self).model_fields)
        given = [name for name in names if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none"
            raise ValueError(f"a step is exactly one of {', '.join(names)}; found {found}")
        return self


Steps = Annotated[tuple[Step, ...], Field(min_length=1)]


class PartFile(Section):
    """Steps that several protocols share."""

    schema_: Annotated[Literal["workbench/part-1"], Field(alias="schema")]
    steps: Steps


class ProtocolLimits(Section):
    """Limits of this experiment, at most those of the bench."""

    voltage: Volts | None = None
    speed: Speed | None = None
    current: Annotated[float, UnitQuantity("current", above=0)] | None = None


class Protocol(Section):
    """An experiment."""

    schema_: Annotated[Literal["workbench/protocol-1"], Field(alias="schema")]
    title: Annotated[str, Field(min_length=1, max_length=120)]
    model: str | None = None
    """Robot model, a name or a path; by default the bench's."""
    shape: str | None = None
    """Beam shape, a name or a path; by default the bench's."""
    calibration: str | None = None
    """Id of the speed-voltage line that this experiment is meant for; another bench is refused."""
    limits: ProtocolLimits = ProtocolLimits()
    steps: Steps
