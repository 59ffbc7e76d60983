"""What client and guardian say to each other: JSON objects over a loopback socket, one a line.

    client                                  guardian
                                            {"token": "..."}
    {"id": 7, "call": "measure", "arguments": []}
                                            {"id": 7, "value": {...}}
                                            {"id": 7, "error": "HardwareError", "text": "..."}
    {"renew": 1}                            {"alive": 1}
                                            {"tripped": "why"}
                                            {"off": true}     when it was read back
                                            {"dead": true}    when the terminals were looked at
    {"goodbye": 1}                          (ends)

Every message of the client is a sign of progress.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from workbench.errors import HardwareError, InputError, SafetyStop, WorkbenchError
from workbench.hw.connection import Connection
from workbench.loopback import Message

__all__ = [
    "KEEP_TRYING_S",
    "NO_RECORDS",
    "Records",
    "SupplyBusyError",
    "Task",
    "error_of",
    "fault_of",
]

KEEP_TRYING_S = 90.0
"""How long a guardian tries to switch off [s], whether or not its client lives."""


class SupplyBusyError(HardwareError):
    """Another program drives the supply, or it cannot be held against one; nothing was set."""


_ERRORS: dict[str, type[WorkbenchError]] = {
    kind.__name__: kind for kind in (SupplyBusyError, HardwareError, InputError, SafetyStop)
}


@dataclass(frozen=True)
class Records:
    """Where a guardian writes.

    Args:
        wire: JSON line of each message on the wire; None keeps none.
        events: JSON line of each event of the guardian, on disk at once; None keeps none.
    """

    wire: Path | None = None
    events: Path | None = None


NO_RECORDS = Records()


@dataclass(frozen=True)
class Task:
    """What a guardian is started for.

    Args:
        connection: where the supply is.
        family: which driver to use.
        records: where to write.
        after: how the guardian before this one ended; this one is then to switch off, nothing
            else. Empty when there was none.
        identity: whom that one guarded: model, serial number and firmware.
        keep_trying_s: how long to try to switch off [s].
        force: switch off even what another program drives.
    """

    connection: Connection
    family: str
    records: Records
    after: str = ""
    identity: tuple[str, ...] = ()
    keep_trying_s: float = KEEP_TRYING_S
    force: bool = False

    def to_json(self) -> str:
        """Return it as one line."""
        return json.dumps(
            {
                "connection": vars(self.connection),
                "family": self.family,
                "records": {
                    name: str(path.resolve()) for name, path in vars(self.records).items() if path
                },
                "after": self.after,
                "identity": self.identity,
                "keep_trying_s": self.keep_trying_s,
                "force": self.force,
            }
        )

    @classmethod
    def from_json(cls, line: str) -> Task:
        """Return what `to_json` wrote."""
        found = json.loads(line)
        paths = {name: Path(path) for name, path in found["records"].items()}
        return cls(
            Connection(**found["connection"]),
            found["family"],
            Records(**paths),
            found["after"],
            tuple(found["identity"]),
            found["keep_trying_s"],
            found["force"],
        )


def fault_of(error: WorkbenchError) -> Message:
    """Return an error as a message's part."""
    kind = next((name for name, kind in _ERRORS.items() if isinstance(error, kind)), "SafetyStop")
    return {"error": kind, "text": str(error)}


def error_of(message: Message) -> WorkbenchError:
    """Return the error that a message carries."""
    return _ERRORS[message["error"]](message["text"])
