"""Diagnosis: what the simulation gets wrong, by which cause, how surely, and what is gained.

`rig` is the contract between a mechanical system and the engine, `hopper` the robot as a rig,
`mjcf` any MJCF model with a rig file. The engine: `soundness` tells which runs can be trusted,
`layout` puts all unknowns in a row, `noise` tells what the cameras add, `problem` what is measured
less what is predicted, `minimum` finds minima of straight lines and `solve` the true ones, `screen`
says what each cause is worth beside the clutter of all others, `judging` what a fit is worth,
`search` fits causes and lets them race, `hypotheses` refits the promising ones, `answer` decides,
`one_run` asks whether that rests on one run and `intervals` how sure its sizes are. `extension`
writes the extended model and `proof` judges the file on runs that no fit has seen. `diagnosis` is
all of it in one call; `leftover`, `hops`, `figures` and `report` make the page that shows it,
`kept` the answer as a file that `workbench review` reads.

What shows that a run of the robot is not what it is said to be stands in `drive_faults`,
`body_faults` and `release_faults`; `hopper_faults` puts them together. A new check is a function
there that yields a sentence. `hopper_numbers` lists what may be other than stated, `hopper_steps`
simulates robots in as short steps as their kind needs. `windows` finds the moments at which a hop
can be taken up again, `following` predicts from there, `hopper_windows` does so for all hops.

What comes after: `standing` the causes that an answer leaves, `next_experiment` the runs that tell
best which of them it is, `next_protocol` the menu of a bench and the file, `investigation` the loop
of runs and diagnoses. `imagined` is a run of the robot that nobody has made yet.

The same for the diagnosis of `engine`: `remaining` the hypotheses that it leaves, `hypothetical`
the runs that each of them would show, `predicted` how the observer of another sees those,
`proposal` the runs that tell best and `proposed` what is said of them; `drive_runs` does so for the
drive alone.

`mechanism` is the same for the estimator of `workbench.fit`: `mechanism_causes` lists what may be a
cause, `mechanism_names` looks up what a rig file names, `mechanism_table` and `mechanism_runs` read
its runs, `mechanism_files` what it says was found. It takes the place of the files `mjcf_...`.

Files named `mjcf_...` are parts of that rig: the numbers that may be other than stated, its causes,
channels, data, names and extension. A new cause that any joint may have is a row in `mjcf_numbers`
and its name in `protocol/rig.py`.
"""

from workbench.diagnose.diagnosis import Diagnosis, diagnose
from workbench.diagnose.hopper import HopperRig
from workbench.diagnose.investigation import Round, investigate
from workbench.diagnose.kept import extended_model_of, write_answer
from workbench.diagnose.mjcf import MjcfRig, load_rig
from workbench.diagnose.next_experiment import Proposal, minutes_of, propose
from workbench.diagnose.next_protocol import MENU, Following, following
from workbench.diagnose.report import write_diagnosis
from workbench.diagnose.rig import Trial
from workbench.diagnose.soundness import refused

__all__ = [
    "MENU",
    "Diagnosis",
    "Following",
    "HopperRig",
    "MjcfRig",
    "Proposal",
    "Round",
    "Trial",
    "diagnose",
    "extended_model_of",
    "following",
    "investigate",
    "load_rig",
    "minutes_of",
    "propose",
    "refused",
    "write_answer",
    "write_diagnosis",
]
