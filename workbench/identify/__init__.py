"""Identification: the model's parameters from measured runs, each with its interval.

`measured` is what a fit sees of a run, `drive` how the motor follows its command, `problem` the
least-squares problem, `solve` the way to its minimum, `determinacy` and `intervals` what the
minimum is worth, `identification` the answer; `objective` is what the thesis minimised instead.
The room simulates and fits; it opens no device.
"""

from workbench.identify.identification import BEAM, Estimate, Identification, identify
from workbench.identify.measured import MeasuredRun, measured_run

__all__ = ["BEAM", "Estimate", "Identification", "MeasuredRun", "identify", "measured_run"]
