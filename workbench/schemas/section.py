"""The base of every part of a file: frozen, and no key that the schema does not know."""

from __future__ import annotations

import ast
import inspect
import textwrap
from itertools import pairwise

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core.core_schema import CoreSchema

__all__ = ["Section"]


class Section(BaseModel):
    """A mapping of a YAML file; the docstring under each field is shown in the editor."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler, /
    ) -> JsonSchemaValue:
        """Describe each key by the docstring under its field.

        Pydantic's `use_attribute_docstrings` reads the sources whenever the classes are imported:
        50 ms of every command, for what only `workbench schema` shows.
        """
        schema = handler(core_schema)
        keys = handler.resolve_ref_schema(schema)["properties"]
        for parent in reversed(cls.__mro__[: cls.__mro__.index(Section)]):
            for name, text in _docstrings(parent).items():
                field = cls.model_fields[name]
                keys[field.alias or name]["description"] = field.description or text
        return schema


def _docstrings(kind: type) -> dict[str, str]:
    """Return field -> docstring under it, of the fields that a class itself defines."""
    source = ast.parse(textwrap.dedent(inspect.getsource(kind)))
    return {
        field.target.id: inspect.cleandoc(text.value.value)
        for definition in source.body
        if isinstance(definition, ast.ClassDef)
        for field, text in pairwise(definition.body)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
        if isinstance(text.value.value, str)
    }
