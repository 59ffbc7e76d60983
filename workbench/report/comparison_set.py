"""What is shown of runs: the views of one, one beside an extended model's twin, several together.

The views of a run are drawn from its bundle, once it is sealed: a viewer that does not work costs a
picture and no run.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from workbench import report as views
from workbench.bundle import Bundle, View, sha256
from workbench.catalogue import Query, beside_earlier, search
from workbench.errors import InputError
from workbench.fit import compared, measured_run, paced, predictions, replayed
from workbench.report.comparison import Comparison, Extended, Replayed, ValidationReplay
from workbench.report.experiment_page import ExperimentPage
from workbench.report.load_run import load_any, load_comparison
from workbench.schemas import Document, ModelFile, ShapeFile, load
from workbench.twin import other_twin, robot_of

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["ComparisonSet", "compare_extended", "write_views"]

_MOMENT = 0.8  # of the run: where a picture is taken
_DRAW: dict[View, Callable[[Bundle, Comparison, Path], None]] = {
    "recording": lambda _, comparison, path: views.write_recording(comparison, path),
    "report": lambda bundle, comparison, path: views.write_report(
        comparison, path, None, _beside(bundle)
    ),
}
_REPLAY_TEXT = (
    "Both models start as the robot did, and their rotors turn as it was seen to turn. Base is the "
    "model that the run was made with; a diagnosis refits it before it compares."
)
_LATER: dict[View, str] = {"recording": "--save", "report": "--page"}
"""Option of `workbench review` that draws a view."""


def write_views(bundle: Bundle) -> str | None:
    """Draw the recording and the report of a sealed run into its bundle.

    Whatever keeps one from being drawn costs that one alone; only an interrupt passes.

    Returns:
        What could not be drawn, why, and the command that draws it, in one line; None when all is
        there.
    """
    why: dict[View, str] = {}
    comparison: Comparison | None = None
    for kind, draw in _DRAW.items():
        try:
            comparison = comparison or load_any(bundle)
            bundle.write_view(kind, partial(draw, bundle, comparison))
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:  # a panic inside rerun is no Exception
            why[kind] = " ".join(f"{type(error).__name__}: {error}".split())
    return _not_drawn(bundle, why) if why else None


def _beside(bundle: Bundle) -> str:
    """Return how a run compares with the last ones of its condition in the folder of its runs."""
    found = search(bundle.path.parent, Query(), lambda _: None)
    return beside_earlier(found.entries, bundle.path.name)


def _not_drawn(bundle: Bundle, why: Mapping[View, str]) -> str:
    """Return what could not be drawn, why, and the command that draws it."""
    names = " and ".join(bundle.view(kind).name for kind in why)
    later = " ".join(f"{_LATER[kind]} {bundle.view(kind)}" for kind in why)
    return (
        f"{names} could not be drawn ({'; '.join(dict.fromkeys(why.values()))}); the run is whole "
        f"without; draw later: workbench review {bundle.path} {later}"
    )


def compare_extended(
    bundle: Bundle, model: Document[ModelFile], validation: ValidationReplay | None = None
) -> Comparison:
    """Compare a run with its twin and with that of an extended model; nothing is written.

    The extended twin gets the same commands. Where the pull or height was found in the data, it is
    found anew with the extended model.

    Args:
        bundle: of the run.
        model: the extended one.
        validation: both models as a diagnosis compared them; else the run's model and the extended
            one are simulated as a diagnosis would.

    Raises:
        TakeError, InputError, WorkbenchError: as `pair`, for either model.
    """
    comparison, name = load_comparison(bundle), model.content.name
    twin = other_twin(bundle, model.content)
    return replace(
        comparison,
        validation=validation or _replayed(bundle, model.content),
        extended=Extended(name, twin.motion, twin.summary, twin.misfit),
        facts={**comparison.facts, "extended model": f"{name} ({sha256(model.path)[:12]})"},
        warnings=(*comparison.warnings, *twin.warnings),
    )


def _replayed(bundle: Bundle, model: ModelFile) -> ValidationReplay | None:
    """Return the run's own model and an extended one, started and turned as was measured."""
    own_model = load(bundle.document("model"), ModelFile).content
    shape = load(bundle.document("shape"), ShapeFile).content
    try:
        run = paced(measured_run(bundle))
        part = compared(run)
        robots = {
            "the run's own model": robot_of(own_model, shape),
            model.name: robot_of(model, shape),
        }
        found = {name: replayed(robot, part) for name, robot in robots.items()}
    except InputError:
        return None  # what cannot be observed is shown as commanded
    base, extended = (
        Replayed(name, one.motion, one.error, one.rms_mm, predictions(robots[name], run))
        for name, one in found.items()
    )
    noise = next(iter(found.values())).noise_mm
    return ValidationReplay(base, extended, noise, float(base.error.times[-1]), _REPLAY_TEXT)


