"""The review of a run: the robot and its twin side by side, and the twin of an extended model.

Here live the recording for the viewer (the only room that imports rerun), the report for paper and
browser, and the helper that looks at a recording without a window. Not here: where files lie
(`bundle`), what distance or misfit mean (`motion`), what the twin computes (`sim`). Everything is
made from one value, a `Comparison`, and can be made again from it.

To add a section to the report, write it in `sections.py` and name it in `SECTIONS` there; to add a
curve to the recording, send it in `recording.py` and give it a view in `layout.py`.
"""

from workbench.review.comparison import Comparison, Extended, Figure, Phase
from workbench.review.headline import QUANTITIES
from workbench.review.recording import write_recording
from workbench.review.report import write_report
from workbench.review.viewer import HeadlessViewer, open_viewer, viewer_version

__all__ = [
    "QUANTITIES",
    "Comparison",
    "Extended",
    "Figure",
    "HeadlessViewer",
    "Phase",
    "open_viewer",
    "viewer_version",
    "write_recording",
    "write_report",
]
