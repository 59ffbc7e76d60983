"""Identification: parameters and the motor's line from measured runs, each with its interval.

The robot: `identification` puts the question to `workbench.fit` and judges the answer, `new_model`
is the file that is left of it, `validation` compares it with runs that were held out.

The motor: `shaft` is its speed in one run, `speed_line` the line through such speeds, `line_checks`
what speaks against it, `calibrate` the answer, `calibration_files` what is left of it on
disk.

Without a model: `sweep`, `spectrum`, `resonance`, `oscillator` and `damping` say how the robot
answers and rings. Pages and figures, and all of a fit at once, are in `report`.

The room simulates and fits; it opens no device.
"""

from typing import TYPE_CHECKING

from workbench.fit import MeasuredRun, measured_run, measured_runs
from workbench.identify.calibrate import (
    OmittedRun,
    SpeedCalibration,
    calibrate,
    speed_point,
    speed_points,
)
from workbench.identify.calibration_files import (
    last_day,
    new_target,
    on_their_bench,
    propose_protocol,
    write_calibration,
    write_new,
)
from workbench.identify.damping import ModeDamping, damping
from workbench.identify.identification import (
    BEAM,
    FOOT,
    Identification,
    ParameterEstimate,
    identify,
)
from workbench.identify.new_model import write_model
from workbench.identify.pairs import (
    FrequencySurface,
    Pair,
    fitted_pairs,
    frequency_surface,
    label,
    simulated_pair,
)
from workbench.identify.resonance import Resonances, resonances
from workbench.identify.shaft import shaft_speed
from workbench.identify.spectrum import SpectralLine, Spectrum
from workbench.identify.speed_line import CONFIDENCE, SpeedLine, SpeedPoint, fit_line
from workbench.identify.sweep import SweepPoint
from workbench.identify.validation import PointError, RunValidation, Validation, validate
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
