"""What is known of a supply's output: a fold over events in their order, the only one there is.

Record, catalogue, panel, latch and exit code all ask here, so that no verdict is older than the
deed. An output is `off` only after "off" was read back and its terminals were seen dead; whatever
may have switched it on later ends that. Who reads the events of processes that have ended, takes
`on` for unknown: nobody watches it any more.

    untouched --taken--> unknown --off, dead--> off --on--> on --off, dead--> off
                                                on --lost--> unknown --regained--> on

Events are JSON objects with a key `event`; those of a run's journal and those of a guardian's log
are both understood, and others change nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

__all__ = ["BY_HAND", "FOUND", "MAY_BE_ON", "OutputState", "State", "after", "fold"]

State = Literal["untouched", "not driven", "off", "on", "unknown"]
FOUND = "its state was not yet known when the record ended"
"""The cause before "off" was seen for the first time."""
MAY_BE_ON = "OUTPUT MAY BE ON"
BY_HAND = "switch it off by hand, at its front or with the emergency stop"


@dataclass(frozen=True)
class OutputState:
    """What is known of an output.

    Args:
        state: `untouched` where no program changed anything, `not driven` where a run has no
            drive, `off` when read back and seen dead, `on` while it is watched, `unknown` else.
        cause: the first thing since it was last known to be off that made it unknown.
        read_back: whether "off" was read back, its terminals not yet seen.
    """

    state: State = "untouched"
    cause: str = ""
    read_back: bool = False

    @property
    def live(self) -> bool:
        """Whether it may be on."""
        return self.state in ("on", "unknown")

    @property
    def verdict(self) -> str:
        """One word for a manifest: `confirmed` off, `unconfirmed`, or what was not done."""
        words = {"off": "confirmed", "untouched": "untouched", "not driven": "supply not opened"}
        return words.get(self.state, "unconfirmed")

    @property
    def description(self) -> str:
        """A sentence on an output that nobody watches any more."""
        match self.state:
            case "untouched":
                return "nothing was switched: its output is as it was before"
            case "not driven":
                return "this mode has no drive, the supply was not opened"
            case "off":
                return "the output is off, confirmed"
            case _:
                why = self.cause or "it was switched on, and off was not confirmed since"
                return f"{MAY_BE_ON} ({why}); {BY_HAND}"


def after(known: OutputState, event: Mapping[str, Any]) -> OutputState:
    """Return what is known after one more event."""
    match event:
        case {"event": "taken"} if not known.live:  # others may have switched it on since
            return OutputState("unknown", FOUND)
        case {"event": "output_on"}:
            return OutputState("on")
        case {"event": "off", "confirmed": True}:
            return replace(known, read_back=True)
        case {"event": "off", "confirmed": False}:
            why = f": {error}" if (error := event.get("error")) else ""
            return _unknown(known, f"off was sent and not read back{why}", read_back=False)
        case {"event": "terminals", "dead": True} if known.read_back:
            return OutputState("off")
        case {"event": "terminals", "dead": False}:
            why = event.get("error") or "it says off, but its terminals are live"
            return _unknown(known, why, read_back=False)
        case {"event": "lost", "cause": str(cause)} if known.live:
            return _unknown(known, cause, read_back=known.read_back)
        case {"event": "regained"} if known.state == "unknown" and known.cause != FOUND:
            return replace(known, state="on", cause="")
        case {"event": "trip", "reason": str(reason)} if known.live:
            return _unknown(known, reason, read_back=known.read_back)
        case {"event": "damaged", "cause": str(cause)}:
            return _unknown(known, cause, read_back=False)
        case {"event": "acknowledged"}:
            return OutputState()
        case {"event": "prepared"}:  # of a journal: it was seen off
            return OutputState("off")
        case {"event": "no_drive"}:
            return OutputState("not driven")
        case {"event": "output_off", "confirmed": bool(confirmed)}:
            return OutputState("off") if confirmed else _unknown(known, "", read_back=False)
        case _:
            return known


def fold(events: Iterable[Mapping[str, Any]]) -> OutputState:
    """Return what is known after events in their order."""
    known = OutputState()
    for event in events:
        known = after(known, event)
    return known


def _unknown(known: OutputState, cause: str, *, read_back: bool) -> OutputState:
    """Return that it may be on; the first cause since it was last known stays."""
    first = known.cause if known.state == "unknown" and known.cause != FOUND else ""
    return OutputState("unknown", first or cause or known.cause, read_back)
