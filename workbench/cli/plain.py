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
_LEAST_LAST = 20  # characters of the last column
_NUMBERS = {"#", "real", "twin"}


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


def width() -> int:
    """Return how many characters fit on a line of this terminal; 80 where there is none."""
    return shutil.get_terminal_size().columns


def print_columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a line a row on stdout, for the eye and for other programs.

    Columns whose name ends in a unit, `#`, `real` and `twin` hold numbers. On a terminal that is
    too narrow a row goes on in a second line below its first, units stand below their names, and
    what is still too long ends in a mark.

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
    """Return the places of the columns that go into each line of a row."""
    parts: list[list[int]] = [[]]
    used = 0
    for place, whole in enumerate(widths):
        size = min(whole, _LEAST_LAST) if place == len(widths) - 1 else whole  # it can be cut
        if most is not None and parts[-1] and used + size > most:
            parts.append([])
            used = widths[0] + len(_GAP)
        parts[-1].append(place)
        used += size + len(_GAP)
    return parts


def remark_on(text: str) -> None:
    """Tell a person something beside the result."""
    print(text, file=sys.stderr)
