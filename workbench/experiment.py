"""An experiment: a protocol, the bench it runs on, the robot, and the plan made from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import TypeVar

from workbench.protocol import (
    BenchFile,
    Document,
    Mode,
    ModelFile,
    Named,
    Parts,
    Plan,
    PlannedRun,
    Protocol,
    ShapeFile,
    load_model,
    load_protocol,
    load_shape,
    make_plan,
)
from workbench.resume import digest

__all__ = ["Experiment", "read_experiment"]

T = TypeVar("T")


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
        """Return the name of each file -> sha256 of its text; a resumed run needs the same."""
        own = {"protocol": self.protocol, "bench": self.bench, "model": self.model}
        texts = {f"{kind} {one.path.name}": one.text for kind, one in own.items()}
        texts |= {f"part {part.path.name}": part.text for part in self.parts.values()}
        shapes = [self.shape, *self.shapes.values()]
        texts |= {f"shape {one.path.name}": one.text for one in shapes}
        line = self.bench.content.line
        texts["calibration"] = line.model_dump_json()
        return {name: digest(text) for name, text in texts.items()}


def read_experiment(path: Path, bench: Document[BenchFile], voltage_step: Decimal) -> Experiment:
    """Return a protocol as a bench would carry it out, with the robot that either names.

    Args:
        path: of the protocol.
        bench: as read.
        voltage_step: smallest step of its supply [V].

    Raises:
        InputError: when a file is missing, or a twin of a run cannot be built.
        FileFaults: with the faults of the first file that has any, or of the plan.
    """
    asked, parts = load_protocol(path)
    own, other = asked.path.parent, bench.path.parent
    model = _first(load_model, (asked.content.model, own), (bench.content.model, other))
    shape = _first(load_shape, (asked.content.shape, own), (bench.content.shape, other))
    plan = make_plan(asked, bench.content, voltage_step, parts)
    names = {run.shape for run in plan.runs if run.shape is not None}
    shapes = {name: load_shape(name.name, name.beside) for name in names}
    from workbench.twin import check_twin  # the simulation with it: what is misspelt is told before

    made = Experiment(asked, bench, model, shape, plan, parts, shapes)
    for beam in (shape, *shapes.values()):
        modes: list[Mode] = [run.mode for run in plan.runs if made.shape_of(run) is beam]
        check_twin(model.content, beam.content, modes)
    return made


def _first(
    read: Callable[[str, Path], T], own: tuple[str | None, Path], default: tuple[str, Path]
) -> T:
    """Read what the protocol names, else what the bench names, each beside its own file."""
    name, beside = own
    return read(*default) if name is None else read(name, beside)
