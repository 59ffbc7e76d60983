"""The twin: the simulation of exactly the run that was measured, and how the two compare.

`twin` simulates what was commanded, released as the track shows it; `comparison` makes track, twin
and their differences of a bundle's raw take, and keeps them in the bundle. Nothing is drawn here.
Names are loaded when they are used: a take alone is read without the simulation.
"""

from typing import TYPE_CHECKING

from workbench.lazy_names import lazy_names

if TYPE_CHECKING:
    from workbench.twin.comparison import compare_with_twin, other_twin, settings
    from workbench.twin.twin import check_twin, robot_of

__all__ = ["check_twin", "compare_with_twin", "other_twin", "robot_of", "settings"]

if not TYPE_CHECKING:  # a type checker knows the names, and should miss others
    __getattr__ = lazy_names(
        __name__,
        {
            "comparison": ["compare_with_twin", "other_twin", "settings"],
            "twin": ["check_twin", "robot_of"],
        },
    )
