"""Mechanisms: any machine of hinges and slides, an MJCF file with a rig file, to be diagnosed.

`rig` is what `workbench.diagnose` asks of it. `names` checks the rig file against the model,
`table` and `runs` read what was measured, `accelerations` adds up what an accelerometer felt.
`causes` lists the candidates, `files` writes the extended rig file, `errors` judges a model by runs
held out.
"""

from typing import TYPE_CHECKING

from workbench.mechanism.rig import MechanismRig, load_mechanism
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
