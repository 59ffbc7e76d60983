"""Data quality: which runs are what they are said to be, before anything is fitted.

`sound_runs` leaves out runs at fault, of any rig, or refuses a set with too many; `facts` is what
it looks at. What the hopping robot's runs show by themselves, `hopper` puts together of `bodies`,
`drive` and `releases`; `onset` says when something began. A new check is a function there that
yields a sentence.
"""

from typing import TYPE_CHECKING

from workbench.data_quality.facts import Facts, Fault
from workbench.data_quality.hopper import hopper_faults
from workbench.data_quality.sound_runs import Recorded, refused, soundness
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
