"""Takes: from the end of a run to the export that belongs to it.

Here live the waiting for an export (`collect.py`), the folder where exports appear (`folder.py`),
the export of a stream (`stream.py`), the check that an export is whole and of this run
(`belonging.py`), and what is asked of the person who exports it (`operator.py`). What does not:
reading an export (`tracking`), starting cameras (`bench`), making a track of it (`pairing`), those
who answer (`operators`).

To add a check: one function in `belonging.py` that returns a reason, and one test.
"""

from workbench.takes.belonging import CameraTime, TakeVerdict, judge
from workbench.takes.collect import Collector
from workbench.takes.folder import TakeFolder
from workbench.takes.operator import AnsweredAt, Operator
from workbench.takes.stream import write_stream

__all__ = [
    "AnsweredAt",
    "CameraTime",
    "Collector",
    "Operator",
    "TakeFolder",
    "TakeVerdict",
    "judge",
    "write_stream",
]
