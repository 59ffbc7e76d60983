"""What a model file says of an identification, and what those of a folder have found over time."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import NamedTuple

from workbench.errors import InputError
from workbench.schemas.files import load
from workbench.schemas.model import ModelFile

__all__ = ["Identified", "identifications", "identified_source"]

_SOURCE = re.compile(r"identified (\d{4}-\d\d-\d\d) from [^;]*, 90 % ")


class Identified(NamedTuple):
    """What one identification determined: the model it wrote, its day, and parameter -> value."""

    model: str
    day: date
    values: Mapping[str, float]


def identified_source(
    day: date, runs: Sequence[str], interval: tuple[float, float] | None, was: str
) -> str:
    """Return a parameter's source after an identification.

    Args:
        day: of the identification.
        runs: names of the fitted ones.
        interval: 90 % interval; None where it only acts together with others.
        was: value and source before.
    """
    listed = ", ".join(runs[:3]) + (f" and {len(runs) - 3} more" if len(runs) > 3 else "")
    how = "; only in combination with others, see not_determined"
    if interval is not None:
        how = f", 90 % {interval[0]:.6g} to {interval[1]:.6g}"
    return f"identified {day.isoformat()} from {len(runs)} run(s) ({listed}){how}; was {was}"


def identifications(folder: Path) -> list[Identified]:
    """Return what each model file of a folder was identified as, oldest first.

    Only what that identification determined: a parameter that a later model took over as it was
    belongs to the earlier one. A file that is no model is passed over.
    """
    found, seen = [], set()
    paths = sorted(folder.glob("*.yaml"), key=lambda path: (len(path.stem), path.stem))
    for path in paths:
        try:
            model = load(path, ModelFile).content
        except InputError:
            continue
        days: dict[date, dict[str, float]] = {}
        for name, parameter in dict(model.parameters).items():
            source = _SOURCE.match(parameter.source)
            if source and (name, parameter.source) not in seen:
                seen.add((name, parameter.source))
                days.setdefault(date.fromisoformat(source[1]), {})[name] = parameter.value
        if days:
            found.append(Identified(path.stem, max(days), days[max(days)]))
    return sorted(found, key=lambda one: one.day)
