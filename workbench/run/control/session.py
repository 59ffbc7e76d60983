"""The session file of a live experiment: who carries it out, and the address of its server.

It is a file beside the folder of runs, readable by its owner alone. The process that carries
out the experiment holds a lock on it, which the system releases when that process dies, however it
dies. So two processes never carry out one experiment, and no process number has to be trusted.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.errors import InputError, RecordError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

__all__ = ["SessionFile", "claim", "folder_of", "holder", "session_files"]

_FAR = 1 << 30  # Windows locks bytes against reading too: one that no such file reaches
_OWNER_ONLY = 0o600


@dataclass(frozen=True)
class SessionFile:
    """What a live experiment says of itself.

    Args:
        path: of the file.
        facts: `pid`, `experiment`, and whatever its owner wrote.
    """

    path: Path
    facts: Mapping[str, Any]

    @property
    def pid(self) -> int:
        """Number of the process that carries it out."""
        return int(self.facts.get("pid", 0))

    @property
    def experiment(self) -> str:
        """Name of the experiment."""
        return self.path.stem


def folder_of(runs: Path) -> Path:
    """Return where the session files of a folder of runs are: beside it, which holds runs alone."""
    runs = runs.resolve()
    return runs.with_name(f"{runs.name}.live")


def session_files(runs: Path) -> list[SessionFile]:
    """Return the session files of a folder of runs, newest last; some may be of dead processes."""
    found: list[tuple[int, SessionFile]] = []
    for path in folder_of(runs).glob("*.json"):
        with suppress(OSError, ValueError):  # removed, or not yet written
            facts = json.loads(path.read_text(encoding="utf-8"))
            found.append((path.stat().st_mtime_ns, SessionFile(path, facts)))
    return [session for _, session in sorted(found, key=lambda pair: pair[0])]


def holder(runs: Path, experiment: str) -> SessionFile | None:
    """Return the session file of whoever carries out an experiment; None when nobody does.

    One of another user cannot be read; it counts as held, without facts.
    """
    path = _path(runs, experiment)
    try:
        file = os.open(path, os.O_RDWR)
    except FileNotFoundError:
        return None
    except PermissionError:
        return SessionFile(path, {})
    try:
        if _lock(file):
            return None
        return next(
            (session for session in session_files(runs) if session.path == path),
            SessionFile(path, {}),
        )
    finally:
        os.close(file)


@contextmanager
def claim(runs: Path, experiment: str, facts: Mapping[str, Any]) -> Iterator[SessionFile]:
    """Hold an experiment until the block ends; its session file is there as long.

    Session files of processes that died are removed.

    Args:
        runs: folder of all bundles.
        experiment: name of the experiment.
        facts: for the session file; what JSON can say.

    Raises:
        InputError: when another process carries it out.
        RecordError: when the session file cannot be written.
    """
    path = _path(runs, experiment)
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        file = _locked(path)
    except OSError as error:
        raise RecordError(
            f"{path}: cannot be written and locked ({error.strerror}); choose another folder with "
            "--runs"
        ) from error
    if file is None:
        held = holder(runs, experiment)
        who = "another process" if held is None else f"process {held.pid}"
        raise InputError(f"experiment {experiment}: {who} carries it out; see {path}")
    try:
        _sweep(path)
        session = SessionFile(path, {"pid": os.getpid(), "experiment": experiment, **facts})
        os.ftruncate(file, 0)
        os.write(file, json.dumps(session.facts, default=str).encode())
        yield session
    finally:
        _remove(path, file)


def _path(runs: Path, experiment: str) -> Path:
    return folder_of(runs) / f"{experiment}.json"


def _locked(path: Path) -> int | None:
    """Open and lock a session file that is still in its folder; None when somebody else has."""
    while True:
        file = os.open(path, os.O_RDWR | os.O_CREAT, _OWNER_ONLY)
        if not _lock(file):
            os.close(file)
            return None
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file), path.stat()):
                return file
        os.close(file)  # its last holder removed it between open and lock


def _lock(file: int) -> bool:
    """Try to lock an open file; the lock ends when the file is closed or the process dies."""
    try:
        if sys.platform == "win32":
            os.lseek(file, _FAR, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
            os.lseek(file, 0, os.SEEK_SET)
        else:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):  # the second is what Windows says
        return False
    return True


def _sweep(mine: Path) -> None:
    """Remove the session files of processes that died."""
    for path in mine.parent.glob("*.json"):
        if path == mine:
            continue
        file = _locked(path)
        if file is not None:
            _remove(path, file)


def _remove(path: Path, file: int) -> None:
    """Remove a session file that is held, then unlock it."""
    if sys.platform == "win32":  # an open file cannot be removed there
        os.close(file)
        path.unlink(missing_ok=True)
    else:
        path.unlink(missing_ok=True)
        os.close(file)
