"""Better beams for the hopping robot: what may change, what is better, and searches for it.

`problem` says which robot, how it is driven and what a candidate is: `variables` what may change
within which bounds, `goals` what is to become better (`stability` defines one of them),
`uncertainty` what a robust search averages over, `bendable` which shapes can be made at all.
`small_motions` and `description` say what a beam does before it hops: what the default search
learns from. `objective` lets candidates hop, all at once, by the twin's fan-out; `study` is a
search in its folder, begun or gone on with, by one of the algorithms of `optimize`, which know no
physics.
`appraisal` computes what a design is, `results` writes it down; pages and figures, and the
experiments of the thesis, are in `report`.

A new goal is a function and a line in `goals`, a new constraint a method in `bendable`, another
algorithm a line in `study`.
"""

from typing import TYPE_CHECKING

from workbench.design.appraisal import Appraisal, ClampedResonances, appraise, resonances
from workbench.design.bendable import LEAST_RADIUS_M, BendableStrip
from workbench.design.distance_draws import DRAWS, DistanceDraws, draw_distances, tolerances_of
from workbench.design.goals import GOALS, PENALTY, Goal, Hop, goal_named
from workbench.design.objective import Objective
from workbench.design.problem import Problem
from workbench.design.results import DesignFiles, found_by, found_object, shape_text, write_history
from workbench.design.stability import tipping_margin
from workbench.design.study import ALGORITHMS, MUTATIONS, Settings, Study
from workbench.design.uncertainty import Departure, Uncertainty, altered
from workbench.design.variables import BOUNDS, Bounds, Varied, make_space, parse_varied
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
