"""Identification: parameters and the motor's line from measured runs, each with its interval.

The robot: `identification` puts the question to `workbench.fit` and judges the answer, `new_model`
is the file that is left of it, `validation` compares it with runs that were held out; `fitted` puts
them together.

The motor: `shaft` is its speed in one run, `speed_line` the line through such speeds, `line_checks`
what speaks against it, `calibrate` the answer, `calibration_files` and `calibration_figure` what is
left of it on disk.

Without a model: `sweep`, `spectrum`, `resonance`, `oscillator` and `damping` say how the robot
answers and rings; `figures` and `report` show it, `fit_report` beside what a fit found.

The room simulates and fits; it opens no device.
"""

from workbench.fit.measured import MeasuredRun, measured_run, measured_runs
from workbench.identify.calibrate import (
    OmittedRun,
    SpeedCalibration,
    calibrate,
    speed_point,
    speed_points,
)
from workbench.identify.calibration_figure import figure_5_3
from workbench.identify.calibration_files import (
    last_day,
    new_target,
    on_their_bench,
    propose_protocol,
    write_calibration,
    write_new,
)
from workbench.identify.damping import ModeDamping, damping
from workbench.identify.fitted import Fitted, fit_runs
from workbench.identify.identification import (
    BEAM,
    FOOT,
    Identification,
    ParameterEstimate,
    identify,
)
from workbench.identify.new_model import write_model
from workbench.identify.report import ReportPart, write_identification, write_resonances
from workbench.identify.resonance import Resonances, resonances
from workbench.identify.shaft import shaft_speed
from workbench.identify.speed_line import SpeedLine, SpeedPoint, fit_line
from workbench.identify.validation import Validation, validate

__all__ = [
    "BEAM",
    "FOOT",
    "Fitted",
    "Identification",
    "MeasuredRun",
    "ModeDamping",
    "OmittedRun",
    "ParameterEstimate",
    "ReportPart",
    "Resonances",
    "SpeedCalibration",
    "SpeedLine",
    "SpeedPoint",
    "Validation",
    "calibrate",
    "damping",
    "figure_5_3",
    "fit_line",
    "fit_runs",
    "identify",
    "last_day",
    "measured_run",
    "measured_runs",
    "new_target",
    "on_their_bench",
    "propose_protocol",
    "resonances",
    "shaft_speed",
    "speed_point",
    "speed_points",
    "validate",
    "write_calibration",
    "write_identification",
    "write_model",
    "write_new",
    "write_resonances",
]
