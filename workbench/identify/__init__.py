"""Identification: parameters and the motor's line from measured runs, each with its interval.

The beam: `measured` is what a fit sees of a run, `drive` how the motor follows its command,
`problem` the least-squares problem, `solve` the way to its minimum, `determinacy` and `intervals`
what the minimum is worth, `leftover` whether the model lacks something, `identification` the
answer, `new_model` the file that is left of it; `objective` is what the thesis minimised instead.

The ground: `contact` fits ground and friction with what `excitation`, `kinked` and `events` know of
hopping. `validation` judges a fitted model on runs that were held out.

The motor: `shaft` is its speed in one run, `speed_line` the line through such speeds, `line_checks`
what speaks against it, `calibrate` the answer, `calibration_files` and `calibration_figure` what is
left of it on disk.

Without a model: `sweep`, `spectrum`, `resonance`, `oscillator` and `damping` tell how the robot
answers and rings; `figures` and `report` show it, `fit_report` beside what a fit found.

The room simulates and fits; it opens no device.
"""

from workbench.fit.measured import MeasuredRun, measured_run
from workbench.identify.calibrate import (
    LeftOut,
    SpeedCalibration,
    calibrate,
    speed_point,
    speed_points,
)
from workbench.identify.calibration_figure import figure_5_3
from workbench.identify.calibration_files import propose_protocol, write_calibration, write_new
from workbench.identify.contact import CONTACT, Contact, identify_contact
from workbench.identify.damping import ModeDamping, damping
from workbench.identify.fit_report import made_from, report_fit
from workbench.identify.identification import BEAM, Estimate, Identification, identify
from workbench.identify.new_model import write_model
from workbench.identify.report import Part, write_identification, write_resonances
from workbench.identify.resonance import Resonances, resonances
from workbench.identify.shaft import shaft_speed
from workbench.identify.speed_line import SpeedLine, SpeedPoint, fit_line
from workbench.identify.validation import Validation, validate

__all__ = [
    "BEAM",
    "CONTACT",
    "Contact",
    "Estimate",
    "Identification",
    "LeftOut",
    "MeasuredRun",
    "ModeDamping",
    "Part",
    "Resonances",
    "SpeedCalibration",
    "SpeedLine",
    "SpeedPoint",
    "Validation",
    "calibrate",
    "damping",
    "figure_5_3",
    "fit_line",
    "identify",
    "identify_contact",
    "made_from",
    "measured_run",
    "propose_protocol",
    "report_fit",
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
