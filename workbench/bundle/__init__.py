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
    compare.rrd, report.html              views, made again from the rest at any time
    checksums.txt     sha256 of every file above, and of itself
    remarks.jsonl     what people said of the run since: tags, notes, good or bad

Nothing in it is overwritten once the run is finished, but for the views. A run whose take is
missing is not finished: the take can be added later. Remarks are only ever appended, and each line
carries its own sha256.

Not here: searching many bundles (`catalogue`), what the numbers mean (`motion`). To keep another
file in a bundle, give it a name in `names.py` and a method in `folder.py`; to check one more kind
of damage, a line in `damage.py`. Numpy and pyarrow are loaded with the first time series only, so
that thousands of bundles can be listed at once.
"""

from workbench.bundle.damage import damaged_files, verify
from workbench.bundle.finding import bundle_names, find_folder
from workbench.bundle.folder import Bundle, Document, Series, Status, View
from workbench.bundle.inside import Contents, contents, foreign, unportable
from workbench.bundle.remarks import Kind, Remark, Remarks, Verdict, add_remark, read_remarks
from workbench.bundle.sealing import sha256
from workbench.bundle.stamp import Stamp, stamping

__all__ = [
    "Bundle",
    "Contents",
    "Document",
    "Kind",
    "Remark",
    "Remarks",
    "Series",
    "Stamp",
    "Status",
    "Verdict",
    "View",
    "add_remark",
    "bundle_names",
    "contents",
    "damaged_files",
    "find_folder",
    "foreign",
    "read_remarks",
    "sha256",
    "stamping",
    "unportable",
    "verify",
]
