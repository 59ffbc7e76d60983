"""An experiment: a protocol, the bench it runs on, the robot, and the plan made from them."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar

from workbench.errors import FileFaults
from workbench.run.course import digest
from workbench.schemas import (
    BenchFile,
    Document,
    Mode,
    ModelFile,
    Named,
    Parts,
    Plan,
    PlannedDrive,
    PlannedRelease,
    PlannedRun,
    Protocol,
    ShapeFile,
    load_model,
    load_protocol,
    load_shape,
    make_plan,
)

__all__ = ["Experiment", "condition_facts", "read_experiment", "require_takes"]

T = TypeVar("T")

_REACHED = ("kind", "port", "address", "baud", "unit", "timeout", "gap", "echo")
"""Keys of a connection of the way to a supply, and not of which one it is."""


@dataclass(frozen=True)
class Experiment:
    """Everything that a plan was made from.

    Args:
        protocol: as read.
        bench: as read.
        model: of the robot, as read.
        shape: of the beam, as read.
        plan: what will be done.
        parts: what the protocol includes, as read.
        shapes: of the runs that name their own, as read.
    """

    protocol: Document[Protocol]
    bench: Document[BenchFile]
    model: Document[ModelFile]
    shape: Document[ShapeFile]
    plan: Plan
    parts: Parts = field(default_factory=dict)
    shapes: Mapping[Named, Document[ShapeFile]] = field(default_factory=dict)

    def shape_of(self, run: PlannedRun) -> Document[ShapeFile]:
        """Return the beam of a run."""
        return self.shape if run.shape is None else self.shapes[run.shape]

    def inputs(self) -> dict[str, str]:
        """Return the name of each file -> sha256 of what it comes to; a resumed run needs the same.

        A comment, the order of keys, and how the supply is reached, change nothing that is
        measured. Which supply it is comes under `supply`, as text: it may be known by other means.
        """
        bench = self.bench.content
        digests = {name: digest(_meaning(one)) for name, one in self._files().items()}
        digests["calibration"] = digest(bench.line.model_dump_json())
        number = bench.supply.serial_number
        reached = bench.supply.connection.model_dump(mode="json", include=set(_REACHED))
        which = {"connection": reached} if number is None else {"serial": number}
        return digests | {"supply": json.dumps(which, sort_keys=True)}

    @property
    def digest(self) -> str:
        """Return the sha256 over all that the plan was made from, comments included."""
        return digest(json.dumps([self.inputs(), self.texts()], sort_keys=True))

    def texts(self) -> dict[str, str]:
        """Return the name of each file -> sha256 of its text, by which runs went until 2026."""
        return {name: digest(one.text) for name, one in self._files().items()}

    def _files(self) -> dict[str, Document[Any]]:
        given = {"protocol": self.protocol, "bench": self.bench, "model": self.model}
        files: dict[str, Document[Any]] = {f"{k} {one.path.name}": one for k, one in given.items()}
        files |= {f"part {part.path.name}": part for part in self.parts.values()}
        shapes = [self.shape, *self.shapes.values()]
        return files | {f"shape {one.path.name}": one for one in shapes}


def read_experiment(path: Path, bench: Document[BenchFile], voltage_step: Decimal) -> Experiment:
    """Return a protocol as a bench would carry it out, with the robot that either names.

    Args:
        path: of the protocol.
        bench: as read.
        voltage_step: smallest step of its supply [V].

    Raises:
        InputError: when a file or the folder of exports is missing, or a twin of a run cannot be
            built.
        FileFaults: with the faults of the first file that has any, or of the plan.
    """
    asked, parts = load_protocol(path)
    require_takes(bench)
    folder, other = asked.path.parent, bench.path.parent
    model = _first(load_model, (asked.content.model, folder), (bench.content.model, other))
    shape = _first(load_shape, (asked.content.shape, folder), (bench.content.shape, other))
    plan = make_plan(asked, bench.content, voltage_step, parts)
    names = {run.shape for run in plan.runs if run.shape is not None}
    shapes = {name: load_shape(name.name, name.beside) for name in names}
    from workbench.twin import check_twin  # with simulation: misspelt names are reported before

    made = Experiment(asked, bench, model, shape, plan, parts, shapes)
    for beam in (shape, *shapes.values()):
        modes: list[Mode] = [run.mode for run in plan.runs if made.shape_of(run) is beam]
        check_twin(model.content, beam.content, modes)
    return made


def condition_facts(action: PlannedDrive | PlannedRelease) -> dict[str, Any]:
    """Return the part of what was asked that depends on the mode; what it does not have is None."""
    keys = ("voltage_V", "speed_rad_s", "ramp_s", "pull_N", "height_m", "levels")
    match action:
        case PlannedDrive():
            volts = None if action.voltage is None else float(action.voltage)
            levels = tuple((since, float(level), speed) for since, level, speed in action.levels)
            several = levels if len(levels) > 1 else None
            values = (volts, action.speed, action.ramp, None, None, several)
        case PlannedRelease():
            values = (None, None, None, action.pull, action.height, None)
    return dict(zip(keys, values, strict=True))


def _meaning(document: Document[Any]) -> str:
    """Return what a file comes to, as text; of a bench without how its devices are reached."""
    content = document.content.model_dump(mode="json", by_alias=True)
    if isinstance(document.content, BenchFile):
        supply, tracking = content["supply"], content["tracking"]
        for section, keys in (
            (supply, ("serial",)),
            (supply["connection"], _REACHED),
            (tracking, ("takes", "takes_timeout")),
        ):
            for key in keys:
                section.pop(key, None)
    return json.dumps(content, sort_keys=True)


def require_takes(bench: Document[BenchFile]) -> None:
    """Refuse a bench whose exports are to appear in a folder that is not there.

    Raises:
        FileFaults: with the place in the bench file.
    """
    takes = bench.content.tracking.takes
    if bench.content.virtual is None and takes is not None and not os.path.isdir(takes):
        text = f"takes: no such folder: {Path(takes).absolute()}; make or mount it, or name another"
        raise FileFaults([bench.fault(("tracking", "takes"), text)])


def _first(
    read: Callable[[str, Path], T], given: tuple[str | None, Path], default: tuple[str, Path]
) -> T:
    """Read what the protocol names, else what the bench names, each beside its own file."""
    name, beside = given
    return read(*default) if name is None else read(name, beside)
