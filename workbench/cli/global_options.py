"""The options of the whole command line; each may be given before the verb or after it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

__all__ = ["NoColorFlag", "QuietFlag", "VersionFlag", "apply_options", "options_first"]

_ANYWHERE = ("--quiet", "--no-color")
_END = "--"  # only values follow it


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


def options_first(words: Sequence[str]) -> list[str]:
    """Return the words of a command line with the options of all verbs before the verb."""
    end = words.index(_END) if _END in words else len(words)
    ours = [word for word in words[:end] if word in _ANYWHERE]
    return [*ours, *(word for word in words[:end] if word not in _ANYWHERE), *words[end:]]


def apply_options(quiet: bool, no_color: bool) -> None:
    """Set up the consoles that the verbs print with; load them only if an option was given."""
    if not (quiet or no_color or "workbench.cli.console" in sys.modules):
        return
    from workbench.cli.console import progress, stderr  # imports rich

    progress.quiet = quiet
    if no_color:
        os.environ["NO_COLOR"] = "1"  # for the consoles of tables and errors, made later
    stderr.no_color = progress.console.no_color = no_color or bool(os.environ.get("NO_COLOR"))
