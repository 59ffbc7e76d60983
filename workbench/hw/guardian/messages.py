"""What client and guardian say to each other: JSON objects over a loopback socket, one a line.

    client                                  guardian
                                            {"token": "..."}
    {"id": 7, "call": "measure", "arguments": []}
                                            {"id": 7, "value": {...}}
                                            {"id": 7, "error": "HardwareError", "text": "..."}
    {"renew": 1}                            {"alive": 1}
                                            {"tripped": "why", "confirmed": true}
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

__all__ = ["NO_RECORDS", "Records", "Task", "error_of", "fault_of"]

_ERRORS: dict[str, type[WorkbenchError]] = {
    kind.__name__: kind for kind in (HardwareError, InputError, SafetyStop)
}


@dataclass(frozen=True)
class Records:
    """Where a guardian writes.

    Args:
        wire: JSON line of each message on the wire; None keeps none.
        events: JSON line of each event of the guardian, on disk at once; None keeps none.
        latch: the supply's latch; None sets none.
    """

    wire: Path | None = None
    events: Path | None = None
    latch: Path | None = None


NO_RECORDS = Records()


@dataclass(frozen=True)
class Task:
    """What a guardian is started for.

    Args:
        connection: where the supply is.
        family: which driver to use.
        records: where to write.
        patience_s: how long to try to open the port, which its last owner may still hold [s].
        after: how the guardian before this one ended; empty when there was none.
    """

    connection: Connection
    family: str
    records: Records
    patience_s: float = 0.0
    after: str = ""

    def to_json(self) -> str:
        """Return it as one line."""
        return json.dumps(
            {
                "connection": vars(self.connection),
                "family": self.family,
                "records": {
                    name: str(path.resolve()) for name, path in vars(self.records).items() if path
                },
                "patience_s": self.patience_s,
                "after": self.after,
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
            found["patience_s"],
            found["after"],
        )


def fault_of(error: WorkbenchError) -> Message:
    """Return an error as a message's part."""
    kind = next((name for name, kind in _ERRORS.items() if isinstance(error, kind)), "SafetyStop")
    return {"error": kind, "text": str(error)}


def error_of(message: Message) -> WorkbenchError:
    """Return the error that a message carries."""
    return _ERRORS[message["error"]](message["text"])
