"""What a search found, as files: shapes for the twin and the template, models, the history."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml.comments import CommentedMap

from workbench.design.goals import GOALS
from workbench.design.study import Study
from workbench.design.variables import ANGLES, SPEED
from workbench.errors import WorkbenchError
from workbench.optimize import History, Trial, candidate_key
from workbench.schemas import ShapeFile, parse, write_changed

__all__ = ["DesignFiles", "found_by", "found_object", "shape_text", "write_history"]


@dataclass(frozen=True)
class DesignFiles:
    """A design as files.

    Args:
        name: generation and rank, `g12-best`; unique in its search.
        trial: the candidate and its evaluation.
        shape: of the beam.
        model: of the robot; None where only the angles were searched.
        omega: speed that it is for [rad/s].
    """

    name: str
    trial: Trial
    shape: Path
    model: Path | None
    omega: float

    @property
    def values(self) -> Mapping[str, float]:
        """The values of all goals by column, as the search saw them."""
        return self.trial.evaluation.numbers


def found_by(study: Study, history: History, day: date) -> list[DesignFiles]:
    """Write the best design, or those of the Pareto front, and return them, best first.

    A design is called by the generation that found it, `g12-best`, or `g12-3` for the third of its
    candidates that lies on the front: the same design is the same file. The candidate's hash is in
    the file's `source`.

    Args:
        study: that searched.
        history: of it.
        day: of the search, for the files' provenance.

    Raises:
        WorkbenchError: when there is no generation yet, or no candidate hopped to its end.
    """
    trials = [history.best] if len(study.settings.goals) == 1 else history.front()
    if not trials or history.best.evaluation.failure is not None:
        reasons = Counter(text for g in history.generations for text in g.failures)
        raise WorkbenchError(
            f"none of {history.asked} candidates hopped to its end; most often: "
            f"{reasons.most_common(1)[0][0]}; begin at another shape, or widen what is allowed"
        )
    return [_write(study, history, trial, day) for trial in trials]


def _write(study: Study, history: History, trial: Trial, day: date) -> DesignFiles:
    name = _name(study, history, trial)
    path = study.folder / f"shape-{name}.yaml"
    source = _source(study, history, trial, day)
    if not path.exists():
        named = f"{study.folder.name}-{name}"
        text = shape_text(study.start.content, named, trial.candidate[: len(ANGLES)], source)
        parse(path, text, ShapeFile)
        path.write_text(text, encoding="utf-8")
    numbers = dict(study.problem.numbers(trial.candidate))
    omega = numbers.pop(SPEED)
    model = study.folder / f"model-{name}.yaml" if numbers else None
    if model is not None and not model.exists():
        _write_model(model, name, study, numbers, source)
    return DesignFiles(name, trial, path, model, omega)


def _name(study: Study, history: History, trial: Trial) -> str:
    """Return what a design is called: where in the search it was found first."""
    for number, generation in enumerate(history.generations, start=1):
        for position, one in enumerate(generation.trials, start=1):
            if np.array_equal(one.candidate, trial.candidate):
                rank = "best" if len(study.settings.goals) == 1 else position
                return f"g{number}-{rank}"
    raise ValueError("this candidate was not asked for in this search")


def shape_text(start: ShapeFile, name: str, angles: np.ndarray, source: str) -> str:
    """Return a shape file that differs from another in its angles, name and source.

    Args:
        start: whose strip it is.
        name: of the new shape.
        angles: (16,) alpha_0 to alpha_15 [rad], written so that they are read back bit for bit.
        source: where they come from.
    """
    numbers = [repr(float(angle)) for angle in angles]
    lines = [
        "schema: workbench/shape-1",
        f"name: {name}",
        f"angles: [{', '.join(numbers[:8])},",
        f"         {', '.join(numbers[8:])}]",
        f"length: {1e3 * start.length:.12g} mm",
    ]
    for key, size in (("thickness", start.thickness), ("width", start.width)):
        if size is not None:
            lines.append(f"{key}: {1e3 * size:.12g} mm")
    quoted = source.replace("\\", "\\\\").replace('"', '\\"')
    return "\n".join([*lines, f"state: {start.state}", f'source: "{quoted}"', ""])


def _source(study: Study, history: History, trial: Trial, day: date) -> str:
    settings, numbers = study.settings, trial.evaluation.numbers
    values = ", ".join(
        f"{goal.column} {numbers[goal.column]:.4g}"
        for goal in study.problem.goals
        if goal.column in numbers
    )
    varied = study.problem.numbers(trial.candidate)
    varied_text = ", ".join(f"{name} {value:.6g}" for name, value in varied.items())
    key = candidate_key(study.problem.identity, trial.candidate)[:8]
    return (
        f"designed {day.isoformat()} by {settings.algorithm}, seed {settings.seed}, "
        f"{history.asked} evaluations: {study.problem.identity}; {values}; {varied_text}; begun at "
        f"{study.start.content.name}, model {study.model.content.name}; candidate {key}"
    )


def _write_model(
    path: Path, found: str, study: Study, numbers: Mapping[str, float], source: str
) -> None:
    def change(tree: CommentedMap) -> None:
        tree["name"] = f"{study.folder.name}-{found}"
        for name, value in numbers.items():
            entry = tree["parameters"][name]
            entry["source"] = f"{source}; was {entry['value']:g}: {entry['source']}"
            entry["value"] = value

    write_changed(path, study.model, "model", change)


def write_history(path: Path, study: Study, history: History) -> None:
    """Write every trial as a row of CSV: generation, variables, fitness, values, failure."""
    goals = study.settings.goals
    head = ["generation", *history.names, *(f"fitness_{name}" for name in goals)]
    columns = [goal.column for goal in GOALS.values()]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*head, *columns, "failure"])
        for k, generation in enumerate(history.generations, 1):
            for trial in generation.trials:
                found = trial.evaluation
                values = [found.numbers.get(name, "") for name in columns]
                row = [k, *trial.candidate.tolist(), *found.fitness, *values, found.failure or ""]
                writer.writerow(row)


def found_object(study: Study, history: History, found: Sequence[DesignFiles]) -> dict[str, Any]:
    """Return what a search found under names with units, for the command line."""
    best = found[0]
    table = history.columns()
    goal = study.problem.goals[0]
    return {
        "best_distance_m": best.values.get("distance_m"),
        "best_shape": str(best.shape),
        "best_model": None if best.model is None else str(best.model),
        "omega_rad_s": best.omega,
        "goals": {g.name: best.values.get(g.column) for g in study.problem.goals},
        "evaluations": history.asked,
        "simulated": history.evaluated,
        "generations": len(history.generations),
        "failures": int(table["failures"].sum()),
        "history": [
            {"best": goal.value_of(best_fitness), "mean": goal.value_of(mean), "failures": int(bad)}
            for best_fitness, mean, bad in zip(
                table["best so far"], table["mean"], table["failures"], strict=True
            )
        ],
        "front": [
            {"shape": str(one.shape)} | {g.name: one.values[g.column] for g in study.problem.goals}
            for one in found
        ]
        if len(study.problem.goals) > 1
        else None,
        "folder": str(study.folder),
    }
