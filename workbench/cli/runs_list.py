"""`workbench runs list` and `rebuild`: the catalogue."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from workbench.catalogue import SORTS, Entry, Query, SearchResult, period, rebuild, search, window
from workbench.cli.plain_output import JsonFlag, RunsFolder, emit, print_columns, print_to_stderr
from workbench.errors import InputError, did_you_mean
from workbench.quantities import leading

__all__ = ["list_runs", "rebuild_index"]

_NEWEST = 50  # rows that a list shows without --limit
_HEAD = (
    "#", "bundle", "mode", "speed [rad/s]", "real", "twin", "error [mm]", "status", "verdict",
    "title",
)  # fmt: skip


def list_runs(
    words: Annotated[
        list[str] | None, typer.Argument(metavar="[WORD]...", help="In title, notes, tags or name.")
    ] = None,
    speed: Annotated[
        str | None, typer.Option(help="Asked for [rad/s]: 17, 17.0, 16..18, 16.. or ..18.")
    ] = None,
    mode: Annotated[str | None, typer.Option(help="hop, clamped, decay or drop.")] = None,
    status: Annotated[str | None, typer.Option(help="complete, failed, unfinished, ...")] = None,
    verdict: Annotated[str | None, typer.Option(help="good, bad or none.")] = None,
    shape: Annotated[str | None, typer.Option(help="Part of its name.")] = None,
    model: Annotated[str | None, typer.Option(help="Part of its name.")] = None,
    operator: Annotated[str | None, typer.Option(help="Part of the name.")] = None,
    tag: Annotated[list[str] | None, typer.Option(help="All of those given.")] = None,
    since: Annotated[str | None, typer.Option(help="2026, 2026-03 or 2026-03-12.")] = None,
    until: Annotated[str | None, typer.Option(help="The same; the whole of it counts.")] = None,
    sort: Annotated[str, typer.Option(help=f"By {', '.join(SORTS)}.")] = "created",
    limit: Annotated[
        int | None, typer.Option(min=1, help=f"Rows; {_NEWEST} without it, all with --json.")
    ] = None,
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """List the runs, newest last: all of them, or those that fit every option.

    A single speed finds what rounds to it: 17 is 16.5 to 17.5, 17.0 is 16.95 to 17.05. The numbers
    in front count all runs by age; every command takes them in place of a name. Of robot and twin
    is shown how far a hop went, by how much T swung in a clamped run, and how far a released robot
    was from where it came to rest.

    Example: workbench runs list --speed 17 --verdict good --since 2026-03 ring
    """
    if sort not in SORTS:
        guess = did_you_mean(sort, SORTS)
        raise InputError(f"--sort {sort}: it is one of {', '.join(SORTS)}{guess}")
    query = Query(
        words=tuple(words or ()),
        speed=None if speed is None else window(speed),
        mode=mode,
        status=status,
        verdict=verdict,
        shape=shape,
        model=model,
        operator=operator,
        tags=tuple(tag or ()),
        since=None if since is None else period(since),
        until=None if until is None else period(until),
        sort=sort,
        limit=limit or (None if as_json else _NEWEST),
    )
    found = search(folder, query, print_to_stderr)
    if as_json:
        pairs = zip(found.entries, found.numbers, strict=True)
        listed = [entry.as_json(folder, number) for entry, number in pairs]
        emit({"runs": listed, "matching": found.matching, "total": found.total})
    else:
        _print_list(found)


def rebuild_index(folder: RunsFolder = Path("runs")) -> None:
    """Read every bundle anew into the index, which is only a cache of them.

    Lists notice by themselves what was added, removed or replaced. This is for files that were
    edited in place, with their date set back.

    Example: workbench runs rebuild
    """
    count = rebuild(folder, print_to_stderr)
    print_to_stderr(f"{count} runs in {folder}")


def _print_list(found: SearchResult) -> None:
    rows = [_row(entry, number) for entry, number in zip(found.entries, found.numbers, strict=True)]
    print_columns(_HEAD, rows)
    hidden = found.matching - len(found.entries)
    if hidden:
        print_to_stderr(f"{hidden} more; --limit N shows more, options and words show fewer")
    elif found.matching < found.total:
        print_to_stderr(f"{found.matching} of {found.total} runs")


def _row(entry: Entry, number: int) -> list[str]:
    facts = json.loads(entry.facts)
    same = entry.slowest == entry.fastest
    speeds = [entry.fastest] if same else [entry.slowest, entry.fastest]
    return [
        str(number), entry.name, entry.mode or "-",
        " to ".join(_shown(one, 2) for one in speeds), leading(facts.get("real")),
        leading(facts.get("twin")), _shown(entry.error, 1), entry.status,
        "" if entry.verdict == "none" else entry.verdict, entry.title,
    ]  # fmt: skip


def _shown(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
