"""Shared options, the JSON object and lines of columns without rich, whose import takes time."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

__all__ = [
    "RUNS_ARGUMENT",
    "JsonFlag",
    "RunArgument",
    "RunArguments",
    "RunsFolder",
    "SchedulerOption",
    "SearchesFolder",
    "emit",
    "print_columns",
    "print_to_stderr",
    "width",
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
    """Return what the Tab key offers; imported only then."""
    from workbench.cli.completion import run_names

    return run_names(incomplete)


RunArgument = Annotated[
    Path,
    typer.Argument(
        metavar="RUN",
        help="A run: its number, name, a part of the name, or path.",
        autocompletion=_run_names,
    ),
]
RUNS_ARGUMENT = typer.Argument(
    metavar="RUNS...",
    help="Runs: numbers, names, parts of them, paths, folders of runs, protocols, experiments.",
    autocompletion=_run_names,
)
RunArguments = Annotated[list[Path], RUNS_ARGUMENT]

_GAP = "  "
_LEAST_LAST = 20  # characters of the last column
_NUMBERS = {"#", "real", "twin"}


def emit(result: Mapping[str, Any]) -> None:
    """Print the one JSON object; a number that is not finite becomes null."""
    print(json.dumps(_finite(result), indent=2, ensure_ascii=False, default=str))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not (abs(value) < float("inf")):
        return None
    return value


def width() -> int:
    """Return how many characters fit on a line of this terminal; 80 where there is none."""
    return shutil.get_terminal_size().columns


def print_columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a line a row on stdout, for people and for other programs.

    Columns whose name ends in a unit, `#`, `real` and `twin` hold numbers. On a terminal that is
    too narrow a row continues in a second line, units are below their names, and a line that is
    still too long ends in an ellipsis.

    Args:
        head: names of the columns.
        rows: cells as text.
    """
    right = [name in _NUMBERS or name.endswith("]") for name in head]
    heads, most = [head], width() if sys.stdout.isatty() else None
    if most is not None and sum(_widths([head, *rows])) + len(_GAP) * (len(head) - 1) > most:
        heads = list(zip(*(_named(name) for name in head), strict=True))
    widths = _widths([*heads, *rows])
    parts = _folded(widths, most)
    for group in (heads, *([row] for row in rows)):
        for k, part in enumerate(parts):
            for line in group:
                cells = [
                    line[i].rjust(widths[i]) if right[i] else line[i].ljust(widths[i]) for i in part
                ]
                text = f"{' ' * (widths[0] + len(_GAP)) if k else ''}{_GAP.join(cells)}".rstrip()
                if text or not k:
                    print(text if most is None or len(text) <= most else f"{text[: most - 1]}…")


def _widths(lines: Sequence[Sequence[str]]) -> list[int]:
    return [max(map(len, column)) for column in zip(*lines, strict=True)]


def _named(name: str) -> tuple[str, str]:
    """Return the name of a column, and its unit in brackets where it has one."""
    word, bracket, unit = name.partition(" [")
    return word, f"[{unit}" if bracket else ""


def _folded(widths: Sequence[int], most: int | None) -> list[list[int]]:
    """Return the indices of the columns that go into each line of a row."""
    parts: list[list[int]] = [[]]
    used = 0
    for i, whole in enumerate(widths):
        size = min(whole, _LEAST_LAST) if i == len(widths) - 1 else whole  # it can be cut
        if most is not None and parts[-1] and used + size > most:
            parts.append([])
            used = widths[0] + len(_GAP)
        parts[-1].append(i)
        used += size + len(_GAP)
    return parts


def print_to_stderr(text: str) -> None:
    """Print text for people beside the result."""
    print(text, file=sys.stderr)
