"""A search in its folder: what was asked, how far it is, how it goes on.

The folder holds `settings.json`, copies of the model and of the first shape, and the checkpoint
`search.json`. Together they are all that going on needs, on any machine.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter, ValidationError

from workbench.design.bendable import LEAST_RADIUS_M
from workbench.design.description import Description
from workbench.design.goals import PENALTY, goal_named
from workbench.design.objective import Objective
from workbench.design.problem import Problem
from workbench.design.search_stage import search_stage
from workbench.design.uncertainty import Uncertainty
from workbench.design.variables import BOUNDS, parse_varied
from workbench.errors import InputError, require_named
from workbench.optimize import (
    Algorithm,
    Cmaes,
    GeneticAlgorithm,
    GeneticOptions,
    Guided,
    History,
    Pareto,
    search,
)
from workbench.progress import Progress
from workbench.schemas import UNITS, Document, ModelFile, ShapeFile, load_model, load_shape
from workbench.sim import Fanout

__all__ = ["ALGORITHMS", "MUTATIONS", "Settings", "Study"]

_SCHEMA = "workbench/optimize-1"
_SETTINGS, _CHECKPOINT = "settings.json", "search.json"
_MODEL, _START = "model.yaml", "start.yaml"

MUTATIONS: dict[str, Literal["mutationadaptfeasible", "mutationgaussian"]] = {
    "adaptfeasible": "mutationadaptfeasible",
    "gaussian": "mutationgaussian",
}
"""Section 5.2.2 of the thesis names the first, its Appendix E the second."""


@dataclass(frozen=True)
class Settings:
    """What was asked of a search.

    Args:
        omega: speed of the rotor [rad/s].
        duration: of a hop [s].
        algorithm: one of `ALGORITHMS`.
        goals: names, one, or two for a Pareto front.
        bounds: name in `BOUNDS`.
        vary: variables beside the angles, each as `NAME=LOWER:UPPER`.
        robust: whether candidates are judged by mean and spread over what the robot may be.
        draws: robots simulated for one candidate of a robust search.
        seed: of all that is random.
        evaluations: candidates that may be asked for.
        mutation: of the genetic algorithm, one of `MUTATIONS`.
        thickness: of the strip [m]; None takes the shape's.
        least_radius: the tightest bend [m].
    """

    omega: float = 17.0
    duration: float = 10.0
    algorithm: str = "guided"
    goals: tuple[str, ...] = ("distance",)
    bounds: str = "thesis"
    vary: tuple[str, ...] = ()
    robust: bool = False
    draws: int = 8
    seed: int = 0
    evaluations: int = 480
    mutation: str = "adaptfeasible"
    thickness: float | None = None
    least_radius: float = LEAST_RADIUS_M

    def __post_init__(self) -> None:
        """Refuse names that do not exist and goals that do not fit the algorithm."""
        for kind, name, known in (
            ("algorithm", self.algorithm, ALGORITHMS),
            ("bounds", self.bounds, BOUNDS),
            ("mutation", self.mutation, MUTATIONS),
        ):
            require_named(kind, name, known)
        wanted = 2 if self.algorithm == "pareto" else 1
        if len(self.goals) != wanted or len(set(self.goals)) != wanted:
            raise InputError(
                f"--algorithm {self.algorithm} takes {wanted} goal(s), {len(self.goals)} "
                f"({', '.join(self.goals)}) are given; two different goals go with "
                "--algorithm pareto"
            )

    def problem(self, model: ModelFile, shape: ShapeFile) -> Problem:
        """Return what is searched for.

        Raises:
            InputError: when a name does not exist or a number is not possible.
        """
        tolerances = {name: getattr(model.parameters, name).tolerance for name in UNITS}
        return Problem(
            model,
            shape,
            self.omega,
            self.duration,
            tuple(goal_named(name) for name in self.goals),
            BOUNDS[self.bounds],
            tuple(parse_varied(text) for text in self.vary),
            Uncertainty(tolerances, self.draws, self.seed) if self.robust else None,
            self.thickness,
            self.least_radius,
        )


def _ga(objective: Objective, settings: Settings) -> Algorithm:
    options = GeneticOptions(mutation_fcn=MUTATIONS[settings.mutation])
    if settings.mutation == "gaussian":  # which shrinks until the last generation
        last = max(1, settings.evaluations // options.population_size)
        options = replace(options, generations=last)
    return GeneticAlgorithm(objective.problem.space, settings.seed, options)


def _guided(objective: Objective, settings: Settings) -> Algorithm:
    problem = objective.problem
    describe = Description(problem)
    return Guided(
        problem.space, settings.seed, describe, objective.bendable, describe.rings_near_drive
    )


def _cma(objective: Objective, settings: Settings) -> Algorithm:
    return Cmaes(objective.problem.space, settings.seed)


def _pareto(objective: Objective, settings: Settings) -> Algorithm:
    return Pareto(objective.problem.space, settings.seed, len(settings.goals))


ALGORITHMS: dict[str, Callable[[Objective, Settings], Algorithm]] = {
    "guided": _guided,
    "cma": _cma,
    "ga": _ga,
    "pareto": _pareto,
}
"""Name -> what makes the algorithm."""


@dataclass(frozen=True)
class Study:
    """A search in its folder.

    Args:
        folder: of all its files.
        settings: what was asked.
        model: of the robot.
        start: the shape where it begins.
    """

    folder: Path
    settings: Settings
    model: Document[ModelFile]
    start: Document[ShapeFile]

    @classmethod
    def begin(
        cls,
        folder: Path,
        settings: Settings,
        model: Document[ModelFile],
        start: Document[ShapeFile],
    ) -> Study:
        """Lay out the folder of a new search.

        Raises:
            InputError: when the folder holds a search already, or nothing can be searched so.
        """
        if (folder / _SETTINGS).exists():
            raise InputError(
                f"{folder}: holds a search already; go on with --resume {folder}, or give another "
                "--out"
            )
        study = cls(folder, settings, model, start)
        _ = study.problem.space  # whatever is wrong with it is reported before a file is written
        folder.mkdir(parents=True, exist_ok=True)
        (folder / _MODEL).write_text(model.text, encoding="utf-8")
        (folder / _START).write_text(start.text, encoding="utf-8")
        text = json.dumps({"schema": _SCHEMA} | asdict(settings), indent=2)
        (folder / _SETTINGS).write_text(text + "\n", encoding="utf-8")
        return study

    @classmethod
    def resume(cls, path: Path) -> Study:
        """Return the search of a folder, or of a file in it.

        Raises:
            InputError: when there is none, or its settings cannot be read.
        """
        folder = path if path.is_dir() else path.parent
        if not (folder / _SETTINGS).exists():
            raise InputError(
                f"{path}: no search to go on with; its folder has no {_SETTINGS}. Name the folder "
                "of a search, as `workbench optimize` makes them below searches"
            )
        settings = _read(folder / _SETTINGS)
        model = load_model(str(folder / _MODEL), Path())
        return cls(folder, settings, model, load_shape(str(folder / _START), Path()))

    @cached_property
    def problem(self) -> Problem:
        """What is searched for."""
        return self.settings.problem(self.model.content, self.start.content)

    @property
    def checkpoint(self) -> Path:
        """The file that the search goes on from."""
        return self.folder / _CHECKPOINT

    def run(self, fanout: Fanout, progress: Progress = lambda text: None) -> History:
        """Search, or go on, until the evaluations are used up.

        Args:
            fanout: what simulates.
            progress: receives how far the search is after each generation.

        Raises:
            InputError: when the checkpoint is of another search, torn or edited.
            WorkbenchError: when the cluster is lost; the checkpoint is whole.
        """
        objective = Objective(self.problem, fanout)
        return search(
            self.problem.identity,
            ALGORITHMS[self.settings.algorithm](objective, self.settings),
            objective,
            evaluations=self.settings.evaluations,
            penalty=(PENALTY,) * len(self.settings.goals),
            checkpoint=self.checkpoint,
            watch=lambda history, total: progress(
                search_stage(self.problem.goals[0], history, total)
            ),
        )


def _read(path: Path) -> Settings:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(found, dict) or found.pop("schema", None) != _SCHEMA:
            raise ValueError(f"its schema is not {_SCHEMA}")
        known = {field.name for field in fields(Settings)}
        if set(found) != known:
            raise ValueError(f"keys {', '.join(sorted(set(found) ^ known))} are missing or unknown")
        return TypeAdapter(Settings).validate_python(found)
    except ValidationError as error:
        why = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())
    except (OSError, ValueError) as error:
        why = str(error)
    raise InputError(f"{path}: settings of no search, {why}; take another folder, or search anew")
