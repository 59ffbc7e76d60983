"""The live twin: the observer on the cameras' stream, in a process of its own, while a run goes on.

What lives here: the process (`worker.py`), a run's hold on it (`twin.py`), what the two say to each
other (`messages.py`), and when a prediction error stops a run (`verdict.py`). What does not: the
observer itself (`fit.online`), where the points are in a frame (`tracking.causal`), the recording
(`tracking.natnet_recorder`), the viewer (`report`), and the switching of the supply (`run.engine`).

To show one more number: one field of `LiveState`, filled in `worker.py`.
"""

from typing import TYPE_CHECKING

from workbench.live.messages import LiveState, LiveSummary, LiveTask
from workbench.live.twin import LiveTwin, NoTwin
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
