"""The robot in MuJoCo: parameters and a shape in, a motion out.

`robot` builds the MjSpec from parts, `ground` holds the ground law as compiled code, `equilibrium`
finds the pose at rest, `simulate` runs it. Nothing here knows of cameras, supplies or files. A
new part of the robot is a function in `robot` that edits the spec; a new force belongs in
`ground`'s callback, which is installed once for the process.
"""

from workbench.sim.equilibrium import FALLEN_M, settle, unloaded
from workbench.sim.ground import install_ground_law
from workbench.sim.robot import STEP_S, Robot, build_spec, compile_model, make_robot
from workbench.sim.simulate import Outcome, Simulation, simulate, staircase, step_times

__all__ = [
    "FALLEN_M",
    "STEP_S",
    "Outcome",
    "Robot",
    "Simulation",
    "build_spec",
    "compile_model",
    "install_ground_law",
    "make_robot",
    "settle",
    "simulate",
    "staircase",
    "step_times",
    "unloaded",
]
