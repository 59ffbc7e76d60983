"""What verbs share that needs no terminal library: options, the JSON object, lines of columns.

A verb that prints with these alone answers while the others still load.
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

__all__ = [
    "RUNS_MEANT",
    "JsonFlag",
    "RunArgument",
    "RunArguments",
    "RunsFolder",
    "SchedulerOption",
    "SearchesFolder",
    "emit",
    "print_columns",
    "remark_on",
]

JsonFlag = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
RunsFolder = Annotated[
    Path, typer.Option("--runs", help="Folder of all bundles.", envvar="WORKBENCH_RUNS")
]

SchedulerOption = Annotated[
    str | None,
    typer.Option(help="Of a cluster, tcp://host:8786; by default all cores of this machine."),
]
SearchesFolder = Annotated[
    Path, typer.Option("--searches", help="Folder of all searches.", envvar="WORKBENCH_SEARCHES")
]


def _run_names(incomplete: str) -> list[str]:
    """Return what the Tab key offers, loaded only when it is pressed."""
    from workbench.cli.completing import run_names

    return run_names(incomplete)


RunArgument = Annotated[
    Path,
    typer.Argument(
        metavar="RUN",
        help="A run: its number, name, a part of the name, or path.",
        autocompletion=_run_names,
    ),
]
RUNS_MEANT = typer.Argument(
    metavar="RUNS...",
    help="Runs: numbers, names, parts of them, paths, folders of runs, protocols, experiments.",
    autocompletion=_run_names,
)
RunArguments = Annotated[list[Path], RUNS_MEANT]

_GAP = "  "


def emit(result: Mapping[str, Any]) -> None:
    """Print the one JSON object; what is no number becomes null."""
    print(json.dumps(_finite(result), indent=2, ensure_ascii=False, default=str))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not (abs(value) < float("inf")):
        return None
    return value


def print_columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a line a row on stdout, for the eye and for other programs.

    Columns whose name is `#` or ends in a unit hold numbers. On a terminal the last column is cut
    at its edge.

    Args:
        head: names of the columns.
        rows: cells as text.
    """
    lines = [head, *rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    right = [name == "#" or name.endswith("]") for name in head]
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    for line in lines:
        cells = [
            cell.rjust(size) if number else cell.ljust(size)
            for cell, size, number in zip(line, widths, right, strict=True)
        ]
        print(_GAP.join(cells).rstrip()[:width])


def remark_on(text: str) -> None:
    """Tell a person something beside the result."""
    print(text, file=sys.stderr)
