"""Write what was identified as a model file that the twin, and every later run, can use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

from ruamel.yaml.comments import CommentedMap

from workbench.identify.identification import ParameterEstimate
from workbench.schemas import Document, ModelFile, identified_source, rounded, write_changed

__all__ = ["write_model"]


def write_model(
    path: Path,
    stated: Document[ModelFile],
    values: Mapping[str, float],
    estimates: Mapping[str, ParameterEstimate],
    runs: Sequence[str],
    day: date,
    increments: int | None = None,
) -> Document[ModelFile]:
    """Write the stated model with its identified values, and return it as read back.

    A fitted parameter's tolerance becomes half its 90 % interval, and its source names day, runs
    and the value before. One that only acts together with others keeps its tolerance.

    Args:
        path: of the new file.
        stated: the model that the fit began with; its comments are kept.
        values: of every parameter that the fit changed, SI.
        estimates: of those that are determined.
        runs: names of the fitted ones.
        day: of the identification.
        increments: of the beam that was fitted, where it is not the stated one.

    Raises:
        InputError: when the file exists; a model that runs refer to is never changed.
    """

    def change(tree: CommentedMap) -> None:
        tree["name"] = path.stem
        if increments is not None and increments != stated.content.increments:
            tree["increments"] = increments
        for name, value in values.items():
            entry = tree["parameters"][name]
            estimate = estimates.get(name)
            interval = None if estimate is None else (estimate.low, estimate.high)
            was = f"{entry['value']:g}: {entry['source']}"
            if estimate is not None:
                entry["tolerance"] = rounded(estimate.half_width, 2)
            entry["source"] = identified_source(day, runs, interval, was)
            entry["value"] = rounded(value)

    return write_changed(path, stated, "model", change)
