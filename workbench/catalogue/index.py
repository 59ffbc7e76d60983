"""The index: one SQLite file in the folder of all bundles, a cache of what lies there.

Each search first looks which manifests and remarks changed, and reads those anew. Several programs
may do so at once: what is read is written in one transaction. Where the file cannot be written, as
in a folder of another laboratory, a copy in memory serves; where it is damaged, it is made again.
"""

from __future__ import annotations

import sqlite3
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeVar

from workbench.bundle import Stamp, bundle_names, stamping
from workbench.catalogue.entry import COLUMNS, Entry, as_row, read_entry
from workbench.catalogue.query import SORTS, Query, conditions
from workbench.errors import InputError, did_you_mean

__all__ = ["INDEX", "SearchResult", "rebuild", "search"]

Report = Callable[[str], None]
_T = TypeVar("_T")

INDEX = ".catalogue.sqlite"
"""Name of the file; hidden, so that `runs/*` means bundles alone."""

_VERSION = 3
_WAIT_S = 10.0  # for another program that writes
_MEMORY = ":memory:"
_STAMPED = ("name", "changed_ns", "size", "file", "remarks_ns", "remarks_size", "closed")
_CLOSED_SETS = ("mode", "status", "verdict")


@dataclass(frozen=True)
class SearchResult:
    """What a search found.

    Args:
        entries: in the order asked for.
        numbers: of the entries, among all bundles by age from 1.
        matching: how many there are without the limit.
        total: how many bundles there are.
    """

    entries: tuple[Entry, ...]
    numbers: tuple[int, ...]
    matching: int
    total: int


def search(root: Path, query: Query, report: Report) -> SearchResult:
    """Return the runs that a query asks for, as they are on disk now.

    Args:
        root: folder of all bundles.
        query: which.
        report: receives where the index could not be used as it was.

    Raises:
        InputError: when no run at all has such a mode, status or verdict.
    """
    names = bundle_names(root)
    found = _asked(root, names, report, False, lambda base: _select(base, query))
    numbers = tuple(bisect_left(names, entry.name) + 1 for entry in found.entries)
    return SearchResult(found.entries, numbers, found.matching, len(names))


def rebuild(root: Path, report: Report) -> int:
    """Read every bundle anew, whatever the index says, and return how many there are.

    Args:
        root: folder of all bundles.
        report: as in `search`.
    """
    names = bundle_names(root)
    _asked(root, names, report, True, lambda base: None)
    return len(names)


class _Selected(NamedTuple):
    """Entries in the order asked for, and how many there are without the limit."""

    entries: tuple[Entry, ...]
    matching: int


def _select(base: sqlite3.Connection, query: Query) -> _Selected:
    _refuse_unheard_of(base, query)
    condition, values = conditions(query)
    where = f"FROM runs WHERE {condition}"
    (matching,) = base.execute(f"SELECT count(*) {where}", values).fetchone()
    rows = base.execute(
        f"SELECT {', '.join(COLUMNS)} {where} ORDER BY {SORTS[query.sort]} DESC, name DESC LIMIT ?",
        [*values, -1 if query.limit is None else query.limit],
    ).fetchall()
    return _Selected(tuple(Entry(*row) for row in reversed(rows)), matching)


def _asked(
    root: Path,
    names: Sequence[str],
    report: Report,
    anew: bool,
    ask: Callable[[sqlite3.Connection], _T],
) -> _T:
    """Bring the index up to date with the bundles named, ask it, and mend what is wrong with it."""

    def answer(base: sqlite3.Connection) -> _T:
        with closing(base):
            _refresh(base, root, names, anew)
            return ask(base)

    path = root / INDEX
    if not root.is_dir():
        return answer(_opened(_MEMORY, report))
    try:
        return answer(_opened(str(path), report))
    except sqlite3.DatabaseError as error:
        if not _is_damage(error):
            report(f"{path}: cannot be used ({error}); the runs are searched without it")
            return answer(_in_memory(path, report))
        report(f"{path}: damaged ({error}); made again from the bundles")
    try:
        path.unlink(missing_ok=True)
        return answer(_opened(str(path), report))
    except (OSError, sqlite3.DatabaseError):  # somebody else has it open, or keeps it
        return answer(_opened(_MEMORY, report))


