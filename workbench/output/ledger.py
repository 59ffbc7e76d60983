"""A supply's ledger: what happened to its output, in one file for all programs of this user.

It hangs on model and serial number, not on how an address or a folder is spelt; a supply that
reports no serial number is known by its address. Each line is on disk before what it says is done.
It only grows. A stop that nobody has signed for, a record that ends with the output on, and a
file that was emptied or damaged all refuse the next run.
"""

from __future__ import annotations

import json
import os
import re
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from workbench.errors import InputError
from workbench.output.state import BY_HAND, MAY_BE_ON, OutputState, after

__all__ = ["Latch", "Ledger", "ledgers", "state_folder"]

FOLDER = "WORKBENCH_STATE"
"""Environment variable with another folder for the ledgers."""
TAIL_BYTES = (
    1 << 18
)  # of a file that only grows; a stop that is not acknowledged keeps runs from adding more


@dataclass(frozen=True)
class Latch:
    """Why a supply may not be driven.

    Args:
        wall: local time, ISO 8601.
        reason: what happened.
        output: what is known of the output now.
        address: where the supply was.
    """

    wall: str
    reason: str
    output: OutputState
    address: str = ""

    @property
    def description(self) -> str:
        """What happened, and what is known of the output now."""
        since = f" since {self.wall}" if self.wall else ""
        now = f"{MAY_BE_ON}, {BY_HAND}" if self.output.live else self.output.description
        return f"latched{since}: {self.reason}; {now}"


def state_folder() -> Path:
    """Return the folder of all ledgers: `WORKBENCH_STATE`, or the system's place for states."""
    if folder := os.environ.get(FOLDER):
        return Path(folder)
    from platformdirs import user_state_path  # most commands only look whether there is one

    return user_state_path("workbench", appauthor=False)


def ledgers() -> list[Ledger]:
    """Return the ledgers of all supplies that were ever driven here."""
    with suppress(OSError):
        return [Ledger(path.stem) for path in sorted(state_folder().glob("*.jsonl"))]
    return []


