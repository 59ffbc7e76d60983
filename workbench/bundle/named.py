"""Which runs are meant by what a person types; every verb goes by this, so a word means one thing.

    path          of a run's folder
    name          of a run in the folder of all bundles
    number        of a run, as `workbench runs list` counts them
    folder        of runs: all of them, by name
    experiment    by its id: its runs in the order in which they were begun
    protocol      by its file or name: the runs of the newest experiment that carried it out
    part          of a name that only one run has; case does not count

They are tried in this order, so that what is whole goes before a part. Where one run is wanted the
part is tried before experiment and protocol, which name several runs most of the time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from workbench.bundle.finding import bundle_names, is_run, no_bundle
from workbench.bundle.folder import Bundle
from workbench.bundle.names import MANIFEST, NAMED
from workbench.errors import InputError, did_you_mean

__all__ = ["run_named", "runs_named", "runs_of"]

_MOST_NAMED = 8  # candidates that a message names
_SUFFIXES = (".yaml", ".yml")


def run_named(word: Path, root: Path) -> Path:
    """Return the folder of the one run that is meant.

    Args:
        word: what was typed.
        root: folder of all bundles.

    Raises:
        InputError: when no run is meant, or several are; they are named.
    """
    found = _exactly(word, root)
    if not found:
        fitting = _with_part(word, root)
        found = fitting if len(fitting) == 1 else _of_experiment(word, root) or fitting
    return _only(found, word, root)


def runs_named(words: Iterable[Path], root: Path) -> list[Path]:
    """Return the folders of the runs that are meant, in the order of the words.

    Args:
        words: what was typed.
        root: folder of all bundles.

    Raises:
        InputError: when a word means no run, or is a part of several names; they are named.
    """
    found: list[Path] = []
    for word in words:
        meant = _exactly(word, root) or _of_experiment(word, root)
        found += meant or [_only(_with_part(word, root), word, root)]
    return found


def _exactly(word: Path, root: Path) -> list[Path]:
    """Return what is meant by a path, a name, a number or a folder; nothing where it is none."""
    if word.is_dir():
        inside = sorted(file.parent for file in word.glob(f"*/{MANIFEST}"))
        if inside and not (word / MANIFEST).exists():
            return inside
        if not is_run(word):
            raise InputError(f"{word}: {no_bundle(word)}")
        return [word]
    names, wanted = bundle_names(root), str(word)
    if wanted in names:
        return [root / wanted]
    if not wanted.isdecimal():
        return []
    if 1 <= int(wanted) <= len(names):
        return [root / names[int(wanted) - 1]]
    raise InputError(f"run {wanted}: {root} holds {len(names)} runs, numbered from 1")


def _with_part(word: Path, root: Path) -> list[Path]:
    part = str(word).casefold()
    return [root / name for name in bundle_names(root) if part in name.casefold()]


def _of_experiment(word: Path, root: Path) -> list[Path]:
    """Return the runs of the experiment with this id, or of the newest one of this protocol."""
    every = list(_in_experiments(root))
    ids = {run.experiment for run in every}
    asked = word.stem if word.suffix in _SUFFIXES else word.name
    of_protocol = (run.experiment or "" for run in every if _protocol(run) == asked)
    chosen = word.name if word.name in ids else max(of_protocol, default=None)
    return [run.path for run in every if run.experiment == chosen]


def _protocol(run: Bundle) -> str:
    return Path(run.asked.protocol or "").stem


def runs_of(experiment: str, root: Path) -> list[Bundle]:
    """Return the runs of an experiment, by name."""
    return [run for run in _in_experiments(root) if run.experiment == experiment]


def _in_experiments(root: Path) -> Iterator[Bundle]:
    """Yield each run that belongs to one; a run whose manifest is damaged belongs to nothing."""
    for name in bundle_names(root):
        with suppress(InputError):
            run = Bundle.open(root / name)
            if run.experiment is not None:
                yield run


def _only(found: Sequence[Path], word: Path, root: Path) -> Path:
    """Return the one run that was found.

    Raises:
        InputError: when there are several, or none.
    """
    if len(found) == 1:
        return found[0]
    if not found:
        raise _unknown(word, root)
    more = f" and {len(found) - _MOST_NAMED} older ones" if len(found) > _MOST_NAMED else ""
    newest = ", ".join(one.name for one in found[: -_MOST_NAMED - 1 : -1])
    raise InputError(
        f"{str(word)!r} fits {len(found)} runs in {found[0].parent}: {newest}{more}; type more of "
        "the name, or its number in `workbench runs list`"
    )


def _unknown(word: Path, root: Path) -> InputError:
    names = bundle_names(root)
    protocols = sorted({_protocol(run) for run in _in_experiments(root)})
    there = f"; there are the protocols {', '.join(protocols)}" if protocols else ""
    asked = word.stem if word.suffix in _SUFFIXES else word.name
    parts = [NAMED.sub("", name) for name in names]  # what people remember of a name
    hint = did_you_mean(asked, [*names, *protocols, *parts]) or there
    return InputError(
        f"{word}: no run, folder of runs, protocol or experiment of that name in {root}, which "
        f"holds {len(names)} run{'s' * (len(names) != 1)}{hint}; "
        "`workbench runs list` shows them"
    )
