"""The options of the whole command line; each may stand before the verb or after it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

__all__ = ["NoColorFlag", "QuietFlag", "VersionFlag", "moved_to_front", "obey"]

_MOVED = ("--quiet", "--no-color")
_END = "--"  # what follows it are values, whatever they look like


def _version(asked: bool) -> None:
    if asked:
        from workbench.versions import workbench_version

        print(f"workbench {workbench_version()}")
        raise typer.Exit


VersionFlag = Annotated[
    bool,
    typer.Option("--version", callback=_version, is_eager=True, help="Print the version and end."),
]
QuietFlag = Annotated[
    bool, typer.Option("--quiet", help="No progress; results, questions and errors stay.")
]
NoColorFlag = Annotated[
    bool, typer.Option("--no-color", help="No colours, as with NO_COLOR or TERM=dumb.")
]


def moved_to_front(words: Sequence[str]) -> list[str]:
    """Return the words of a command line with the options of all verbs before the verb."""
    end = words.index(_END) if _END in words else len(words)
    moved = [word for word in words[:end] if word in _MOVED]
    return [*moved, *(word for word in words[:end] if word not in _MOVED), *words[end:]]


def obey(quiet: bool, no_color: bool) -> None:
    """Set what the verbs print with; where nothing was asked, what prints is not yet loaded."""
    if not (quiet or no_color or "workbench.cli.output" in sys.modules):
        return
    from workbench.cli.output import people, tell  # and rich with it: not for a list of runs

    tell.quiet = quiet
    if no_color:
        os.environ["NO_COLOR"] = "1"  # of tables and errors, whose consoles are made later
    people.no_color = tell.console.no_color = no_color or bool(os.environ.get("NO_COLOR"))
