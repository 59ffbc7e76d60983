"""What a beam as it was bent means: the joints to correct, the tip, and the distance it costs.

`deviation` compares it with its target, `cost` simulates both, `figure` draws both over each
other, `page` and `numbers` tell all of it, and `files` keeps the beam as a shape that the twin
uses. How the angles were read lives in `photo`. A further consequence of a deviation is a further
section of the page.
"""

from workbench.readback.cost import Cost, simulate_cost
from workbench.readback.deviation import Deviation, deviation_of
from workbench.readback.figure import deviation_figure
from workbench.readback.files import write_as_bent
from workbench.readback.numbers import numbers_of
from workbench.readback.page import change_in_words, write_readback

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
