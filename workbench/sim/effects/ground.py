"""Effects of the ground: the floor's slope, its force at each corner, the sole's friction."""

from __future__ import annotations

from dataclasses import replace

from workbench.sim.effects.effect import Effect, Quantity
from workbench.sim.effects.scaling import scaled
from workbench.sim.ground import extend_ground

__all__ = ["EFFECTS"]

GROUND_SLOPE = Effect(
    name="ground_slope",
    group="ground",
    sentence="the floor {slope:rises|falls} forward by {slope:size}",
    quantities=(Quantity("slope", "rad", low=-0.2, high=0.2, tolerance=0.005, step=0.0005),),
    excited_by=("hop", "drop", "clamped", "decay"),
    confused_with=(
        "camera_tilt",
        "rest_shape_drift",
        "foot_cg",
        "friction_level",
        "friction_anisotropy",
        "tether",
    ),
    separated_by="the same run in the opposite direction: a slope changes its sign",
    alter=lambda robot, values: replace(robot, slope=robot.slope + values["slope"]),
)
"""The floor rises forward; axes stay along the floor."""

GROUND_STIFFNESS = Effect(
    name="ground_stiffness",
    group="ground",
    sentence="the ground is {share:stiffer|softer} than the model says by {share:size}",
    quantities=(Quantity("share", "1", low=-0.9, high=10.0, tolerance=0.3, step=0.03),),
    excited_by=("hop", "drop"),
    confused_with=("ground_damping", "ground_hunt_crossley", "foot_mass"),
    separated_by="how deep the foot sinks at rest; drops from three heights",
    alter=lambda robot, values: scaled(robot, values["share"], "ground_stiffness"),
)
"""The ground is stiffer or softer upward than the model says, at all corners."""

GROUND_DAMPING = Effect(
    name="ground_damping",
    group="ground",
    sentence="the ground damps {share:more|less} than the model says by {share:size}",
    quantities=(Quantity("share", "1", low=-1.0, high=5.0, tolerance=0.3, step=0.03),),
    excited_by=("hop", "drop"),
    confused_with=(
        "ground_stiffness",
        "ground_hunt_crossley",
        "sole_adhesion",
        "foot_mass",
        "time_step",
    ),
    separated_by="drops from three heights",
    alter=lambda robot, values: scaled(robot, values["share"], "ground_damping"),
)
"""The ground damps more or less than the model says, at all corners."""

GROUND_HUNT_CROSSLEY = Effect(
    name="ground_hunt_crossley",
    group="ground",
    sentence="the ground's damping grows with the depth, by {depth_damping} at every corner",
    quantities=(
        Quantity("depth_damping", "N s/m^2", low=0.0, high=20000.0, tolerance=500.0, step=50.0),
    ),
    excited_by=("hop", "drop"),
    confused_with=("ground_stiffness", "ground_damping", "sole_adhesion"),
    separated_by="drops from three heights: the term acts with the depth, so more in high falls",
    build=lambda spec, _, values: extend_ground(spec, "depth_damping", values["depth_damping"]),
)
"""The ground's damping grows with the depth, as Hunt and Crossley's does.

fz = -k z - (d + lambda |z|) z' at each corner: no step of the force at touch-down from this term.
"""

FRICTION_LEVEL = Effect(
    name="friction_level",
    group="ground",
    sentence="the sole's friction is {share:higher|lower} than the model says by {share:size}",
    quantities=(Quantity("share", "1", low=-0.95, high=4.0, tolerance=0.2, step=0.002),),
    excited_by=("hop", "drop"),
    confused_with=("friction_anisotropy", "friction_wait", "ground_slope"),
    separated_by="a slow pull on the foot; the slope at which the robot slides",
    alter=lambda robot, values: scaled(robot, values["share"], "friction_slide", "friction_stick"),
)
"""The sole's friction is higher or lower than the model says, sliding and sticking alike."""

FRICTION_ANISOTROPY = Effect(
    name="friction_anisotropy",
    group="ground",
    sentence=(
        "the sole's friction is {share:higher|lower} forward by {share:size}, and "
        "{share:lower|higher} backward by as much"
    ),
    quantities=(Quantity("share", "1", low=-0.9, high=0.9, tolerance=0.1, step=0.0005),),
    excited_by=("hop", "drop"),
    confused_with=("friction_level", "ground_slope"),
    separated_by="a slow pull on the foot both ways; the robot turned round on the same floor",
    build=lambda spec, _, values: extend_ground(spec, "anisotropy", values["share"]),
)
"""The sole's friction depends on the direction: higher forward, lower backward.

Both coefficients are 1 + share times as high against a motion forward, 1 - share times against one
backward.
"""

FRICTION_WAIT = Effect(
    name="friction_wait",
    group="ground",
    sentence=(
        "a corner of the sole that has broken loose is braked by static friction until it is "
        "faster than the threshold, by {share} of what that has beyond sliding friction"
    ),
    quantities=(Quantity("share", "1", low=0.0, high=1.0, tolerance=0.5, step=0.002),),
    excited_by=("hop", "drop"),
    confused_with=("friction_level",),
    separated_by="a pull on the foot that slowly grows: how far its force drops as the foot starts",
    build=lambda spec, _, values: extend_ground(spec, "wait", values["share"]),
)
"""Static friction brakes a slow corner too: another reading of figure 3.4 of the thesis.

There a corner whose load exceeds static friction is in mode `wait` until it is faster than v_th.
The model lets it slide there; with a share of 1 all of static friction brakes it.
"""

SOLE_ADHESION = Effect(
    name="sole_adhesion",
    group="ground",
    sentence="the sole sticks to the floor: every corner holds on by up to {pull} before it lifts",
    quantities=(Quantity("pull", "N", low=0.0, high=5.0, tolerance=0.02, step=0.002),),
    excited_by=("hop", "drop"),
    confused_with=("ground_damping", "ground_hunt_crossley"),
    separated_by="a slow pull upward on the foot; powder on the floor",
    build=lambda spec, _, values: extend_ground(spec, "adhesion", values["pull"]),
)
"""The sole sticks to the floor: each corner is pulled back until it tears off.

A corner that touched keeps its spring above the floor's level until that pulls by as much as it
can: fz = max(-pull, -k z - d z') up to z = pull / k instead of max(0, ...) up to z = 0. While it
pulls there is no friction.
"""

EFFECTS = (
    GROUND_SLOPE,
    GROUND_STIFFNESS,
    GROUND_DAMPING,
    GROUND_HUNT_CROSSLEY,
    FRICTION_LEVEL,
    FRICTION_ANISOTROPY,
    FRICTION_WAIT,
    SOLE_ADHESION,
)
