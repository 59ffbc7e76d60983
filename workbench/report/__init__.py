"""Reports: recordings, pages, films and figures; nothing below this room draws.

Here live the recording for the viewer (the only room that imports rerun), `recording` of one run,
`lanes` of several; the report of a run and the page of an experiment for paper and browser; and the
helper that looks at a recording without a window. `load_run` makes a `Comparison`, the one value
that all of this is drawn from, of what a bundle keeps; `comparison_set` is what is shown of one run
or several. `film/` renders runs through MuJoCo.

`identification/`, `diagnosis/`, `design/` and `as_built/` are the pages and figures of those rooms,
with the whole work of a verb up to its page: `fit_runs`, `diagnose_into`, `finish_search`.

Not here: where files of a run lie (`bundle`), what distance or misfit mean (`motion`), what the
twin computes (`sim`). To add a section to the report of a run, write it in `sections.py` and name
it in `SECTIONS` there; to add a curve to the recording, send it in `curves.py` and give it a view
in `layout.py`. Names are loaded when they are used.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports

if TYPE_CHECKING:
    from workbench.report.as_built.figure import deviation_figure
    from workbench.report.as_built.page import change_in_words, write_readback
    from workbench.report.comparison import (
        Comparison,
        ErrorSources,
        Extended,
        Figure,
        Phase,
        PredictionError,
        Replayed,
        ValidationReplay,
    )
    from workbench.report.comparison_set import ComparisonSet, compare_extended, write_views
    from workbench.report.design.experiments import (
        EXPERIMENTS,
        SEEDS,
        SPEEDS,
        ExperimentFigure,
        ExperimentTable,
        Lab,
        Part,
    )
    from workbench.report.design.page import verdict, write_experiment
    from workbench.report.design.searched import Searched, finish_search, search_folder
    from workbench.report.diagnosis.compared import kept_replay, replay_of
    from workbench.report.diagnosis.page import write_diagnosis
    from workbench.report.diagnosis.tables import finer_beam
    from workbench.report.diagnosis.written import diagnose_into
    from workbench.report.experiment_page import ExperimentPage, write_experiment_page
    from workbench.report.film.files import write_frames, write_video
    from workbench.report.film.frames import Film
    from workbench.report.headline import validation_rows
    from workbench.report.identification.calibration_figure import figure_5_3
    from workbench.report.identification.fitted import Fitted, fit_runs
    from workbench.report.identification.page import (
        ReportPart,
        write_identification,
        write_resonances,
    )
    from workbench.report.load_run import load_any
    from workbench.report.picture import as_jpeg, picture_recording
    from workbench.report.recording import write_recording, write_together
    from workbench.report.report import write_report
    from workbench.report.viewer import HeadlessViewer, open_viewer, viewer_version
    from workbench.report.watch import LiveViewer

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
