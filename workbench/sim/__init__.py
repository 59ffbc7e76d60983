"""The robot in MuJoCo: parameters and a shape in, a motion out.

`robot` builds the MjSpec from parts, `beam` its chain of hinges. `ground` has the ground law and
`beam_laws` the other forces on the beam as compiled code, which `passive_forces` gives to the
engine and `compiling` keeps on disk. `drive` has the actuators of the rotor, `droop_ripple` their
droop and ripple, `motor` the motor's parameters and `command` the commands; `effects` are the
causes by which a robot differs from its model. `equilibrium` finds the pose at rest, `modes` the
vibration about it, `checks` refuses what cannot be simulated, `simulate` runs it, `fanout` runs
many on one machine or several, and `gait` summarizes the hops. `stepper` steps a planar `chain` by
the compiled `chain_step`, other models by the engine. Nothing here knows of cameras, supplies or
files.

A new part of the robot is a function in `robot` that edits the spec, a new drive one in `drive`, a
new effect an entry in a file of `effects`; a force that the engine has no field for belongs in
`beam_laws`, whose callback is installed once for the process, and in `chain_links`.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports
from workbench.sim.chain import PlanarChain, read_chain
from workbench.sim.chain_step import step_chains
from workbench.sim.checks import highest_mode, require_stable, require_valid
from workbench.sim.command import replayed, sample_times, staircase
from workbench.sim.compiling import compiled
from workbench.sim.condition import Condition
from workbench.sim.drive import LIMITS, Drive
from workbench.sim.effects import EFFECTS, Effect, Quantity, applied, effect_named
from workbench.sim.effects.effect import Group
from workbench.sim.equilibrium import FALLEN_M, come_to_rest, hold_top, lift, settle, unloaded
from workbench.sim.fanout import Fanout
from workbench.sim.gait import Gait, gait
from workbench.sim.ground import CORNER_FIELDS, CORNERS, Stick
from workbench.sim.modes import (
    DrivenPeak,
    DrivenResponse,
    NaturalMode,
    driven_peaks,
    driven_response,
    linear_modes,
    mass_matrix,
)
from workbench.sim.motor import MOTOR, Motor
from workbench.sim.passive_forces import install_force_laws
from workbench.sim.robot import (
    SAMPLE_RATE_HZ,
    Foot,
    Robot,
    build_spec,
    chain_of,
    compile_model,
    hinge_name,
    make_robot,
)
from workbench.sim.simulate import (
    Outcome,
    Precheck,
    Simulation,
    at_rest,
    attempt_all,
    keep_engine_quiet,
    parallel_map,
    simulate,
    simulate_all,
)
from workbench.sim.statics import Statics, moving_dofs
from workbench.sim.stepper import Stepper

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