class Ledger:
    """One supply's ledger.

    Args:
        key: from `key_of`.
    """

    def __init__(self, key: str) -> None:
        self.key = key
        self.path = state_folder() / f"{key}.jsonl"

    @staticmethod
    def key_of(model: str, serial: str | None, address: str) -> str:
        """Return the name of a supply's ledger.

        Args:
            model: as the supply says.
            serial: as the supply says; None when it reports none.
            address: resolved address, for a supply that reports none.
        """
        return re.sub(r"[^A-Za-z0-9.-]+", "_", f"{model}_{serial or address}").strip("_.")

    def write(self, event: str, **facts: object) -> None:
        """Append one event, on disk before this returns.

        Raises:
            OSError: when it cannot be written.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        line = _line(event, facts)
        if self.path.exists() and not self.path.stat().st_size:  # what follows must not hide it
            line = _line("damaged", {"cause": self._emptied}) + line
        with self.path.open("ab+") as file:
            file.seek(-1 if file.tell() else 0, os.SEEK_END)
            cut = file.read(1) not in (b"", b"\n")  # by a crash; the next line begins anew
            file.write(b"\n" * cut + line)
            file.flush()
            os.fsync(file.fileno())

    def events(self) -> Iterator[dict[str, Any]]:
        """Yield the last events; a line that cannot be read is one that damages."""
        try:
            start, text = self._tail()
        except FileNotFoundError:
            return
        except OSError as error:
            yield _damage(f"{self.path} cannot be read ({error.strerror})")
            return
        lines = text.decode("utf-8", errors="replace").split("\n")  # no other end is a line's
        if not lines[-1]:
            lines.pop()
        if not lines:
            yield _damage(self._emptied)
        for line in lines[1 if start else 0 :]:
            yield _event(line) or _damage(f"a line of {self.path} cannot be read")

    def _tail(self) -> tuple[int, bytes]:
        """Return the end of the file and where it begins; a pipe or a device is not waited for."""
        handle = os.open(self.path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
        with open(handle, "rb") as file:
            about = os.fstat(handle)
            if not stat.S_ISREG(about.st_mode):
                raise OSError(0, "it is no file")
            start = max(about.st_size - TAIL_BYTES, 0)
            file.seek(start)
            return start, file.read(2 * TAIL_BYTES)

    @property
    def _emptied(self) -> str:
        return f"{self.path} was emptied"

    @property
    def address(self) -> str:
        """Where the supply was last, as its address resolved."""
        addresses = [event["place"] for event in self.events() if "place" in event]
        return addresses[-1] if addresses else ""

    def latch(self) -> Latch | None:
        """Return why nothing may be driven, or None.

        A record that ends with the output on counts only when no guardian holds the supply. One
        that cannot be read counts as one that is damaged.
        """
        known, stop, address, wall = OutputState(), None, "", ""
        for event in self.events():
            address, wall = event.get("place", address), event.get("wall", wall)
            match event:
                case {"event": "trip", "reason": str(reason)}:
                    stop = stop or Latch(wall, reason, known)  # the first cause stays
                case {"event": "damaged", "cause": str(cause)}:
                    stop = stop or Latch("", cause, known)
                case {"event": "taken"} if known.live:
                    stop = stop or Latch(wall, _ended(known), known)
                case {"event": "acknowledged"}:
                    stop = None
            known = after(known, event)
        if stop is None and known.live and not self.held():
            stop = Latch(wall, _ended(known), known)
        return stop and Latch(stop.wall, stop.reason, known, address)

    def knows_scale(self, firmware: str) -> bool:
        """Return whether the supply's scale was checked lately, with the firmware that it has."""
        return any(
            event["event"] == "scale" and event.get("firmware") == firmware
            for event in self.events()
        )

    def acknowledge(self, name: str) -> Latch:
        """Acknowledge the latch, so that the supply may be driven again; return what it was.

        Raises:
            InputError: when the name is empty, or nothing is to be acknowledged.
        """
        if not name.strip():
            raise InputError("an acknowledgement needs the name of a person: --name NAME")
        latch = self.latch()
        if latch is None:
            raise InputError(f"{self.path}: no stop is waiting for an acknowledgement")
        self.write("acknowledged", name=name.strip())
        return latch

    @contextmanager
    def hold(self, seconds: float = 0.0) -> Iterator[bool]:
        """Hold the supply against every other program; yield whether it is held by this one.

        The system releases it when the process ends, however it ends.

        Args:
            seconds: to wait for another program to let go.
        """
        from filelock import FileLock, Timeout

        self.path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(self.path.with_suffix(".lock"))
        try:
            lock.acquire(timeout=seconds, poll_interval=0.02)
        except Timeout:
            yield False
            return
        try:
            yield True
        finally:
            lock.release()

    def held(self) -> bool:
        """Return whether a program holds the supply now."""
        if not self.path.with_suffix(".lock").exists():
            return False
        try:
            with self.hold() as free:
                return not free
        except OSError:  # nobody holds what nobody can lock
            return False

    def ask_for_off(self) -> None:
        """Ask whoever holds the supply to switch it off."""
        with suppress(OSError):  # "off" is sent in any case
            self._asked.touch()

    def asked_for_off(self) -> bool:
        """Return whether somebody asked for it since, and take the request away."""
        if not self._asked.exists():
            return False
        with suppress(OSError):
            self._asked.unlink()
        return True

    @property
    def _asked(self) -> Path:
        return self.path.with_suffix(".off")


def _ended(known: OutputState) -> str:
    why = f" ({known.cause})" if known.cause else ""
    return f"its program and its guardian ended before off was confirmed{why}"


def _event(line: str) -> dict[str, Any] | None:
    try:
        event = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return event if isinstance(event, dict) and isinstance(event.get("event"), str) else None


def _line(event: str, facts: Mapping[str, object]) -> bytes:
    line = json.dumps({"wall": _now(), "event": event, **facts}, ensure_ascii=False, default=str)
    return line.encode() + b"\n"


def _damage(cause: str) -> dict[str, Any]:
    return {"event": "damaged", "cause": cause}


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")
