"""Identification: the model's parameters from measured runs, each with its interval.

`measured` is what a fit sees of a run, `drive` how the motor follows its command, `problem` the
least-squares problem, `solve` the way to its minimum, `determinacy` and `intervals` what the
minimum is worth, `identification` the answer. `contact` fits ground and friction with what
`excitation`, `kinked` and `events` know of hopping; `validation` judges a fitted model on runs that
were held out. The room simulates and fits; it opens no device.
"""

from workbench.identify.contact import CONTACT, Contact, identify_contact
from workbench.identify.identification import BEAM, Estimate, Identification, identify
from workbench.identify.measured import MeasuredRun, measured_run
from workbench.identify.validation import Validation, validate

__all__ = [
    "BEAM",
    "CONTACT",
    "Contact",
    "Estimate",
    "Identification",
    "MeasuredRun",
    "Validation",
    "identify",
    "identify_contact",
    "measured_run",
    "validate",
]
