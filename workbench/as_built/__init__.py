"""What a beam as it was bent means: the joints to correct, the tip, and the distance it costs.

`deviation` compares it with its target, `cost` simulates both, `numbers` reports all of it, and
`files` keeps the beam as a shape that the twin uses. How the angles were read lives in `photo`, the
page in `report`.
"""

from typing import TYPE_CHECKING

from workbench.as_built.cost import Cost, simulate_cost
from workbench.as_built.deviation import Deviation, deviation_of
from workbench.as_built.files import write_as_bent
from workbench.as_built.numbers import numbers_of
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
