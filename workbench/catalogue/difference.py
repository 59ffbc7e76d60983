"""What two runs differ in: protocol, robot, bench, software, remarks and results."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from ruamel.yaml.error import YAMLError

from workbench.bundle import AnswerFact, Asked, Bundle, Document, read_remarks
from workbench.errors import InputError
from workbench.quantities import unit_of

__all__ = ["ABSENT", "Difference", "differences"]

ABSENT = object()
"""Marks a value that one of the two runs does not have."""


@dataclass(frozen=True)
class Difference:
    """One value that is not the same in two runs.

    Args:
        section: where it belongs: asked, protocol, model, shape, bench, software, results, ...
        path: of nested keys, `steps[0].run.speed`; a list of named things goes by their names.
        a: value of the first run, or `ABSENT`.
        b: of the second.
        unit: of a number, where its name has one; else empty.
    """

    section: str
    path: str
    a: object
    b: object
    unit: str

    def as_json(self) -> dict[str, Any]:
        """Return its object; a value that a run does not have has no key."""
        sides = {side: v for side, v in (("a", self.a), ("b", self.b)) if v is not ABSENT}
        return {"section": self.section, "path": self.path, **sides, "unit": self.unit or None}


def differences(a: Bundle, b: Bundle) -> list[Difference]:
    """Return what differs, section by section, in the order of the first run's files.

    Numbers count as different when they are not exactly equal: a run repeated from the same inputs
    differs in its results alone.
    """
    first, second = _sections(a), _sections(b)
    return [
        Difference(section, path, one, other, _unit(path))
        for section in first
        for path, one, other in _unequal(dict(_leaves(first[section])), second[section])
    ]


def _unequal(first: Mapping[str, Any], second: object) -> Iterator[tuple[str, Any, Any]]:
    other = dict(_leaves(second))
    for path in dict.fromkeys((*first, *other)):
        one, two = first.get(path, ABSENT), other.get(path, ABSENT)
        if one != two and not (one != one and two != two):  # neither is a number
            yield path, one, two


def _sections(bundle: Bundle) -> dict[str, object]:
    """Return everything of a run that can differ for a reason, by section."""
    asked, measured = bundle.manifest.asked, bundle.manifest.measured
    said = read_remarks(bundle.path)
    files = {kind: _content(bundle, kind) for kind in get_args(Document)}
    return {
        "asked": {} if asked is None else _asked(asked) | {"answers": _plain(measured.answers)},
        **files,
        "machine": {
            "bench": asked and asked.bench,
            "calibration": asked and asked.calibration,
            "supply": measured.supply and measured.supply.as_json(),
        },
        "software": {} if asked is None else asked.versions,
        "results": _results(bundle),
        "remarks": {"verdict": said.verdict, "tags": " ".join(sorted(said.tags)) or None},
    }


def _asked(asked: Asked) -> dict[str, object]:
    """Return what the robot was put through and by whom; files and machine are listed elsewhere."""
    return {
        "title": asked.title,
        "kind": asked.kind,
        "mode": asked.mode,
        "role": asked.role,
        "repeat": asked.repeat,
        "rest_s": asked.rest_s,
        "duration_s": asked.duration_s,
        "voltage_V": asked.voltage_V,
        "speed_rad_s": asked.speed_rad_s,
        "ramp_s": asked.ramp_s,
        "pull_N": asked.pull_N,
        "height_m": asked.height_m,
        "levels": asked.levels and [list(level) for level in asked.levels],
        "operator": asked.operator,
    }


def _results(bundle: Bundle) -> dict[str, object]:
    """Return what came of a run."""
    manifest, compared, signals = bundle.manifest, bundle.manifest.compared, bundle.manifest.signals
    results: dict[str, object] = {
        "status": manifest.status,
        "error": manifest.error,
        "output_off": bundle.record.output_off,  # by all that was written of it
    }
    if compared is not None:
        results |= {
            "real": compared.real.as_json(),
            "twin": compared.twin.as_json(),
            "error_mm": compared.error_mm,
            "error_foot_mm": compared.error_foot_mm,
            "error_top_mm": compared.error_top_mm,
            "release": compared.release and compared.release.as_json(),
            "warnings": list(compared.warnings),
        }
    speed = signals and signals.rotor_speed_rad_s
    return results | {"rotor_speed_rad_s": speed and speed.as_json()}


def _plain(answers: Mapping[str, AnswerFact]) -> dict[str, object]:
    return {name: answer.as_json() for name, answer in answers.items()}


def _content(bundle: Bundle, kind: Document) -> object:
    """Return what a file came to: resolved where that was kept, else as it was given."""
    try:
        resolved = bundle.resolved(kind)
        if resolved.exists():
            return json.loads(resolved.read_text(encoding="utf-8"))
        given = bundle.document(kind)
        return _tree(given) if given.exists() else {}
    except (InputError, OSError, ValueError, YAMLError) as error:
        return {"file": f"cannot be read: {' '.join(str(error).split())}"}


def _tree(file: Path) -> object:
    from workbench.schemas import MOST_BYTES, tree_of  # what is resolved needs no YAML

    with file.open(encoding="utf-8") as text:
        return tree_of(text.read(MOST_BYTES + 1))


def _leaves(value: object, path: str = "") -> Iterator[tuple[str, object]]:
    """Yield the path of each value that holds no others, and the value; null is no value."""
    if isinstance(value, Mapping) and value:
        for key, item in value.items():
            yield from _leaves(item, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list) and value:
        names = _names(value)
        for k, item in enumerate(value):
            yield from _leaves(item, f"{path}[{names[k] if names else k}]")
    elif value is not None and path:
        yield path, value


def _names(items: list[Any]) -> list[str]:
    """Return the names of things that all have one of their own, else nothing."""
    names = [str(i["name"]) for i in items if isinstance(i, Mapping) and "name" in i]
    return names if len(names) == len(items) == len(set(names)) else []


def _unit(path: str) -> str:
    """Return the unit that the name of a value ends in."""
    name = path.rpartition(".")[2].partition("[")[0]
    return unit_of(name)[1]
