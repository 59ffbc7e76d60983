"""The robot in MuJoCo: parameters and a shape in, a motion out.

`robot` builds the MjSpec from parts, `ground` holds the ground law as compiled code, `equilibrium`
finds the pose at rest, `simulate` runs it, `fanout` runs many on one machine or on several.
Nothing here knows of cameras, supplies or files. A new part of the robot is a function in `robot`
that edits the spec; a new force belongs in `ground`'s callback, which is installed once for the
process.
"""

from workbench.sim.equilibrium import FALLEN_M, settle, unloaded
from workbench.sim.fanout import Fanout
from workbench.sim.gait import Gait, gait
from workbench.sim.ground import install_ground_law
from workbench.sim.robot import (
    SAMPLE_RATE_HZ,
    STEP_S,
    Robot,
    build_spec,
    compile_model,
    make_robot,
)
from workbench.sim.simulate import (
    Condition,
    Outcome,
    Simulation,
    sample_times,
    simulate,
    simulate_all,
    staircase,
)

__all__ = [
    "FALLEN_M",
    "SAMPLE_RATE_HZ",
    "STEP_S",
    "Condition",
    "Fanout",
    "Gait",
    "Outcome",
    "Robot",
    "Simulation",
    "build_spec",
    "compile_model",
    "gait",
    "install_ground_law",
    "make_robot",
    "sample_times",
    "settle",
    "simulate",
    "simulate_all",
    "staircase",
    "unloaded",
]
