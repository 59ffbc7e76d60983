"""Read a YAML file into a schema and report every fault with line, column and caret."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from workbench.errors import FileFault, FileFaults, InputError, did_you_mean, what_to_do

__all__ = ["Document", "Location", "load", "parse"]

Location = tuple[str | int, ...]
"""Path to a value of a file: keys and list indices from the top."""

KINDS = ("protocol", "part", "bench", "sheet", "model", "shape", "calibration", "rig")
"""All kinds of files, as their `schema` names them."""

_NAMED = 5  # files of a folder that a message names

S = TypeVar("S", bound=BaseModel)


@dataclass(frozen=True)
class Document(Generic[S]):
    """A file as read: its content and where each value stands.

    Args:
        path: the file.
        content: the checked content.
        text: the file's text, kept as given for the bundle.
        tree: the YAML tree with line and column marks.
    """

    path: Path
    content: S
    text: str
    tree: Any

    def fault(self, location: Location, text: str) -> FileFault:
        """Return a fault at a value, for checks that need more than this one file."""
        return _fault(self.path, self.text, _place(self.tree, location), text)


def load(path: Path, schema: type[S]) -> Document[S]:
    """Read and check one file.

    Args:
        path: a YAML 1.2 file; its `schema` key must name the schema's own.
        schema: the model to read into.

    Raises:
        InputError: when there is no such file or it is not text.
        FileFaults: with all faults at once.
    """
    return parse(path, _read_text(path), schema)


def parse(path: Path, text: str, schema: type[S]) -> Document[S]:
    """Check a text that stands for a file; arguments and errors as for `load`."""
    tree = _parse(path, text)
    if not isinstance(tree, CommentedMap):
        found = "nothing" if tree is None else type(tree).__name__.removeprefix("Commented").lower()
        wanted = f"a {_kind(schema)} begins with `schema: {_name(schema)}`"
        words = f"the file must be a mapping, found {found}; {wanted}"
        raise FileFaults([_fault(path, text, (0, 0), words)])
    if (other := _other(tree.get("schema"), schema)) is not None:
        words = f"this is a {other}, and a {_kind(schema)} is needed here; name another file"
        raise FileFaults([_fault(path, text, _place(tree, ("schema",)), words)])
    try:
        content = schema.model_validate(_plain(tree))
    except ValidationError as error:
        details = error.errors(include_url=False)
        raise FileFaults(
            [
                _fault(path, text, _place(tree, _known(tree, d)), _words(d, schema))
                for d in _without_echoes(details)
            ]
        ) from None
    return Document(path, content, text, tree)


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; {_instead(path)}") from None
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: not a UTF-8 text file (byte {error.start}); save it as text in UTF-8"
        ) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {what_to_do(error)}") from None


def _instead(path: Path) -> str:
    """Return what is there instead of a file that is missing, the likeliest or all."""
    if not path.parent.is_dir():
        return f"there is no folder {path.parent}"
    names = {near.stem: near.name for near in sorted(path.parent.glob("*.yaml"))}
    if close := difflib.get_close_matches(path.stem, list(names), n=1):
        return f"did you mean {names[close[0]]!r}?"
    some = ", ".join(list(names.values())[:_NAMED]) + (", ..." if len(names) > _NAMED else "")
    return f"in {path.parent.resolve().name} there is {some or 'no YAML file'}"


def _parse(path: Path, text: str) -> Any:
    try:
        return YAML(typ="rt").load(text)
    except DuplicateKeyError as error:
        mark = error.problem_mark
        message = str(error.problem).split(" with value")[0].replace("found duplicate", "repeated")
        raise FileFaults([_fault(path, text, _mark(mark), message)]) from None
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        said = " ".join(str(part) for part in (error.context, error.problem) if part)
        tab = "; indent with spaces, never with tabs" if "\\t" in said else ""
        raise FileFaults(
            [_fault(path, text, _mark(mark), f"not valid YAML: {said}{tab}")]
        ) from None
    except YAMLError as error:
        first = str(error).splitlines()[0]
        raise FileFaults([_fault(path, text, (0, 0), f"not valid YAML: {first}")]) from None


def _name(schema: type[BaseModel]) -> str:
    """Return what a file of a schema says that it is, `workbench/protocol-1`."""
    field = schema.model_fields.get("schema_")
    return "" if field is None else str(typing.get_args(field.annotation)[0])


def _kind(schema: type[BaseModel]) -> str:
    return _word(_name(schema)) or "mapping"


def _word(name: str) -> str:
    return name.removeprefix("workbench/").rpartition("-")[0]


def _other(said: object, schema: type[BaseModel]) -> str | None:
    """Return the kind that a file says it is where another is needed; None where that may be."""
    kind = _word(str(said))
    return kind if kind in KINDS and kind != _kind(schema) else None


def _mark(mark: Any) -> tuple[int, int]:
    return (0, 0) if mark is None else (mark.line, mark.column)


def _plain(node: Any) -> Any:
    """Return the tree as plain dicts and lists, which pydantic checks by their own names."""
    if isinstance(node, CommentedMap):
        return {str(key): _plain(value) for key, value in node.items()}
    if isinstance(node, CommentedSeq):
        return [_plain(item) for item in node]
    if isinstance(node, bool) or node is None:
        return node
    for kind in (int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return str(node)


def _fault(path: Path, text: str, place: tuple[int, int], words: str) -> FileFault:
    line, column = place
    lines = text.splitlines()
    source = lines[line] if line < len(lines) else ""
    return FileFault(str(path), line + 1, column + 1, words, source)


def _place(tree: Any, location: Location) -> tuple[int, int]:
    """Return line and column, from 0, of the key that leads to a location."""
    place, node = (tree.lc.line, tree.lc.col), tree
    for step in location:
        if not _holds(node, step):
            break
        place = node.lc.key(step) if isinstance(node, CommentedMap) else node.lc.item(step)
        node = node[step]
    return place


def _known(tree: Any, detail: ErrorDetails) -> Location:
    """Drop from an error's location what is no key of the file (names of union branches)."""
    kept: list[str | int] = []
    node = tree
    for step in detail["loc"]:
        if _holds(node, step):
            node = node[step]
            kept.append(step)
    return tuple(kept)


