"""The supplies that are known, as data: identities, scales, limits and forbidden registers.

The rounding rule lives here too, because it is the other half of a scale: a value enters a
register as the nearest whole number of steps, a tie goes to the even one. Nothing truncates.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal

from workbench.errors import HardwareError, InputError

__all__ = ["MODELS", "NEVER_WRITE", "Model", "from_word", "model_named", "model_of", "to_word"]

CENTI, MILLI, TENTH_MILLI = Decimal("0.01"), Decimal("0.001"), Decimal("0.0001")


@dataclass(frozen=True)
class Model:
    """One model: what it calls itself and how its registers count.

    Args:
        name: as printed on the front, and as the bench file names it.
        family: which driver speaks to it.
        ids: values of its model register.
        voltage_max_V: highest voltage that it can be set to.
        current_max_A: highest current that it can be set to.
        voltage_step_V: one count of a voltage register.
        current_steps_A: one count of a current register, by current range (register 20).
    """

    name: str
    family: str
    ids: range
    voltage_max_V: Decimal
    current_max_A: Decimal
    voltage_step_V: Decimal
    current_steps_A: tuple[Decimal, ...]


def _riden(name: str, ids: range, amps: int, volt_step: Decimal, *amp_steps: Decimal) -> Model:
    return Model(name, "riden", ids, Decimal(60), Decimal(amps), volt_step, amp_steps)


# Ids and scales: Baldanos/rd6006, ShayBox/Riden, riden-dongle and libsigrok rdtech-dps agree
# (instruments survey 1.2). PyPI rd60xx 0.1.0 lists 1 mV for the plain models: it is wrong.
# The survey gives RD6024 as "60241 and up"; the last digit is the variant, so up to 60249.
MODELS = (
    _riden("RD6006", range(60060, 60065), 6, CENTI, MILLI),
    _riden("RD6006P", range(60065, 60066), 6, MILLI, TENTH_MILLI),
    _riden("RD6012", range(60120, 60125), 12, CENTI, CENTI),
    _riden("RD6012P", range(60125, 60130), 12, MILLI, TENTH_MILLI, MILLI),  # ranges 6 A, 12 A
    _riden("RD6018", range(60180, 60190), 18, CENTI, CENTI),
    _riden("RD6024", range(60241, 60250), 24, CENTI, CENTI),
    _riden("RD6030", range(60301, 60302), 30, CENTI, CENTI),
)

# Registers whose writing damages the supply: calibration, and the jump to the boot loader.
NEVER_WRITE = {"riden": frozenset({*range(54, 63), 256})}


def to_word(value: Decimal, step: Decimal) -> int:
    """Return the register word nearest to a value, ties to even; exact in decimals."""
    return int((value / step).to_integral_value(ROUND_HALF_EVEN))


def from_word(word: int, step: Decimal) -> Decimal:
    """Return the value that a register word stands for, exactly."""
    return word * step


def model_of(family: str, model_id: int) -> Model:
    """Find the model that carries an id.

    Raises:
        HardwareError: when no model of the family does; its scales would be a guess.
    """
    for model in MODELS:
        if model.family == family and model_id in model.ids:
            return model
    known = ", ".join(f"{m.name} {m.ids[0]}-{m.ids[-1]}" for m in MODELS if m.family == family)
    raise HardwareError(
        f"model id {model_id} is not known, so its scales are not either and nothing was set; "
        f"known {family} ids: {known}"
    )


def model_named(name: str) -> Model:
    """Find a model by its name.

    Raises:
        InputError: when there is no such model.
    """
    for model in MODELS:
        if model.name == name:
            return model
    names = ", ".join(model.name for model in MODELS)
    raise InputError(f"no supply model {name!r}; there are {names}")
