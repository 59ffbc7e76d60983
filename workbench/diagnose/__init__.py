"""Diagnosis: what the simulation gets wrong, by which cause, how surely, and what is gained.

One algorithm: `diagnosis` calls it. `rig` is what it asks of a mechanical system, and the hopping
robot as one; `mechanism` is any MJCF with a rig file (`mechanism_causes` its candidates,
`mechanism_names`, `mechanism_table`, `mechanism_runs` and `mechanism_files` read the file).
`candidates` lists what may be other than the robot's model says. `fits` fits hypotheses by the
observer of `workbench.fit`, `linear` says what each candidate promises beside a fit, `drive` judges
the motor by the rotor's angle alone, `held_out` says how likely runs are that no fit has seen.
`decide` turns them into an answer, by the numbers in `rules`; `observer_part` and `drive_part` call
it, `findings` is what an answer lists. `extension` writes the model, `validate` judges the file by
runs held out.

Before any fit `soundness` leaves out runs that are not what they are said to be: `hopper_faults`
puts `drive_faults`, `body_faults` and `release_faults` together, `onset` says when something
began. A new check is a function there that yields a sentence.

`missing` says which force is missing, and what it depends on; `kept` is the answer as a file, and
`diagnosed` all that is left in a folder, which `report` draws and writes. Then:
`remaining` is what an answer leaves, `next_experiment` the runs that would separate it,
`next_protocol` the menu of a bench and the file, `investigation` the loop of runs and diagnoses,
`closed_loop` that loop on a bench.
"""

from typing import TYPE_CHECKING

from workbench.diagnose.closed_loop import BenchJob, ClosedLoop
from workbench.diagnose.decide import Kind, Part
from workbench.diagnose.diagnosed import Diagnosed
from workbench.diagnose.diagnosis import Diagnosis, diagnose
from workbench.diagnose.drive import DRIVE
from workbench.diagnose.facts import ProposedRun
from workbench.diagnose.investigation import Round, investigate
from workbench.diagnose.kept import extended_model_of, read_answer, write_answer
from workbench.diagnose.mechanism import MechanismRig, load_mechanism
from workbench.diagnose.missing import ABSENT, Dependence, MissingForceAnalysis, missing_force
from workbench.diagnose.next_experiment import propose
from workbench.diagnose.next_protocol import MENU, Following, following, next_object
from workbench.diagnose.proposed import Proposal, minutes_of
from workbench.diagnose.rig import HopperRig, Rig, robot_of
from workbench.diagnose.rules import Rules
from workbench.diagnose.soundness import refused
from workbench.diagnose.validate import Errors, root_mean_square
from workbench.diagnose.wording import Amount, digits, together
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
