"""The estimator: it observes a system's runs and fits what is unknown of it.

`parameters` says what may be fitted; `system` what a system has to offer, `systems/` the hopping
robot and any MJCF. `observer` simulates runs and corrects the state after every sample
(`correction`), with the covariance of `gain`; `drive` turns the seen rotor into an input.
`estimator` states the likelihood and gives residuals and derivatives, `fitting` the recipe from a
far start to the minimum, `process` how much process noise the data ask for, `carried` derivatives
at another, `intervals` and `identifiability` how sure the answer is, `soundness` what speaks
against the data.

`smoother` and `state` give the robot's whole pose over a run and the force that its model misses,
`prediction` how far the model is off some time ahead, `estimation` both for the record of a run.

Nothing here knows of a diagnosis, a report or a command line.
"""

from typing import TYPE_CHECKING

from workbench.fit.arm import Arm, arm_of
from workbench.fit.carried import Transitions
from workbench.fit.correction import LONGEST
from workbench.fit.drive import calm, commanded_angle, fit_drive
from workbench.fit.estimation import estimate
from workbench.fit.estimator import NEAREST, ROBUST, Estimator, counted, reaches
from workbench.fit.fitting import Fit, fit_near, fit_system, minimised, refined, settled
from workbench.fit.gain import Modes
from workbench.fit.identifiability import Combination, separable, undetermined
from workbench.fit.intervals import Covariance, Interval, covariance, intervals
from workbench.fit.linear import Linear, Solved, edges_of, eliminated
from workbench.fit.measured import MeasuredRun, measured_run, measured_runs, paced, same_robot
from workbench.fit.minimise import CLOSE, ROUGH, Minimum, minimum, soft, weights
from workbench.fit.noise import coloured_noise
from workbench.fit.observation import Observation
from workbench.fit.observer import Innovations, Job, Start, observe
from workbench.fit.online import LEAST_REST, Estimate, OnlineObserver, PointForces
from workbench.fit.parameters import LIMITS, Acts, Known, Parameter, ParameterVector, Scope
from workbench.fit.prediction import predictions
from workbench.fit.process import NOISE_FACTOR, between_steps, likeliest, weaker
from workbench.fit.replay import Replay, compared, compared_s, replayed
from workbench.fit.smoother import WINDOW, at_points, smoothed
from workbench.fit.soundness import warnings_of
from workbench.fit.state import estimated_state, pose
from workbench.fit.system import System
from workbench.fit.systems.hopper import FOOT, HOPPING_BEAM, Hopper
from workbench.fit.systems.hopper_model import FINER, free_parameters, parameters_within_tolerance
from workbench.fit.systems.hopper_view import View
from workbench.fit.systems.mjcf import MjcfSystem
from workbench.fit.systems.mjcf_fields import FIELDS
from workbench.fit.systems.mjcf_model import Kind, names_of, require_hinges_and_slides, units_of
from workbench.fit.systems.mjcf_parameters import (
    SHARED,
    Edit,
    Free,
    compiled,
    elements_of,
    explicit_inertias,
    total,
)
from workbench.fit.systems.mjcf_runs import Channel, Input, JointStart, MjcfRun
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
