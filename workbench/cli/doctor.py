"""`workbench doctor`: is this computer ready."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.completion import bench_names
from workbench.cli.console import progress, show_table
from workbench.cli.plain_output import JsonFlag, RunsFolder, emit
from workbench.doctor import Finding, examine

__all__ = ["doctor"]


def doctor(
    bench: Annotated[
        str | None,
        typer.Option(
            help="Bench file: its supply is asked for its model, and not switched.",
            autocompletion=bench_names,
        ),
    ] = None,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Check packages, viewer, ports and who may open them, disk and clocks; change nothing.

    Example: workbench doctor --bench lab.yaml
    """
    found = list(examine(folder, bench, progress))
    well = all(one.state != "failed" for one in found)
    if as_json:
        checks = {
            one.name: {
                "ok": one.state != "failed",
                "state": one.state,
                "found": one.found,
                "to_do": one.to_do,
            }
            for one in found
        }
        emit({"ok": well, "checks": checks})
    else:
        _show(found)
    if not well:
        raise typer.Exit(1)


def _show(found: Sequence[Finding]) -> None:
    marks = {"ok": "ok", "note": "note", "failed": "FAILED"}
    rows = [[one.name, marks[one.state], one.found] for one in found]
    show_table("This computer", ["", "", ""], rows)
    for one in found:
        if one.to_do:
            print(f"{one.name}: {one.to_do}")
