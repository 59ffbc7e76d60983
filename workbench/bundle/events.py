"""The events of a run's journal, typed: one class an event, and the way from and to a line.

A line that is none of these, or has a fact missing, is an `Other`: newer versions and damaged disks
write those, and a reader shows them as they are. What an event says of the supply's output is
decided in `workbench.output`, which reads the same lines.
"""

from __future__ import annotations

import json
from datetime import datetime
from decimal import Decimal
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from workbench.bundle.manifest import SupplyIdentity

__all__ = [
    "CamerasStarted",
    "Complete",
    "Event",
    "LiveTwinState",
    "Logged",
    "NoDrive",
    "Other",
    "OutputOff",
    "OutputOn",
    "PromptAnswered",
    "RunAsked",
    "Scale",
    "Stopped",
    "SupplyPrepared",
    "SupplyReading",
    "TakeAccepted",
    "TakeAdded",
    "TakeForced",
    "TakeRefused",
    "TakeWanted",
    "Voltage",
    "parse_line",
]

Volts = str | float | Decimal
"""As the supply took it; written as text, so that no digit is lost."""


class _Event(BaseModel):
    """Something that happened in a run; what a newer version has written beside it is kept."""

    model_config = ConfigDict(frozen=True, extra="allow")

    def as_json(self) -> dict[str, Any]:
        """Return the line: the event's name and the facts that were given."""
        given = self.model_fields_set | {"event"}
        return {key: v for key, v in self.model_dump(mode="json").items() if key in given}


class RunAsked(_Event):
    """What the run shall do."""

    event: Literal["asked"] = "asked"
    run: str
    rest_s: float | None = None
    steps: tuple[tuple[float, Volts], ...] = ()
    """(time after the output goes on [s], voltage [V])."""
    operator: str | None = None
    """Who started it. None in bundles of before."""
    where: Literal["terminal", "panel"] | None = None


class NoDrive(_Event):
    """The mode has no drive; the supply is not opened."""

    event: Literal["no_drive"] = "no_drive"


class PromptAnswered(_Event):
    """The operator was asked."""

    event: Literal["prompt"] = "prompt"
    text: str
    answer: str | int | float | None
    """`confirmed`, or what was typed; None where nobody did."""
    where: Literal["terminal", "panel", "nobody"] = "terminal"
    name: str | None = None
    """Of the value that was typed."""
    asked_s: float | None = None


class SupplyPrepared(_Event):
    """The supply's limits are set; its output was seen off."""

    event: Literal["prepared"] = "prepared"
    identity: SupplyIdentity
    found: dict[str, Any] = {}


class Scale(_Event):
    """The supply's scale was checked."""

    event: Literal["scale"] = "scale"
    set_voltage_V: float
    voltage_V: float


class CamerasStarted(_Event):
    """The cameras record; the run's time begins anew."""

    event: Literal["cameras"] = "cameras"
    began: datetime | None = None


class OutputOn(_Event):
    """The output is about to be switched on."""

    event: Literal["output_on"] = "output_on"
    volts: Volts


class Voltage(_Event):
    """Another voltage was set and read back."""

    event: Literal["voltage"] = "voltage"
    asked: Volts
    read_back: Volts


class SupplyReading(_Event):
    """What the supply measured."""

    event: Literal["reading"] = "reading"
    set_voltage_V: float
    voltage_V: float
    current_A: float
    output: bool = True


class OutputOff(_Event):
    """The output was switched off; confirmed when that was read back and the terminals are dead."""

    event: Literal["output_off"] = "output_off"
    confirmed: bool


class LiveTwinState(_Event):
    """How the observer on the stream went."""

    event: Literal["live_twin"] = "live_twin"
    samples: int = 0
    skipped: int = 0
    """Left out, as it was behind."""
    lost: int = 0
    """Frames that did not arrive."""
    latency_ms: tuple[float, float, float] | None = None
    """Median, 99th percentile and greatest, from a frame's arrival to its state."""
    cpu_ms: float | None = None
    """Processor time of a sample."""
    error_mm: tuple[float, float] | None = None
    """Prediction error: root mean square and greatest."""
    gone: str = ""
    """Why it ended before the run did."""


class TakeWanted(_Event):
    """The export is waited for."""

    event: Literal["take_wanted"] = "take_wanted"
    folder: str | None = None


class TakeAccepted(_Event):
    """An export belongs to the run."""

    event: Literal["take_accepted"] = "take_accepted"
    file: str
    notes: tuple[str, ...] = ()


class TakeRefused(_Event):
    """An export does not belong to the run."""

    event: Literal["take_refused"] = "take_refused"
    file: str
    reasons: tuple[str, ...] = ()


class TakeForced(_Event):
    """An export that seems not to belong was taken because the operator insists."""

    event: Literal["take_forced"] = "take_forced"
    file: str


class TakeAdded(_Event):
    """An export was added after the run."""

    event: Literal["take_added"] = "take_added"
    file: str
    notes: tuple[str, ...] = ()


class Complete(_Event):
    """The run was measured to its end."""

    event: Literal["complete"] = "complete"


class Stopped(_Event):
    """The run ended before it was complete."""

    event: Literal["failed", "interrupted", "safety-stop"]
    reason: str = ""


class Other(_Event):
    """A line that this version does not know; its facts are kept."""

    event: str


KnownEvent = (
    RunAsked | NoDrive | PromptAnswered | SupplyPrepared | Scale | CamerasStarted
    | OutputOn | Voltage | SupplyReading | OutputOff | LiveTwinState | TakeWanted
    | TakeAccepted | TakeRefused | TakeForced | TakeAdded | Complete
    | Stopped
)  # fmt: skip
Event = KnownEvent | Other


class Logged(NamedTuple):
    """A line of the journal: an event and its time after the run's beginning [s]."""

    time_s: float
    event: Event


@cache
def _known() -> TypeAdapter[KnownEvent]:
    return TypeAdapter(Annotated[KnownEvent, Field(discriminator="event")])


def parse_line(line: str | bytes) -> Logged | None:
    """Return the event of a line; None where it is damaged, or has no name or no time."""
    try:
        facts = json.loads(line)
    except (ValueError, RecursionError):
        return None
    if not isinstance(facts, dict):
        return None
    time_s, name = facts.pop("time_s", None), facts.get("event")
    if not isinstance(name, str) or not isinstance(time_s, int | float):
        return None
    try:
        return Logged(float(time_s), _known().validate_python(facts))
    except ValidationError:
        return Logged(float(time_s), Other.model_validate(facts))
