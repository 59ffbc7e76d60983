"""Write an extended model as a file that the twin, and every later run, can use."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ruamel.yaml.comments import CommentedMap

from workbench.schemas import Document, ModelFile, rounded, write_changed

__all__ = ["Effects", "entries", "write_extension"]

Effects = Mapping[str, Mapping[str, tuple[float, float]]]
"""Cause -> quantity -> value and standard error, SI."""


def write_extension(
    path: Path,
    stated: Document[ModelFile],
    values: Mapping[str, float],
    effects: Effects,
    diagnosis: str,
    increments: int,
) -> Document[ModelFile]:
    """Write the stated model with its refitted values and new effects, and return it as read back.

    Args:
        path: of the new file.
        stated: the model that the diagnosis began with; its comments and tolerances are kept.
        values: of the base as refitted beside the effects, SI.
        effects: effect -> quantity -> value and standard error, SI.
        diagnosis: name of what it came from.
        increments: of the beam that was fitted.

    Raises:
        InputError: when the file exists; a model that runs refer to is never changed.
    """

    def change(tree: CommentedMap) -> None:
        tree["name"] = path.stem
        if increments != stated.content.increments:
            tree["increments"] = increments
        for name, value in values.items():
            entry = tree["parameters"][name]
            entry["source"] = f"refitted by {diagnosis}; was {entry['value']:g}: {entry['source']}"
            entry["value"] = rounded(value)
        tree["effects"] = [*(tree.get("effects") or []), *entries("name", effects, diagnosis)]

    return write_changed(path, stated, "model", change)


def entries(key: str, effects: Effects, diagnosis: str) -> list[dict[str, object]]:
    """Return what a file says of the causes that a diagnosis found, each under its key."""
    return [
        {
            key: name,
            "parameters": {quantity: rounded(value) for quantity, (value, _) in found.items()},
            "standard_errors": {quantity: rounded(error) for quantity, (_, error) in found.items()},
            "diagnosis": diagnosis,
        }
        for name, found in effects.items()
    ]
