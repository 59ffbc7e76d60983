"""What a beam as it was bent means: the joints to correct, the tip, and the distance it costs.

`deviation` compares it with its target, `cost` simulates both, `figure` draws both over each
other, `page` and `numbers` report all of it, and `files` keeps the beam as a shape that the twin
uses. How the angles were read lives in `photo`. A further consequence of a deviation is a further
section of the page.
"""

from workbench.as_built.cost import Cost, simulate_cost
from workbench.as_built.deviation import Deviation, deviation_of
from workbench.as_built.figure import deviation_figure
from workbench.as_built.files import write_as_bent
from workbench.as_built.numbers import numbers_of
from workbench.as_built.page import change_in_words, write_readback

__all__ = [
    "Cost",
    "Deviation",
    "change_in_words",
    "deviation_figure",
    "deviation_of",
    "numbers_of",
    "simulate_cost",
    "write_as_bent",
    "write_readback",
]
