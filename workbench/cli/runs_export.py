"""`workbench runs export`: runs for a colleague."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import runs_named
from workbench.catalogue import export
from workbench.cli.plain_output import JsonFlag, RunArguments, RunsFolder, emit, print_to_stderr

__all__ = ["export_runs"]

_MEGABYTE = 1e6


def export_runs(
    runs: RunArguments,
    to: Annotated[Path, typer.Option(metavar="FOLDER|FILE.zip", help="New folder or zip.")],
    csv: Annotated[bool, typer.Option("--csv", help="The traces as CSV, too.")] = False,
    mat: Annotated[bool, typer.Option("--mat", help="The traces for MATLAB, too.")] = False,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Pack runs with all that a colleague needs, and a README that says what each column is.

    Nothing is overwritten. The same runs give the same bytes. A link, or a name that would be
    another place on some system, is left out; then the exit code is 1.

    Example: workbench runs export 17 18 --to for-ada.zip --csv --mat
    """
    done = export(runs_named(runs, folder), to, csv, mat)
    for problem in done.problems:
        print_to_stderr(f"damaged: {problem}")
    for name in done.omitted:
        print_to_stderr(f"left out: {name}")
    if as_json:
        emit(
            {
                "target": str(done.target),
                "files": done.files,
                "bytes": done.size,
                "problems": done.problems,
                "left_out": done.omitted,
            }
        )
    else:
        print(f"{done.target}: {done.files} files, {done.size / _MEGABYTE:.1f} MB unpacked")
    if done.omitted:
        raise typer.Exit(1)
