"""Which runs of an experiment are done: read from its bundles, the only truth.

Every bundle names its experiment, the number of its run and a hash of each input. So an experiment
that was cut off at any instant goes on from what is on disk.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path

from workbench.bundle import Bundle, runs_named, runs_of
from workbench.errors import InputError
from workbench.run.control import holder

__all__ = ["Course", "begin", "digest", "foresee", "resume"]

_SUPPLY = "supply"  # the input that identifies the supply
_CUT = "the program ended without a word here: it was killed, or the computer stopped"


@dataclass(frozen=True)
class Course:
    """How far an experiment is.

    Args:
        id: of the experiment, the same in all its bundles.
        inputs: name of each input -> sha256 of what it comes to.
        done: numbers of the runs that are complete.
        tries: number of a run -> how often it was begun.
        root: folder of its bundles, None where it has none yet.
    """

    id: str
    inputs: Mapping[str, str]
    done: frozenset[int] = frozenset()
    tries: Mapping[int, int] = field(default_factory=dict)
    root: Path | None = None

    def after(self, number: int) -> Course:
        """Return the course when a run was made once more."""
        return replace(self, tries={**self.tries, number: self.tries.get(number, 0) + 1})

    def attempt(self, number: int) -> int:
        """Return which attempt at a run the next one is, from 1."""
        return self.tries.get(number, 0) + 1


def digest(text: str) -> str:
    """Return the sha256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def begin(inputs: Mapping[str, str], now: datetime) -> Course:
    """Return the course of an experiment of which nothing is done."""
    return Course(f"{now:%Y%m%d-%H%M%S}-{secrets.token_hex(2)}", inputs)


def resume(
    run: Path, root: Path, inputs: Mapping[str, str], texts: Mapping[str, str] | None = None
) -> Course:
    """Return the course of the experiment that a bundle belongs to.

    Bundles that were cut off are closed as failed, with all that they hold.

    Args:
        run: any run of the experiment, or what names its runs, as `runs_named` takes it.
        root: folder of all bundles.
        inputs: of the experiment that shall go on, as in `Course`.
        texts: sha256 of each file as it is written, for experiments that were begun when that
            counted.

    Raises:
        InputError: when it is no run of an experiment, or runs of several, an input is another than
            then, or another process still carries the experiment out.
    """
    course, begun = _find(run, root, inputs, texts or {})
    for bundle in begun:
        if not bundle.is_closed():
            bundle.finish("failed", error=bundle.manifest.error or _CUT)
    return course


def foresee(
    run: Path, root: Path, inputs: Mapping[str, str], texts: Mapping[str, str] | None = None
) -> Course:
    """Return what `resume` would, and change nothing; arguments and errors as there."""
    return _find(run, root, inputs, texts or {})[0]


def _find(
    run: Path, root: Path, inputs: Mapping[str, str], texts: Mapping[str, str]
) -> tuple[Course, list[Bundle]]:
    """Return the course of an experiment and its bundles, once it is known that it may go on."""
    meant = [Bundle.open(folder) for folder in runs_named([run], root)]
    one, names = meant[0], {bundle.experiment for bundle in meant}
    if len(names) > 1:
        raise InputError(f"{run}: names runs of {len(names)} experiments; name one of them")
    (name,) = names
    if name is None:
        raise InputError(
            f"{one.path}: belongs to no experiment, so there is nothing to resume; start anew "
            "without --resume"
        )
    _require_same(one, inputs, texts)
    begun = runs_of(name, one.path.parent)
    _require_free(one.path.parent, name, begun[-1])
    course = Course(
        id=name,
        inputs=inputs,
        done=frozenset(b.asked.number for b in begun if b.manifest.status == "complete"),
        tries=Counter(bundle.asked.number for bundle in begun),
        root=one.path.parent,
    )
    return course, begun


def _require_free(root: Path, experiment: str, newest: Bundle) -> None:
    """Refuse while a process carries the experiment out; its bundle is not ours to close."""
    session = holder(root, experiment)
    if session is not None:
        raise InputError(
            f"{newest.path} cannot be resumed: process {session.pid} still carries out experiment "
            f"{experiment}. Let it end, or stop it with Ctrl-C in its terminal or STOP in "
            "`workbench panel`"
        )


def _require_same(bundle: Bundle, inputs: Mapping[str, str], texts: Mapping[str, str]) -> None:
    """Refuse inputs that come to something else than those of a bundle."""
    then = bundle.asked.inputs or {}
    changed = [
        name
        for name in inputs
        if name in then and name != _SUPPLY and then[name] not in (inputs[name], texts.get(name))
    ]
    other = sorted((set(then) ^ set(inputs)) - {_SUPPLY})
    changes = [f"{name} was changed" for name in changed]
    changes += [f"{name} is {'new' if name in inputs else 'gone'}" for name in other]
    if changes:
        raise InputError(
            f"{bundle.path} cannot be resumed: {', '.join(changes)}. Put it back as it was, or "
            "start anew without --resume"
        )
    if _SUPPLY in then:
        _require_same_supply(bundle, then[_SUPPLY], inputs[_SUPPLY])


def _require_same_supply(bundle: Bundle, then: str, now: str) -> None:
    """Refuse a supply that is reached in another way, unless its serial number is the same."""
    named = json.loads(now).get("serial")
    read = bundle.manifest.measured.supply
    was = json.loads(then).get("serial") or (None if read is None else read.serial)
    if now == then or (named is not None and named == was):
        return
    if named is not None and was is not None:
        raise InputError(
            f"{bundle.path} cannot be resumed: its supply has the serial number {was}, and the "
            f"bench file names {named}. Use that supply, or start anew without --resume"
        )
    number = f"serial: '{was}'" if was else "its serial number"
    raise InputError(
        f"{bundle.path} cannot be resumed: its supply is reached in another way now and could be "
        f"another one. Write {number} under `supply` of the bench file, put the connection back as "
        "it was, or start anew without --resume"
    )
