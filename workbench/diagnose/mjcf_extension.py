"""An extended rig as a file: the rig file with refitted numbers and the causes that were found."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ruamel.yaml.comments import CommentedMap

from workbench.diagnose.extension import entries
from workbench.diagnose.rig import Cause, Effects
from workbench.errors import FileFault, FileFaults, did_you_mean
from workbench.protocol import Document, RigFile, rounded, write_changed

__all__ = ["found_values", "write_extended"]


def found_values(file: Document[RigFile], causes: Sequence[Cause]) -> dict[str, float]:
    """Return the values of the causes that a rig file says were found, by unknown.

    Raises:
        FileFaults: for a cause or quantity that there is not.
    """
    known = {cause.name: [unknown.name for unknown in cause.unknowns] for cause in causes}
    values: dict[str, float] = {}
    faults: list[FileFault] = []
    for k, found in enumerate(file.content.found):
        if found.cause not in known:
            words = f"cause: {found.cause!r} is none of the rig's effects"
            words += f"{did_you_mean(found.cause, known)}; they are {', '.join(known)}"
            faults.append(file.fault(("found", k, "cause"), words))
            continue
        for quantity, value in found.parameters.items():
            name = f"{found.cause}.{quantity}"
            if name not in known[found.cause]:
                has = ", ".join(other.split(".", 1)[1] for other in known[found.cause])
                words = f"{found.cause} has no quantity {quantity!r}; it has {has}"
                faults.append(file.fault(("found", k, "parameters", quantity), words))
            values[name] = value
    if faults:
        raise FileFaults(faults)
    return values


def write_extended(
    path: Path,
    stated: Document[RigFile],
    values: Sequence[float | None],
    effects: Effects,
    diagnosis: str,
) -> None:
    """Write a rig file beside none that exists; its paths lead to the same model and data.

    Args:
        path: of the new file.
        stated: the rig that the diagnosis began with; its comments and tolerances are kept.
        values: of its parameters as refitted, in their order; None leaves one as it is.
        effects: cause -> quantity -> value and standard error, SI.
        diagnosis: name of what it came from.

    Raises:
        InputError: when the file exists.
    """

    def change(tree: CommentedMap) -> None:
        tree.yaml_set_start_comment(f"extended by {diagnosis}")
        for entry, value in zip(tree.get("parameters") or [], values, strict=True):
            if value is not None:
                entry["value"] = rounded(value)
        tree["model"] = _moved(stated.path, tree["model"], path)
        for run in tree["runs"]:
            run["data"] = _moved(stated.path, run["data"], path)
        tree["found"] = [*(tree.get("found") or []), *entries("cause", effects, diagnosis)]

    write_changed(path, stated, "rig", change)


def _moved(before: Path, named: str, after: Path) -> str:
    """Return a path that one file names as another file, in its folder, must name it."""
    target = (before.parent / named).resolve()
    try:
        return Path(os.path.relpath(target, after.parent.resolve())).as_posix()
    except ValueError:  # on another drive
        return target.as_posix()