@dataclass(frozen=True)
class ComparisonSet:
    """Runs that are shown together.

    Args:
        bundles: of the runs.
        comparisons: what is shown of each.
    """

    bundles: Sequence[Bundle]
    comparisons: Sequence[Comparison]

    @property
    def title(self) -> str:
        """Return the titles of their protocols."""
        return " / ".join(dict.fromkeys(one.title for one in self.comparisons))

    @property
    def command(self) -> str:
        """Return the command that shows these runs."""
        every = [bundle.asked for bundle in self.bundles]
        experiments = {one.experiment for one in every}
        numbers = {one.number for one in every}
        whole = len(experiments) == 1 and len(numbers) == every[0].of
        if len(every) > 1 and whole and None not in experiments:
            return f"workbench review {experiments.pop()}"
        return f"workbench review {' '.join(one.run for one in self.comparisons)}"

    def only(self) -> Comparison:
        """Return the one run.

        Raises:
            InputError: when there are several.
        """
        if len(self.comparisons) > 1:
            names = ", ".join(one.run for one in self.comparisons[:3])
            raise InputError(
                f"a film shows one run and {len(self.comparisons)} were named; name one: {names}"
                f"{', ...' if len(self.comparisons) > 3 else ''}"
            )
        return self.comparisons[0]

    def record(self, path: Path) -> Path:
        """Write the recording and return its path."""
        if len(self.comparisons) == 1:
            views.write_recording(self.comparisons[0], path)
        else:
            views.write_together(self.title, self.comparisons, path)
        return path

    def picture(self) -> Image:
        """Return the viewer's window with the recording.

        Raises:
            WorkbenchError: when the viewer does not start here.
        """
        with tempfile.TemporaryDirectory() as folder:
            recording = self.record(Path(folder) / "shown.rrd")
            return views.picture_recording(recording, _MOMENT * self.comparisons[0].duration_s)

    def write_page(self, path: Path, picture: Image | None) -> None:
        """Write the report of one run, or the page of several.

        Args:
            path: the `.html` file; one that is there is replaced.
            picture: of the viewer, where one could be taken.
        """
        jpeg = None if picture is None else views.as_jpeg(picture)
        if len(self.comparisons) == 1:
            views.write_report(self.comparisons[0], path, jpeg)
            return
        page = ExperimentPage(
            self.title,
            self._origin(),
            tuple(self.comparisons),
            tuple(_link(bundle.view("report"), path.parent) for bundle in self.bundles),
            self.command,
            jpeg,
        )
        views.write_experiment_page(page, path)

    def _origin(self) -> str:
        """Return from which protocols, or sheets, the runs are."""
        every = [bundle.asked for bundle in self.bundles]
        origins = [
            f"{one.protocol or one.sheet}, {one.experiment or 'measured elsewhere'}"
            for one in every
        ]
        return "; ".join(dict.fromkeys(origins))


def _link(report: Path, folder: Path) -> str:
    """Return the link from a folder to a report, empty where there is none."""
    if not report.exists():
        return ""
    try:
        return Path(os.path.relpath(report, folder)).as_posix()
    except ValueError:  # on another drive
        return report.resolve().as_uri()
