"""The whole identification of runs: fit, new model file, validation of that file, report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from workbench.bundle import Bundle
from workbench.fit import measured_runs, same_robot
from workbench.identify import (
    BEAM,
    Identification,
    Validation,
    identify,
    new_target,
    validate,
    write_model,
)
from workbench.progress import Progress, Stage, portion
from workbench.report.identification.fit_page import made_from, report_fit
from workbench.schemas import Document, ModelFile
from workbench.sim import make_robot

__all__ = ["Fitted", "fit_runs"]


@dataclass(frozen=True, eq=False, repr=False)
class Fitted:
    """What runs say of a model, and the files that are left of it.

    Args:
        found: the estimates with their 90 % intervals, and what is not determined.
        validation: nominal and fitted model on runs that were held out.
        model: the fitted one, as read back from its file.
        report: HTML page with figures.
    """

    found: Identification
    validation: Validation
    model: Document[ModelFile]
    report: Path

    def as_json(self) -> dict[str, object]:
        """Return parameters with intervals and units, validation and files."""
        found = self.found
        return {
            "parameters": {name: one.as_json() for name, one in found.estimates.items()},
            "within_tolerance": {n: one.as_json() for n, one in found.within_tolerance.items()},
            "not_determined": list(found.not_determined),
            "validation": self.validation.as_json(),
            "misfit": found.misfit,
            "process_noise": found.process_noise,
            "runs": [run.name for run in found.runs],
            "warnings": list(found.warnings),
            "model": str(self.model.path),
            "report": str(self.report),
        }

    def __repr__(self) -> str:
        """Return it in a few lines: each parameter with its interval, and the files."""
        return f"{self.found!r}\n  model: {self.model.path}, report: {self.report}"


def fit_runs(
    bundles: Sequence[Bundle],
    names: Sequence[str] = BEAM,
    out: Path | None = None,
    progress: Progress = lambda text: None,
) -> Fitted:
    """Fit parameters to runs with role train, and validate them on those held out.

    Args:
        bundles: of the runs; those that are not complete are left out.
        names: of the model's parameters.
        out: new model file; by default `models/MODEL-DAY.yaml`. Its report lies beside it.
        progress: called with each stage.

    Raises:
        InputError: when `out` exists, the runs are of several robots, none is complete, or a
            parameter does not exist.
    """
    stated, shape = same_robot(bundles)
    named = Path("models") / f"{stated.content.name}-{date.today().isoformat()}.yaml"
    target = new_target(out, named, _results)
    measured = measured_runs(bundles, progress)
    train = [run for run in measured if run.role == "train"]
    found = identify(
        train, stated.content, shape.content, names, progress=portion(progress, 0.05, 0.8)
    )
    used = tuple(run.name for run in found.runs)
    written = write_model(
        target, stated, found.values, found.every, used, date.today(), found.robot.increments
    )
    progress(Stage("validate on runs that the fit has not seen", 0.8))
    held = [run for run in measured if run.role == "held_out"]
    validation = validate(held, stated.content, written.content, shape.content)
    robot = make_robot(written.content.values(), shape.content, written.content.increments)
    whole = [bundle for bundle in bundles if bundle.manifest.status == "complete"]
    made = made_from(whole, stated, written)
    progress(Stage("draw the report", 0.95))
    report = report_fit(target.with_suffix(".html"), found, measured, robot, validation, made)
    return Fitted(found, validation, written, report)


def _results(target: Path) -> list[Path]:
    return [target, target.with_suffix(".html")]
