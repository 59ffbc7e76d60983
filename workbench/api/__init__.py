"""The Python interface: what the command line does, for scripts and notebooks.

`import workbench as wb` shows all of it. `runs` opens runs by the words that every verb takes,
hands out their series as tables, fits and diagnoses them; `bench` makes runs, `simulation`
simulates, `searching` optimises a shape, `takes` reads exports of the cameras.

No rule lives here: each function calls the room that owns the work, as the verb of the command line
does, and what it returns prints in about three lines. Nothing heavy is loaded before it is used. To
add a function: write it in the file of its noun, name it here and in `workbench/__init__.py`, and
show it in `docs/reference/python.md`, whose code a test runs.
"""

from typing import TYPE_CHECKING

from workbench.api.bench import ingest_sheet, run_protocol
from workbench.api.runs import Run, Runs, open_run, open_runs
from workbench.api.searching import optimize_shape
from workbench.api.simulation import Simulated, simulate
from workbench.api.takes import read_take, take_quality
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
