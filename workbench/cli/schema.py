"""`workbench schema`: JSON Schemas for editors."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

from workbench.errors import InputError, did_you_mean
from workbench.schemas import SCHEMAS

__all__ = ["schema", "schema_text"]


def schema(name: Annotated[str, typer.Argument(help=f"One of {', '.join(SCHEMAS)}.")]) -> None:
    """Print the JSON Schema of a file.

    Example: workbench schema protocol > protocol-1.json
    """
    print(schema_text(name), end="")


def schema_text(name: str) -> str:
    """Return the JSON Schema of a kind of file.

    Raises:
        InputError: when there is no such kind.
    """
    if name not in SCHEMAS:
        hint = did_you_mean(name, SCHEMAS)
        raise InputError(f"no schema {name!r}{hint}; there are {', '.join(SCHEMAS)}")
    content: dict[str, Any] = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    content |= SCHEMAS[name].model_json_schema(by_alias=True)
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"
