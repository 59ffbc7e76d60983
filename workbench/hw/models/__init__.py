"""The supplies that are known, as data: identities, scales, limits, registers, quirks.

What lives here: one row a model, in one file a family, and the rule by which a value becomes a
register word. What does not: how to speak to them. To add a model: one row in its family's file,
with the source of its facts; a supply that no row knows is refused, as its scales would be a guess.
"""

from __future__ import annotations

import re
from typing import TypeVar

from workbench.errors import HardwareError, InputError
from workbench.hw.models.dps import DPS, DPS_REGISTERS
from workbench.hw.models.hanmatek import HANMATEK, HANMATEK_REGISTERS
from workbench.hw.models.korad import KORAD
from workbench.hw.models.model import (
    Block,
    Dialect,
    Family,
    KoradModel,
    ModbusModel,
    Model,
    Protection,
    Rating,
    Registers,
    ScpiModel,
    TextModel,
    from_word,
    rounded,
    to_word,
)
from workbench.hw.models.riden import RIDEN, RIDEN_REGISTERS
from workbench.hw.models.scpi import SCPI

__all__ = [
    "DPS_REGISTERS",
    "FAMILIES",
    "HANMATEK_REGISTERS",
    "KORAD",
    "MODELS",
    "RIDEN_REGISTERS",
    "SCPI",
    "Block",
    "Dialect",
    "Family",
    "KoradModel",
    "ModbusModel",
    "Model",
    "Protection",
    "Rating",
    "Registers",
    "ScpiModel",
    "TextModel",
    "from_word",
    "model_answering",
    "model_named",
    "model_with_id",
    "rounded",
    "to_word",
]

Row = TypeVar("Row", bound=TextModel)

MODBUS: tuple[ModbusModel, ...] = (*RIDEN, *DPS, *HANMATEK)
MODELS: tuple[Model, ...] = (*MODBUS, *KORAD, *SCPI)
FAMILIES: tuple[Family, ...] = ("riden", "dps", "hanmatek", "korad", "scpi")


def model_with_id(family: Family, model_id: int) -> ModbusModel:
    """Find the model that carries an id.

    Raises:
        HardwareError: when no model of the family does; its scales would be a guess.
    """
    rows = [model for model in MODBUS if model.family == family]
    for model in rows:
        if model_id in model.ids:
            return model
    known = "; ".join(f"{model.name} {model.identity}" for model in rows)
    raise HardwareError(
        f"model id {model_id} is not known, so its scales are not either and nothing was set; "
        f"known {family} ids: {known}"
    )


def model_answering(rows: tuple[Row, ...], answer: str) -> tuple[Row, re.Match[str]]:
    """Find the model that answers so to `*IDN?`, and how its pattern fits.

    Raises:
        HardwareError: when none does; its commands and scales would be a guess.
    """
    for model in rows:
        if found := re.fullmatch(model.pattern, answer):
            return model, found
    known = ", ".join(model.name for model in rows)
    raise HardwareError(
        f"it says that it is {answer!r}, which is no known model, so nothing was set; "
        f"known {rows[0].family} models: {known}"
    )


def model_named(name: str) -> Model:
    """Find a model by its name, or by another that it is sold under.

    Raises:
        InputError: when there is no such model.
    """
    for model in MODELS:
        if name in (model.name, *model.also):
            return model
    names = ", ".join(model.name for model in MODELS)
    raise InputError(f"no supply model {name!r}; there are {names}")
