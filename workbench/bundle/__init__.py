"""The bundle: the folder that holds one run. Only this room knows its file names.

    manifest.json     what the run was and how it ended; its status starts as `failed`
    protocol.yaml     as given            protocol.json   as resolved
    bench.yaml, model.yaml, shape.yaml    as used
    calibration.yaml  where the bench names one
    journal.jsonl     one event a line, on disk before the next step is taken
    wire.log          every exchange with the supply
    guardian.jsonl    what the supply's guardian did; it goes on where the run was killed
    take/             the export, byte for byte
    supply.parquet, raw.parquet, track.parquet, twin.parquet
    state.parquet     the estimated pose and the missing force, where the run could be observed
    checksums.txt     sha256 of every file above, and of itself
    remarks.jsonl     what people said of the run since: tags, notes, good or bad
    compare.rrd, report.html              views, drawn from the rest once it is sealed

Nothing in it is overwritten once the run is finished, but for the views: they are no part of the
seal, and may be missing or drawn anew at any time. A run whose take is missing is not finished: the
take can be added later. Remarks are only ever appended, and each line carries its own sha256.

`sentences` puts an event of the journal into words; `judgement` says whether results lie where the
protocol expects them.

A `Bundle` is the folder with its documents, take and views (`folder.py`). Its `record` is what is
written while the run goes on: the typed manifest (`manifest.py`), the journal of typed events
(`events.py`) and the supply's logs. Its `series` are the Parquet files.

`named.py` says which runs are meant by what a person types, the same for every verb.

Not here: searching many bundles (`catalogue`), what the numbers mean (`motion`). To keep another
fact, give it a field in `manifest.py`; another event, a class in `events.py`; another file, a name
in `names.py` and a method in `folder.py`; to check one more kind of damage, a line in `damage.py`.
Numpy and pyarrow are loaded with the first time series only, so that thousands of bundles can be
listed at once.
"""

from typing import TYPE_CHECKING

from workbench.bundle import events
from workbench.bundle.damage import verify
from workbench.bundle.events import Event, Logged, parse_line
from workbench.bundle.finding import bundle_names
from workbench.bundle.folder import Bundle, Document, View
from workbench.bundle.inside import Contents, contents, foreign, unportable
from workbench.bundle.judgement import Judgement, judgements, passed
from workbench.bundle.manifest import (
    Alignment,
    AnswerFact,
    Asked,
    CameraWindow,
    ChannelFacts,
    Clocks,
    CommandFacts,
    Compared,
    DelayFacts,
    Driven,
    FloorFacts,
    Manifest,
    Measured,
    ObserverFacts,
    Released,
    ReleaseFacts,
    RotorSpeedFacts,
    SignalFacts,
    Status,
    SupplyIdentity,
    Swung,
    TrackFacts,
)
from workbench.bundle.named import run_named, runs_named, runs_of
from workbench.bundle.record import Record, WireMessage
from workbench.bundle.remarks import Kind, Remark, Remarks, Verdict, add_remark, read_remarks
from workbench.bundle.sealing import sha256
from workbench.bundle.sentences import condition_words, sentence
from workbench.bundle.series import Series, SeriesFiles, read_series, write_series
from workbench.bundle.stamp import Stamp, stamping
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