def _holds(node: Any, step: str | int) -> bool:
    if isinstance(node, CommentedMap):
        return step in node
    return isinstance(node, CommentedSeq) and isinstance(step, int) and step < len(node)


def _without_echoes(details: Sequence[ErrorDetails]) -> list[ErrorDetails]:
    """Drop faults that only repeat another: a list short of its faulty items, a misspelt key."""
    inner = {d["loc"][:i] for d in details for i in range(len(d["loc"]))}
    details = [d for d in details if d["type"] != "too_short" or d["loc"] not in inner]
    misspelt = {
        (d["loc"][:-1], close)
        for d in details
        if d["type"] == "extra_forbidden"
        for close in difflib.get_close_matches(
            str(d["loc"][-1]), [str(m["loc"][-1]) for m in details if m["type"] == "missing"], n=1
        )
    }
    return [
        d
        for d in details
        if d["type"] != "missing" or (d["loc"][:-1], str(d["loc"][-1])) not in misspelt
    ]


def _words(detail: ErrorDetails, schema: type[BaseModel]) -> str:
    """Say what is wrong, what is allowed, and what was perhaps meant."""
    kind, location = detail["type"], detail["loc"]
    key, value, context = _label(location), detail["input"], detail.get("ctx") or {}
    where = ".".join(str(step) for step in location[:-1])
    if kind == "missing":
        return f"missing key {key!r}" + (f" in {where}" if where else "")
    if kind == "extra_forbidden":
        return f"unknown key {key!r}{_guess(key, _keys_at(schema, location[:-1]))}"
    if kind == "literal_error":
        allowed = _literals(context["expected"])
        hint = did_you_mean(str(value), allowed)
        return f"{key}: {value!r} is not one of {', '.join(allowed)}{hint}"
    if kind == "value_error":
        return f"{key}: {context['error']}" if key else str(context["error"])
    if kind in ("too_short", "too_long"):
        least, most = context.get("min_length"), context.get("max_length")
        bound = f"at least {least}" if kind == "too_short" else f"at most {most}"
        return f"{key}: {context['actual_length']} values, {bound} are needed"
    message = detail["msg"].replace("Input should", "must")
    message = message[0].lower() + message[1:]
    shown = "" if isinstance(value, (dict, list)) else f" (found {value!r})"
    return f"{key}: {message}{shown}"


def _label(location: Location) -> str:
    """Return the last key; an item of a list goes by the list's key, `speeds[1]`."""
    if not location:
        return ""
    last = location[-1]
    if not isinstance(last, int):
        return last
    parent = location[-2] if len(location) > 1 else "item"
    return f"{parent}[{last}]"


def _literals(expected: str) -> list[str]:
    return [word.strip().strip("'") for word in expected.replace(" or ", ",").split(",")]


def _guess(key: str, allowed: Sequence[str]) -> str:
    return did_you_mean(key, allowed) or (f"; known here: {', '.join(allowed)}" if allowed else "")


def _keys_at(schema: Any, location: Location) -> list[str]:
    """Return the keys that a schema knows at a location."""
    for step in location:
        schema = _inside(schema, step)
    models = [kind for kind in _branches(schema) if _is_model(kind)]
    return [field.alias or name for kind in models for name, field in kind.model_fields.items()]


def _inside(schema: Any, step: str | int) -> Any:
    for kind in _branches(schema):
        if _is_model(kind):
            for name, field in kind.model_fields.items():
                if step in (name, field.alias):
                    return field.annotation
        arguments = typing.get_args(kind)
        if arguments and typing.get_origin(kind) in (list, tuple, dict):
            return arguments[-1] if arguments[-1] is not Ellipsis else arguments[0]
    return None


def _branches(schema: Any) -> list[Any]:
    if typing.get_origin(schema) is typing.Annotated:
        return _branches(typing.get_args(schema)[0])
    if typing.get_origin(schema) in (typing.Union, types.UnionType):
        return [branch for part in typing.get_args(schema) for branch in _branches(part)]
    return [schema]


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
