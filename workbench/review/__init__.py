"""The review of runs: robots and their twins side by side, and the twin of an extended model.

Here live the recording for the viewer (the only room that imports rerun), `recording` of one run,
`lanes` of several; the report of a run and the page of an experiment for paper and browser; and the
helper that looks at a recording without a window. Not here: where files lie
(`bundle`), what distance or misfit mean (`motion`), what the twin computes (`sim`). Everything is
made from one value a run, a `Comparison`, and can be made again from it.

To add a section to the report, write it in `sections.py` and name it in `SECTIONS` there; to add a
curve to the recording, send it in `curves.py` and give it a view in `layout.py`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from workbench.review.comparison import (
    Comparison,
    ErrorSources,
    Extended,
    Figure,
    Phase,
    PredictionError,
    Replayed,
    ValidationReplay,
)
from workbench.review.experiment_page import ExperimentPage, write_experiment_page
from workbench.review.report import write_report
from workbench.review.watch import LiveViewer

if TYPE_CHECKING:
    from workbench.review.picture import as_jpeg, picture_recording
    from workbench.review.recording import write_recording, write_together
    from workbench.review.viewer import HeadlessViewer, open_viewer, viewer_version

__all__ = [
    "Comparison",
    "ErrorSources",
    "ExperimentPage",
    "Extended",
    "Figure",
    "HeadlessViewer",
    "LiveViewer",
    "Phase",
    "PredictionError",
    "Replayed",
    "ValidationReplay",
    "as_jpeg",
    "open_viewer",
    "picture_recording",
    "viewer_version",
    "write_experiment_page",
    "write_recording",
    "write_report",
    "write_together",
]

_WITH_RERUN = {
    "as_jpeg": "picture",
    "picture_recording": "picture",
    "write_recording": "recording",
    "write_together": "recording",
    "HeadlessViewer": "viewer",
    "open_viewer": "viewer",
    "viewer_version": "viewer",
}
"""What is loaded when it is asked for, as its file loads rerun: a run needs no viewer."""


def __getattr__(name: str) -> Any:
    if name in _WITH_RERUN:
        return getattr(import_module(f"{__name__}.{_WITH_RERUN[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
