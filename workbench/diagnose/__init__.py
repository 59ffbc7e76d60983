"""Diagnosis: what the simulation gets wrong, by which cause, how surely, and what is gained.

One algorithm: `diagnosis` calls it. `rig` is what it asks of a mechanical system, and the hopping
robot as one; any other machine is one of `workbench.mechanism`. `candidates` lists what may be
other than the robot's model says. `fits` fits hypotheses by the observer of `workbench.fit`,
`landing` does so where feet land, `screening` says what each candidate promises beside a fit,
`drive` judges the motor by the rotor's angle alone, `held_out` says how likely runs are that no fit
has seen. `decide` turns them into an answer, by the numbers in `rules`; `observer_part` and
`drive_part` call it. `observer_parts` asks the observer of runs whose foot is held, by the mesh of
the beam that `mesh` chooses, then of hops; `findings` is what an answer lists. `extension` writes
the model, `validate` judges the file by runs held out. `missing` says which force is missing, and
what it depends on; `kept` is the answer as a file.

Runs that are not what they are said to be are left out before (`workbench.data_quality`); what to
run next, `workbench.investigate` says.
"""

from typing import TYPE_CHECKING

from workbench.diagnose.candidates import Candidate
from workbench.diagnose.decide import Kind, Part, Scored, versus
from workbench.diagnose.diagnosis import Diagnosis, diagnose
from workbench.diagnose.drive import DRIVE
from workbench.diagnose.drive_part import DrivePart
from workbench.diagnose.extension import Effects, entries
from workbench.diagnose.findings import Cause
from workbench.diagnose.hypothesis import Hypothesis
from workbench.diagnose.kept import extended_model_of, read_answer, write_answer
from workbench.diagnose.missing import ABSENT, Dependence, MissingForceAnalysis, missing_force
from workbench.diagnose.observer_part import ObserverPart
from workbench.diagnose.rig import HopperRig, Rig, robot_of
from workbench.diagnose.rules import RULES_OF_RIGS, Rules
from workbench.diagnose.validate import Errors, root_mean_square
from workbench.diagnose.wording import Amount, digits, together
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
