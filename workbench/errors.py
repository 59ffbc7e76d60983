"""The error tree and the exit codes.

    WorkbenchError           1  a run or a verdict failed
    ├── InputError           2  a file or an argument is not acceptable
    │   ├── FileFaults       2  every fault of one YAML file, with line and column
    │   └── TakeError        2  an export that cannot be read
    ├── RecordError          1  what happens cannot be written down
    ├── DataFault            1  runs are not what they are said to be, and too few others are left
    ├── PrintRefused         1  a printed template is not at 1:1
    ├── ControllerGone       1  the process that carries out a run is dead or does not answer
    ├── HardwareError        3  a device cannot be reached or does not answer rightly
    ├── SafetyStop           4  a limit or a protection ended the run
    └── Interrupted        130  the user stopped it, the output is off

Every message says who, what was found with its unit, what is allowed and where.
"""

from __future__ import annotations

import difflib
import errno
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

__all__ = [
    "ControllerGone",
    "DataFault",
    "FileFault",
    "FileFaults",
    "HardwareError",
    "InputError",
    "Interrupted",
    "PrintRefused",
    "RecordError",
    "SafetyStop",
    "TakeError",
    "WorkbenchError",
    "did_you_mean",
    "require_named",
    "what_to_do",
]

_WIDTH = 160  # characters of a line that a fault shows
_MOST = 40  # faults of a file in one message
_TO_DO = {
    errno.ENOENT: "see that the name is right; it counts from the folder of the command",
    errno.EEXIST: "something of this name is there already; name another",
    errno.EISDIR: "it is a folder; name a file in it",
    errno.ENOTDIR: "a file is where a folder is needed; name another folder",
    errno.EACCES: "this user may not; have its rights changed, or name another place",
    errno.EPERM: "this user may not; have its rights changed, or name another place",
    errno.EROFS: "nothing can be written there; name another place",
    errno.ENOSPC: "the disk is full; make room, or name a folder on another one",
    errno.EDQUOT: "this user's share of the disk is full; make room, or name another place",
}


def did_you_mean(word: str, known: Iterable[str], likeness: float = 0.6) -> str:
    """Return the tail of a message that names the known word most like the one given, or nothing.

    Args:
        word: what was written.
        known: the words that exist.
        likeness: least ratio of `difflib` for a guess; case does not count.
    """
    folded = {name.casefold(): name for name in known}
    close = difflib.get_close_matches(word.casefold(), list(folded), n=1, cutoff=likeness)
    return f"; did you mean {folded[close[0]]!r}?" if close else ""


def what_to_do(error: OSError) -> str:
    """Return what the system says of a file in words, with what helps where that is known."""
    said = error.strerror or type(error).__name__
    return f"{said}; {_TO_DO[error.errno]}" if error.errno in _TO_DO else said


class WorkbenchError(Exception):
    """Root of all errors that the workbench raises on purpose; exit code 1."""

    exit_code = 1


class InputError(WorkbenchError):
    """A file or an argument is not acceptable; nothing was started."""

    exit_code = 2


def require_named(kind: str, name: str, known: Iterable[str]) -> None:
    """Refuse a name that does not exist.

    Args:
        kind: of what is named, in a word.
        name: what was given.
        known: the names that exist.

    Raises:
        InputError: with the nearest of the names, and all.
    """
    names = [str(one) for one in known]
    if name not in names:
        near = did_you_mean(str(name), names)
        raise InputError(f"no {kind} named {name!r}{near}; there are {', '.join(names)}")


@dataclass(frozen=True)
class FileFault:
    """One fault of a file.

    Args:
        file: the file's name as the user gave it.
        line: line, from 1.
        column: column, from 1.
        text: what is wrong, what is allowed, what was perhaps meant.
        source: the line itself, shown with a caret under the column.
    """

    file: str
    line: int
    column: int
    text: str
    source: str = ""

    def __str__(self) -> str:
        """Show the fault as compilers do: place, text, line and caret."""
        head = f"{self.file}:{self.line}:{self.column}: {self.text}"
        if not self.source.strip():
            return head
        first = max(self.column - 1 - _WIDTH // 2, 0) if len(self.source) > _WIDTH else 0
        caret = " " * (self.column - 1 - first) + "^"
        return f"{head}\n    {self.source[first : first + _WIDTH]}\n    {caret}"


class FileFaults(InputError):
    """All faults of one file at once, in the order of the lines."""

    def __init__(self, faults: Sequence[FileFault]) -> None:
        self.faults = tuple(sorted(faults, key=lambda f: (f.line, f.column)))
        texts = [str(fault) for fault in self.faults[:_MOST]]
        if len(self.faults) > _MOST:
            texts.append(f"{len(self.faults) - _MOST} or more further faults; mend these first")
        super().__init__("\n".join(texts))


class TakeError(InputError):
    """An export cannot be read; the message names file, line and cause."""


class DataFault(WorkbenchError):
    """Runs are not what they are said to be, and too few others are left to judge by.

    Args:
        message: in a sentence.
        evidence: (run, what shows it) of each fault.
    """

    def __init__(self, message: str, evidence: Sequence[tuple[str, str]]) -> None:
        self.evidence = tuple(evidence)
        super().__init__(message)


class RecordError(WorkbenchError):
    """What happens cannot be written down, so nothing more is done; the output is switched off."""


class PrintRefused(WorkbenchError):
    """A printed template is not at 1:1, and by more than a printer's own error."""


class ControllerGone(WorkbenchError):
    """The process that carries out a run cannot be asked for anything: it is dead, or hangs."""


class HardwareError(WorkbenchError):
    """A device cannot be reached, is another one, or answers wrongly."""

    exit_code = 3


class SafetyStop(WorkbenchError):
    """A limit or a protection ended the run; the output is off unless the text says otherwise."""

    exit_code = 4


class Interrupted(WorkbenchError):
    """The user stopped the run; raised after the output was switched off."""

    exit_code = 130
