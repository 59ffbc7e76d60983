"""Identification: the model's parameters from measured runs, each with its interval.

`measured` is what a fit sees of a run, `drive` how the motor follows its command, `problem` the
least-squares problem, `solve` the way to its minimum, `determinacy` and `intervals` what the
minimum is worth, `identification` the answer. `sweep`, `spectrum`, `resonance`, `oscillator` and
`damping` tell without a model how the robot answers and rings; `figures` and `report` show it. The
room simulates and fits; it opens no device.
"""

from workbench.identify.damping import ModeDamping, damping
from workbench.identify.identification import BEAM, Estimate, Identification, identify
from workbench.identify.measured import MeasuredRun, measured_run
from workbench.identify.report import Part, write_identification, write_resonances
from workbench.identify.resonance import Resonances, resonances

__all__ = [
    "BEAM",
    "Estimate",
    "Identification",
    "MeasuredRun",
    "ModeDamping",
    "Part",
    "Resonances",
    "damping",
    "identify",
    "measured_run",
    "resonances",
    "write_identification",
    "write_resonances",
]
