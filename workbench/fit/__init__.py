"""The estimator: it observes a system's runs and fits what is unknown of it.

`parameters` says what may be fitted; `system` what a system has to offer, `systems/` the hopping
robot and any MJCF. `observer` simulates runs and corrects the state after every sample
(`correction`), with the covariance of `gain`; `drive` turns the seen rotor into an input.
`estimator` states the likelihood and gives residuals and derivatives, `fitting` the recipe from a
far start to the minimum, `process` how much process noise the data ask for, `intervals` and
`identifiability` how sure the answer is, `soundness` what speaks against the data.

`smoother` and `state` give the robot's whole pose over a run and the force that its model misses,
`prediction` how far the model is off some time ahead, `estimation` both for the record of a run.

Nothing here knows of a diagnosis, a report or a command line.
"""

from workbench.fit.drive import commanded_angle
from workbench.fit.estimator import Estimator
from workbench.fit.fitting import Fit, fit_near, fit_system, minimised, refined, settled
from workbench.fit.identifiability import Combination, separable, undetermined
from workbench.fit.intervals import Covariance, Interval, covariance, intervals
from workbench.fit.measured import MeasuredRun, measured_run, measured_runs, paced, same_robot
from workbench.fit.observer import Innovations, Job, Observation, Start, observe
from workbench.fit.parameters import Acts, Parameter, ParameterVector, Scope
from workbench.fit.soundness import warnings_of
from workbench.fit.state import estimated_state
from workbench.fit.system import System
from workbench.fit.systems.hopper import Hopper, free_parameters

__all__ = [
    "Acts",
    "Combination",
    "Covariance",
    "Estimator",
    "Fit",
    "Hopper",
    "Innovations",
    "Interval",
    "Job",
    "MeasuredRun",
    "Observation",
    "Parameter",
    "ParameterVector",
    "Scope",
    "Start",
    "System",
    "commanded_angle",
    "covariance",
    "estimated_state",
    "fit_near",
    "fit_system",
    "free_parameters",
    "intervals",
    "measured_run",
    "measured_runs",
    "minimised",
    "observe",
    "paced",
    "refined",
    "same_robot",
    "separable",
    "settled",
    "undetermined",
    "warnings_of",
]
