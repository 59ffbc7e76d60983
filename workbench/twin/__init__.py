"""The twin: the simulation of exactly the run that was measured, and how the two compare.

`twin` simulates what was commanded, released as the track shows it; `comparison` makes track, twin
and their differences of a bundle's raw take, and keeps them in the bundle. Nothing is drawn here.
Names are loaded when they are used: a take alone is read without the simulation.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports

if TYPE_CHECKING:
    from workbench.twin.comparison import compare_with_twin, other_twin, settings
    from workbench.twin.twin import check_twin, robot_of

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