def _is_damage(error: sqlite3.DatabaseError) -> bool:
    """Distinguish a damaged file from one that cannot be opened or written now."""
    damage = (sqlite3.SQLITE_ERROR, sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)
    return error.sqlite_errorcode & 0xFF in damage  # the rest of the code has details


def _opened(file: str, report: Report, uri: bool = False) -> sqlite3.Connection:
    """Open an index; one of another version begins empty."""
    base = sqlite3.connect(file, timeout=_WAIT_S, isolation_level=None, uri=uri)
    (version,) = base.execute("PRAGMA user_version").fetchone()
    if version == _VERSION:
        return base
    if version:
        report(f"{file}: of another version of the workbench; made again from the bundles")
    base.execute("BEGIN IMMEDIATE")
    # While we waited for the lock, another program may have made and filled it.
    if base.execute("PRAGMA user_version").fetchone() == (version,):
        for table, columns in (("runs", COLUMNS), ("stamps", _STAMPED)):
            base.execute(f"DROP TABLE IF EXISTS {table}")
            base.execute(f"CREATE TABLE {table} ({', '.join(columns)}, PRIMARY KEY (name))")
        base.execute(f"PRAGMA user_version = {_VERSION}")
    base.execute("COMMIT")
    return base


def _in_memory(path: Path, report: Report) -> sqlite3.Connection:
    """Return an index that nobody keeps, begun with what the file knows."""
    copy = sqlite3.connect(_MEMORY, isolation_level=None)
    try:
        with closing(_opened(f"{path.absolute().as_uri()}?mode=ro", report, uri=True)) as kept:
            kept.backup(copy)
    except sqlite3.Error:
        copy.close()
        return _opened(_MEMORY, report)
    return copy


def _refresh(base: sqlite3.Connection, root: Path, names: Sequence[str], anew: bool) -> None:
    """Read what changed since the index was made, and put it in."""
    known = _known(base)
    changed = _changed(root, names, {} if anew else known)
    entries = [as_row(read_entry(root / name, now[-1] == 1)) for name, now in changed]
    gone = [[name] for name in known.keys() - set(names)]
    if not changed and not gone:
        return
    base.execute("BEGIN IMMEDIATE")
    for table in ("runs", "stamps"):
        base.executemany(f"DELETE FROM {table} WHERE name = ?", gone)
    base.executemany(_insert("runs", COLUMNS), entries)
    base.executemany(_insert("stamps", _STAMPED), [(name, *now) for name, now in changed])
    base.execute("COMMIT")


def _insert(table: str, columns: Sequence[str]) -> str:
    return f"INSERT OR REPLACE INTO {table} VALUES ({', '.join('?' * len(columns))})"


def _known(base: sqlite3.Connection) -> dict[str, Stamp]:
    """Return the stamps that the bundles had when they were read, by name."""
    return {row[0]: row[1:] for row in base.execute("SELECT * FROM stamps")}


def _changed(
    root: Path, names: Sequence[str], known: Mapping[str, Stamp]
) -> list[tuple[str, Stamp]]:
    """Return name and stamp of each bundle that is not as it was when it was read."""
    found: list[tuple[str, Stamp]] = []
    if not names:
        return found
    with stamping(root) as stamp:
        for name in names:
            before = known.get(name)
            now = stamp(name, before is not None and before[-1] == 1)
            if now != before:
                found.append((name, now))
    return found


def _refuse_unheard_of(base: sqlite3.Connection, query: Query) -> None:
    """Refuse a word that no run has where only few words exist."""
    for column in _CLOSED_SETS:
        asked = getattr(query, column)
        if asked is None or (column == "verdict" and asked in ("good", "bad", "none")):
            continue
        there = [word for (word,) in base.execute(f"SELECT DISTINCT {column} FROM runs") if word]
        if there and asked not in there:
            listed = ", ".join(sorted(there))
            raise InputError(
                f"no run has the {column} {asked!r}; there are {listed}{did_you_mean(asked, there)}"
            )
