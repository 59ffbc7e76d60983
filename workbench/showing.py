"""Runs that are shown together: one recording, one picture of it, one page."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from workbench import review
from workbench.bundle import Bundle
from workbench.errors import InputError
from workbench.review import Comparison, ExperimentPage

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["Shown"]

_MOMENT = 0.8  # of the run: where a picture is taken


@dataclass(frozen=True)
class Shown:
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
            review.write_recording(self.comparisons[0], path)
        else:
            review.write_together(self.title, self.comparisons, path)
        return path

    def picture(self) -> Image:
        """Return the viewer's window with the recording.

        Raises:
            WorkbenchError: when the viewer does not start here.
        """
        with tempfile.TemporaryDirectory() as folder:
            recording = self.record(Path(folder) / "shown.rrd")
            return review.picture_recording(recording, _MOMENT * self.comparisons[0].duration_s)

    def write_page(self, path: Path, picture: Image | None) -> None:
        """Write the report of one run, or the page of several.

        Args:
            path: the `.html` file; one that is there is replaced.
            picture: of the viewer, where one could be taken.
        """
        jpeg = None if picture is None else review.as_jpeg(picture)
        if len(self.comparisons) == 1:
            review.write_report(self.comparisons[0], path, jpeg)
            return
        page = ExperimentPage(
            self.title,
            self._origin(),
            tuple(self.comparisons),
            tuple(_link(bundle.view("report"), path.parent) for bundle in self.bundles),
            self.command,
            jpeg,
        )
        review.write_experiment_page(page, path)

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
