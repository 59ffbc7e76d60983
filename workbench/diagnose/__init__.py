"""Diagnosis: what the simulation gets wrong, by which cause, how surely, and what is gained.

`rig` is the contract between a mechanical system and the engine, `hopper` the robot as a rig. The
engine: `layout` puts all unknowns in a row, `noise` tells what the cameras add, `problem` what is
measured less what is predicted, `solve` finds minima, `screen` says what each cause is worth beside
the clutter of all others, `hypotheses` refits the promising ones, `answer` decides. `extension`
writes the extended model and `proof` judges the file on runs that no fit has seen. `diagnosis` is
all of it in one call.
"""

from workbench.diagnose.diagnosis import Diagnosis, diagnose
from workbench.diagnose.hopper import HopperRig

__all__ = ["Diagnosis", "HopperRig", "diagnose"]
