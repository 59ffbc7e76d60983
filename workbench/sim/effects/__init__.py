"""The named causes by which a robot can differ from its model, one file for each group of them.

`effect` has the class, `library` finds one by its name, `apply` applies effects to a robot, a
condition and an observed motion. A new effect is an entry in its group's file and in the `EFFECTS`
at its end, and a test that it changes the motion as it should.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports
from workbench.sim.effects.apply import applied, driven, observed
from workbench.sim.effects.effect import Effect, Group, Quantity
from workbench.sim.effects.library import EFFECTS, effect_named, effect_values

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
