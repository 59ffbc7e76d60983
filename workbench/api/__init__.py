"""The Python door: what the command line does, as functions and objects for scripts and notebooks.

`import workbench as wb` shows all of it. `runs` opens runs, by the words that every verb takes,
and hands out their series as tables.

No rule lives here: each function calls the room that owns the work, as the verb of the command line
does, and what it returns prints in about three lines. Nothing heavy is loaded before it is used. To
add a function: write it in the file of its noun, name it here and in `workbench/__init__.py`, and
show it in `docs/reference/python.md`, whose code a test runs.
"""

from workbench.api.runs import Run, Runs, open_run, open_runs
from workbench.api.simulation import Simulated, simulate

__all__ = ["Run", "Runs", "Simulated", "open_run", "open_runs", "simulate"]
