"""`workbench runs tag`, `note`, `good`, `bad`: people's remarks on a run."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Kind, add_remark, read_remarks, run_named
from workbench.cli.plain_output import RunArgument, RunsFolder, print_to_stderr
from workbench.errors import InputError
from workbench.run import VARIABLE, operator_name

__all__ = ["bad", "good", "note", "tag"]

Who = Annotated[
    str | None, typer.Option("--who", help="Your name.", envvar=VARIABLE, show_default="account")
]
Undo = Annotated[bool, typer.Option("--undo", help="Take the last verdict back instead.")]


def tag(
    run: RunArgument,
    tags: Annotated[list[str], typer.Argument(metavar="TAG...", help="Single words.")],
    remove: Annotated[bool, typer.Option("--remove", help="Take them away again.")] = False,
    who: Who = None,
    folder: RunsFolder = Path("runs"),
) -> None:
    """Give a run tags, by which it can be found again.

    Example: workbench runs tag 17 paper figure-4
    """
    wrong = [one for one in tags if one.split() != [one]]
    if wrong:
        raise InputError(f"tag {wrong[0]!r}: a tag is one word; `workbench runs note` takes text")
    _remark(run, folder, "untag" if remove else "tag", tags, who)


def note(
    run: RunArgument,
    text: Annotated[str, typer.Argument(help="What should be known of this run.")],
    who: Who = None,
    folder: RunsFolder = Path("runs"),
) -> None:
    """Write a note to a run; it stays with the bundle, with name and time.

    Example: workbench runs note 17 "the tape came loose after 6 s"
    """
    if not text.strip():
        raise InputError("the note is empty")
    _remark(run, folder, "note", [text], who)


def good(
    run: RunArgument, undo: Undo = False, who: Who = None, folder: RunsFolder = Path("runs")
) -> None:
    """Judge a run to be good.

    Example: workbench runs good 17
    """
    _remark(run, folder, "verdict", ["none" if undo else "good"], who)


def bad(
    run: RunArgument, undo: Undo = False, who: Who = None, folder: RunsFolder = Path("runs")
) -> None:
    """Judge a run to be bad; say why with `workbench runs note`.

    Example: workbench runs bad 17
    """
    _remark(run, folder, "verdict", ["none" if undo else "bad"], who)


def _remark(run: Path, root: Path, kind: Kind, texts: list[str], who: str | None) -> None:
    """Append remarks to a run and print its verdict, tags and number of notes."""
    folder = run_named(run, root)
    for text in texts:
        add_remark(folder, kind, text, who or operator_name(), datetime.now().astimezone())
    remarks = read_remarks(folder)
    tags = f", tags {' '.join(remarks.tags)}" if remarks.tags else ""
    notes = f"{len(remarks.notes)} note{'s' * (len(remarks.notes) != 1)}"
    print_to_stderr(f"{folder.name}: verdict {remarks.verdict}{tags}, {notes}")
