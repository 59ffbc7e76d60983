"""What a beam as it was bent means: the joints to correct, the tip, and the distance it costs.

`deviation` compares it with its target, `cost` simulates both, `numbers` reports all of it, and
`files` keeps the beam as a shape that the twin uses. How the angles were read lives in `photo`, the
page in `report`.
"""

from workbench.as_built.cost import Cost, simulate_cost
from workbench.as_built.deviation import Deviation, deviation_of
from workbench.as_built.files import write_as_bent
from workbench.as_built.numbers import numbers_of

__all__ = ["Cost", "Deviation", "deviation_of", "numbers_of", "simulate_cost", "write_as_bent"]
