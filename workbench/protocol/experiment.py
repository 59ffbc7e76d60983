"""`workbench/protocol-1`: the experiment, a list of steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.motion import DRIVEN, Mode
from workbench.protocol.quantity import Quantity
from workbench.protocol.section import Section

__all__ = ["Mode", "Protocol", "ProtocolLimits", "Role", "Run", "Step", "Sweep", "wrong_release"]

Role = Literal["train", "held_out"]
Speed = Annotated[float, Quantity("speed", above=0)]
Volts = Annotated[float, Quantity("voltage", above=0)]

_RELEASE_KEYS: dict[str, tuple[Mode, str]] = {
    "pull": ("decay", "0.39 N"),
    "height": ("drop", "20 mm"),
}
"""Key -> the one mode it belongs to, an example."""


def wrong_release(mode: Mode, given: Mapping[str, float | None]) -> str | None:
    """Return what is wrong with `pull` and `height` beside a mode, or None."""
    for key, value in given.items():
        owner = _RELEASE_KEYS[key][0]
        if value is not None and mode != owner:
            return f"mode {mode} has no {key}, only mode {owner} has; remove it"
    return None


class _Condition(Section):
    """What every run of a step has in common, whatever its speed."""

    mode: Mode
    rest: Annotated[float, Quantity("time", low=0.5, high=60)] = 2.0
    """Still time before the motor starts or the robot is let go, in which the cameras see it."""
    ramp: Annotated[float, Quantity("time", low=0, high=60)] = 0.5
    """Time from the lowest voltage to the one asked for."""
    duration: Annotated[float, Quantity("time", above=0, high=3600)] = 10.0
    """Time from switching the output on to switching it off, or from the release to the end."""
    role: Role = "train"
    """Whether a later diagnosis may fit this run or only test on it."""
    repeats: Annotated[int, Field(ge=1, le=1000)] = 1
    pull: Annotated[float, Quantity("force", above=0)] | None = None
    """Force on T before the release, in mode decay."""
    height: Annotated[float, Quantity("length", above=0, high=1)] | None = None
    """Height of the fall, in mode drop."""

    def _require_release(self) -> None:
        """Refuse a release that the mode does not have or that is not told."""
        given = {"pull": self.pull, "height": self.height}
        wrong = wrong_release(self.mode, given)
        if wrong is not None:
            raise ValueError(wrong)
        for key, (owner, example) in _RELEASE_KEYS.items():
            if self.mode == owner and given[key] is None:
                raise ValueError(f"mode {owner} needs {key}, for example '{key}: {example}'")
        if self.mode not in DRIVEN and "ramp" in self.model_fields_set:
            raise ValueError(f"mode {self.mode} has no drive; remove ramp")


class Run(_Condition):
    """One condition."""

    speed: Speed | None = None
    """Rotor speed; the bench's calibration turns it into a voltage."""
    voltage: Volts | None = None

    @model_validator(mode="after")
    def _drive(self) -> Run:
        given = [name for name in ("speed", "voltage") if getattr(self, name) is not None]
        if self.mode in DRIVEN and len(given) != 1:
            raise ValueError(f"mode {self.mode} needs either speed or voltage, found {len(given)}")
        if self.mode not in DRIVEN and given:
            raise ValueError(f"mode {self.mode} has no drive; remove {given[0]}")
        self._require_release()
        return self


class Sweep(_Condition):
    """The same condition at several speeds or voltages."""

    speeds: Annotated[tuple[Speed, ...], Field(min_length=1)] | None = None
    voltages: Annotated[tuple[Volts, ...], Field(min_length=1)] | None = None
    order: Literal["as listed", "random"] = "as listed"
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the random order; the same seed gives the same order."""

    @model_validator(mode="after")
    def _drive(self) -> Sweep:
        if self.mode not in DRIVEN:
            raise ValueError(f"mode {self.mode} has no drive; use the step 'run' with repeats")
        if (self.speeds is None) == (self.voltages is None):
            raise ValueError("a sweep needs either speeds or voltages")
        self._require_release()
        return self


class Step(Section):
    """One step: exactly one of its keys."""

    prompt: str | None = None
    """Text for the operator, who confirms it before the next step."""
    run: Run | None = None
    sweep: Sweep | None = None

    @model_validator(mode="after")
    def _one(self) -> Step:
        given = [name for name in ("prompt", "run", "sweep") if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none"
            raise ValueError(f"a step is exactly one of prompt, run, sweep; found {found}")
        return self


class ProtocolLimits(Section):
    """Limits of this experiment, at most those of the bench."""

    voltage: Volts | None = None
    current: Annotated[float, Quantity("current", above=0)] | None = None


class Protocol(Section):
    """An experiment."""

    schema_: Annotated[Literal["workbench/protocol-1"], Field(alias="schema")]
    title: Annotated[str, Field(min_length=1, max_length=120)]
    model: str | None = None
    """Robot model, a name or a path; by default the bench's."""
    shape: str | None = None
    """Beam shape, a name or a path; by default the bench's."""
    limits: ProtocolLimits = ProtocolLimits()
    steps: Annotated[tuple[Step, ...], Field(min_length=1)]
