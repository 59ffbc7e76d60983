"""Write an extended model as a file that the twin, and every later run, can use."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

from ruamel.yaml import YAML

from workbench.errors import InputError
from workbench.protocol import Document, ModelFile, parse

__all__ = ["write_extension"]

_DIGITS = 6


def write_extension(
    path: Path,
    stated: Document[ModelFile],
    values: Mapping[str, float],
    effects: Mapping[str, Mapping[str, tuple[float, float]]],
    diagnosis: str,
) -> Document[ModelFile]:
    """Write the stated model with its refitted values and new effects, and return it as read back.

    Args:
        path: of the new file.
        stated: the model that the diagnosis began with; its comments and tolerances are kept.
        values: of the base as refitted beside the effects, SI.
        effects: effect -> quantity -> value and standard error, SI.
        diagnosis: name of what it came from.

    Raises:
        InputError: when the file exists; a model that runs refer to is never changed.
    """
    if path.exists():
        raise InputError(f"{path}: exists; a model is never changed, give another --out")
    yaml = YAML()
    yaml.width = 10_000
    tree = yaml.load(stated.text)
    tree["name"] = path.stem
    for name, value in values.items():
        entry = tree["parameters"][name]
        was = entry["value"]
        entry["value"] = _rounded(value)
        entry["source"] = f"refitted by {diagnosis}; was {was:g}: {entry['source']}"
    tree["effects"] = [
        *(tree.get("effects") or []),
        *(
            {
                "name": name,
                "parameters": {key: _rounded(value) for key, (value, _) in quantities.items()},
                "standard_errors": {key: _rounded(error) for key, (_, error) in quantities.items()},
                "diagnosis": diagnosis,
            }
            for name, quantities in effects.items()
        ),
    ]
    stream = io.StringIO()
    yaml.dump(tree, stream)
    document = parse(path, stream.getvalue(), ModelFile)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(stream.getvalue(), encoding="utf-8")
    return document


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
