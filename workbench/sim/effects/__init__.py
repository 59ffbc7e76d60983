"""The named causes by which a robot can differ from its model, one file for each group of them.

`effect` says what an effect is, `library` finds one by its name, `apply` puts effects into a robot,
a condition and what is seen. A new effect is an entry in its group's file, named in the `EFFECTS`
at the end of that, and a test that it moves the motion the way it should.
"""

from workbench.sim.effects.apply import applied, driven, observed
from workbench.sim.effects.effect import Effect, Group, Quantity
from workbench.sim.effects.library import EFFECTS, effect_named, effect_values

__all__ = [
    "EFFECTS",
    "Effect",
    "Group",
    "Quantity",
    "applied",
    "driven",
    "effect_named",
    "effect_values",
    "observed",
]
