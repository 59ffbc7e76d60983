"""Takes: from the end of a run to the export that belongs to it.

Here live the waiting for an export (`collect.py`), the folder where exports appear (`folder.py`),
the export of a stream (`stream.py`), the check that an export is whole and of this run
(`belonging.py`), and what is asked of the person who exports it (`operator.py`). What does not:
reading an export (`tracking`), starting cameras (`bench`), making a track of it (`twin`), those
who answer (`operators`).

To add a check: one function in `belonging.py` that returns a reason, and one test.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports
from workbench.run.takes.belonging import CameraTime, TakeVerdict, judge
from workbench.run.takes.collect import Collector
from workbench.run.takes.folder import TakeFolder
from workbench.run.takes.operator import AnsweredAt, Operator
from workbench.run.takes.stream import write_stream

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
