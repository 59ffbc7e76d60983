"""What a diagnosis found, as a rig file: read from one, and written to another."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from ruamel.yaml.comments import CommentedMap

from workbench.diagnose import Effects, entries
from workbench.errors import FileFault, FileFaults, did_you_mean
from workbench.mechanism.causes import RigEffect
from workbench.schemas import Document, RigFile, rounded, write_changed

__all__ = ["found_in", "write_extended"]


def found_in(
    file: Document[RigFile], every: Collection[RigEffect]
) -> list[tuple[RigEffect, float, bool]]:
    """Return what a rig file says was found: the effect, its number, and whether it is added.

    Args:
        file: the rig file.
        every: effects that it names.

    Raises:
        FileFaults: for a cause or quantity that there is not.
    """
    known = {one.name: one for one in every}
    found: list[tuple[RigEffect, float, bool]] = []
    faults: list[FileFault] = []
    for k, entry in enumerate(file.content.found):
        if entry.cause not in known:
            words = f"cause: {entry.cause!r} is none of the rig's effects"
            words += f"{did_you_mean(entry.cause, known)}; they are {', '.join(known)}"
            faults.append(file.fault(("found", k, "cause"), words))
            continue
        one = known[entry.cause]
        for quantity, value in entry.parameters.items():
            if quantity not in (one.kind.quantity, one.kind.added):
                words = f"{one.name} has no quantity {quantity!r}; it has {one.kind.quantity}"
                faults.append(file.fault(("found", k, "parameters", quantity), words))
            found.append((one, value, quantity == one.kind.added))
    if faults:
        raise FileFaults(faults)
    return found


def write_extended(
    path: Path,
    nominal: Document[RigFile],
    names: Sequence[str],
    values: Mapping[str, float],
    effects: Effects,
    diagnosis: str,
) -> Document[RigFile]:
    """Write a rig file beside none that exists; its paths lead to the same model and data.

    Args:
        path: of the new file.
        nominal: the rig that the diagnosis began with; its comments and tolerances are kept.
        names: of its parameters, in their order.
        values: of the parameters as refitted, by name; others stay as they are.
        effects: candidate -> quantity -> value and standard error, SI; one without quantities is
            known from the values alone.
        diagnosis: name of what it came from.

    Raises:
        InputError: when the file exists.
    """

    def change(tree: CommentedMap) -> None:
        tree.yaml_set_start_comment(f"extended by {diagnosis}")
        for name, entry in zip(names, tree.get("parameters") or [], strict=True):
            if name in values:
                entry["value"] = rounded(values[name])
        tree["model"] = _moved(nominal.path, tree["model"], path)
        for run in tree["runs"]:
            for key in ("data", "inputs"):
                if run.get(key) is not None:
                    run[key] = _moved(nominal.path, run[key], path)
        named = {cause: found for cause, found in effects.items() if found}
        tree["found"] = [*(tree.get("found") or []), *entries("cause", named, diagnosis)]

    return write_changed(path, nominal, "rig", change)


def _moved(before: Path, named: str, after: Path) -> str:
    """Return a path that one file names as another file, in its folder, must name it."""
    target = (before.parent / named).resolve()
    try:
        return Path(os.path.relpath(target, after.parent.resolve())).as_posix()
    except ValueError:  # on another drive
        return target.as_posix()
