"""What to run next: the runs that separate what an answer leaves open, and the loop of both.

`remaining` is what a diagnosis leaves open, `proposed` a run that may be made, `hypothetical` what
it would look like, `predicted` how far the hypotheses part there. `next_experiment` chooses,
`drive_runs` for causes of the drive; `next_protocol` is the menu of a bench and the file.
`investigation` is the loop of runs and diagnoses, `closed_loop` that loop on a bench; `diagnosed`
is all that is left in a folder, which `report` draws and writes.
"""

from typing import TYPE_CHECKING

from workbench.investigate.closed_loop import BenchJob, ClosedLoop
from workbench.investigate.diagnosed import Diagnosed
from workbench.investigate.investigation import Round, investigate
from workbench.investigate.next_experiment import propose
from workbench.investigate.next_protocol import MENU, Following, following, next_object
from workbench.investigate.proposed import Proposal, ProposedRun, minutes_of
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
