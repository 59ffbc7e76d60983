"""The folder where the tracking software's exports appear."""

from __future__ import annotations

import stat
from pathlib import Path
from typing import NamedTuple

from workbench.errors import HardwareError
from workbench.hw import Clock

__all__ = ["TakeFolder"]

_SETTLED_S = 1.0
_SUFFIXES = frozenset({".csv", ".c3d"})
_CHUNK_BYTES = 1 << 20


class _State(NamedTuple):
    """What changes when somebody writes to a file."""

    size: int
    changed_ns: int


class _Pending(NamedTuple):
    """A state and since when it was seen [s]."""

    state: _State
    since: float


class TakeFolder:
    """Returns each export that appears or changes, once it is finished.

    Finished: size and time of change were constant for one second, and the file can be read to
    its end. The folder is polled, which works on every system and on network drives. What lies in
    it from the beginning is left alone until it changes; clocks of file servers do not matter.

    Args:
        path: the folder.
        clock: the waiting is timed with it.

    Raises:
        HardwareError: when the folder cannot be listed.
    """

    def __init__(self, path: Path, clock: Clock) -> None:
        self.path, self._clock = path, clock
        self._seen_states = self._states()
        self._pending: dict[Path, _Pending] = {}

    def finished(self) -> list[Path]:
        """Return the exports that are finished now and were not returned in this state before.

        Raises:
            HardwareError: when the folder cannot be listed now.
        """
        now, found = self._clock.now(), self._states()
        fresh = {
            file: state for file, state in found.items() if self._seen_states.get(file) != state
        }
        ready = [file for file, state in fresh.items() if self._has_settled(file, state, now)]
        self._pending = {
            file: self._pending_since(file, state, now)
            for file, state in fresh.items()
            if file not in ready
        }
        self._seen_states.update((file, fresh[file]) for file in ready)
        return sorted(ready)

    def _has_settled(self, file: Path, state: _State, now: float) -> bool:
        before = self._pending_since(file, state, now)
        return now - before.since >= _SETTLED_S and _readable_to_its_end(file, state.size)

    def _pending_since(self, file: Path, state: _State, now: float) -> _Pending:
        before = self._pending.get(file)
        return before if before is not None and before.state == state else _Pending(state, now)

    def _states(self) -> dict[Path, _State]:
        try:
            files = list(self.path.iterdir())
        except OSError as error:
            raise HardwareError(
                f"{self.path}: the folder of exports cannot be listed ({error.strerror}); does it "
                "exist, is the share connected? See tracking.takes in the bench file"
            ) from error
        states = ((file, _state(file)) for file in files)
        return {file: state for file, state in states if state is not None and state.size}


def _state(file: Path) -> _State | None:
    """Return the state of an export, None for anything else.

    Asked of the file itself: what a directory says of an open file is old on Windows.
    """
    if file.suffix.casefold() not in _SUFFIXES or file.name.startswith((".", "~")):
        return None
    try:
        found = file.stat()
    except OSError:  # renamed or deleted since it was listed
        return None
    return _State(found.st_size, found.st_mtime_ns) if stat.S_ISREG(found.st_mode) else None


def _readable_to_its_end(file: Path, size: int) -> bool:
    """Return whether all bytes are there; a file that another program locks cannot be opened."""
    try:
        with file.open("rb") as content:
            read = 0
            while chunk := content.read(_CHUNK_BYTES):
                read += len(chunk)
    except OSError:
        return False
    return read == size
