"""What is wrong with the values of a file, in words for people and in none of a library."""

from __future__ import annotations

import difflib
import itertools
import re
import types
import typing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel
from pydantic_core import ErrorDetails
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from workbench.errors import did_you_mean

__all__ = ["Location", "faults_of", "found_in_words", "holds", "shortened", "unshown_in"]

Location = tuple[str | int, ...]
"""Path to a value of a file: keys and list indices from the top."""

_LONGEST = 60  # characters of a value that a message shows
_MOST = 200  # faults that are put into words; whoever has more mends these first

_WANTED = (
    (("string_type",), "a text"),
    (("int_type", "int_parsing", "int_parsing_size", "int_from_float"), "a whole number"),
    (("float_type", "float_parsing"), "a number"),
    (("finite_number",), "a finite number"),
    (("bool_type", "bool_parsing"), "true or false"),
    (("tuple_type", "list_type"), "a list"),
    (("dict_type", "model_type", "model_attributes_type", "mapping_type"), "a mapping"),
    (
        ("date_type", "date_parsing", "date_from_datetime_parsing", "date_from_datetime_inexact"),
        "a date such as 2026-03-12",
    ),
)
_BOUNDS = {
    "greater_than": ("gt", "above"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "at most"),
}
_PATTERNS = {
    r"^[a-z][a-z0-9_]*$": "small letters, digits and _, beginning with a letter",
    r"^[^.\s]+$": "characters other than spaces and dots",
}
_UNSHOWN = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
_AFTER_COMMA = re.compile(r"\d+(\s*[^\s\d].*)?")


def faults_of(
    details: Sequence[ErrorDetails], schema: type[BaseModel], tree: Any
) -> list[tuple[Location, str]]:
    """Return each fault of a file: its position, and what is wrong and what is allowed there.

    Args:
        details: what pydantic found.
        schema: of the file.
        tree: of the file, with line and column marks.
    """
    faults: list[tuple[Location, str]] = []
    cut: set[tuple[str, ...]] = set()
    around: set[tuple[str, ...]] = set()
    for above, key, rest, words in _decimal_commas(tree, ()):
        faults.append(((*above, key), words))
        cut |= {_spelt((*above, key)), _spelt((*above, rest))}
        around.add(_spelt(above))
    groups: dict[Location, list[ErrorDetails]] = {}
    for detail in _without_echoes(details[:_MOST]):
        location = _spelt(detail["loc"])
        follows = detail["type"] == "value_error" and location in around
        if not follows and not any(location[: len(one)] == one for one in cut):
            groups.setdefault(_key_of(detail, tree), []).append(detail)
    for location, group in groups.items():
        inner = any(
            len(other) > len(location) and other[: len(location)] == location for other in groups
        )
        branches = [detail for detail in group if _is_branch(detail, tree)]
        if branches and inner:
            continue  # of the forms that a value may have, the one that was meant is reported on
        if len(branches) > 1:
            faults.append((_known(tree, branches[0]["loc"]), _either(branches, tree)))
            continue
        faults += [(_known(tree, d["loc"]), _words(d, schema, tree)) for d in group]
    return faults


def holds(node: Any, step: str | int) -> bool:
    """Return whether a step of a location leads on from a node of the tree."""
    if isinstance(node, CommentedMap):
        return step in node
    return isinstance(node, CommentedSeq) and isinstance(step, int) and step < len(node)


def unshown_in(node: Any, above: Location = ()) -> list[tuple[Location, str]]:
    """Return where texts have characters that steer a terminal, or end a name as NUL does."""
    items: Iterable[tuple[Any, Any]] = ()
    if isinstance(node, CommentedMap):
        items = node.items()
    elif isinstance(node, CommentedSeq):
        items = enumerate(node)
    found: list[tuple[Location, str]] = []
    for step, value in items:
        for text in (step, value):
            bad = _UNSHOWN.search(text) if isinstance(text, str) else None
            if bad is not None:
                words = f"a character that cannot be shown, {bad[0]!r}; take it out"
                found.append(((*above, step), f"{_label((*above, step))}: {words}"))
        found += unshown_in(value, (*above, step))
    return found[:_MOST]


def found_in_words(value: object) -> str:
    """Return what is in a file, in words where it is long or has parts."""
    match value:
        case None:
            return "nothing"
        case bool():
            return str(value).lower()
        case Mapping():
            return "a mapping"
        case list() | tuple():
            return "a list"
        case str():
            return repr(shortened(value))
        case _:
            return shortened(str(value))


def shortened(text: str) -> str:
    """Return a text, or its beginning where it is long."""
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _known(tree: Any, location: Location) -> Location:
    """Drop from an error's location what is no key of the file (names of union branches)."""
    kept: list[str | int] = []
    node = tree
    for step in location:
        if holds(node, step):
            node = node[step]
            kept.append(step)
    return tuple(kept)


def _key_of(detail: ErrorDetails, tree: Any) -> Location:
    """Return what faults are grouped by: those of one value together, a missing key by itself."""
    location = detail["loc"]
    if detail["type"] == "missing" and isinstance(location[-1], int):
        return location[:-1]
    alone = detail["type"] in ("missing", "extra_forbidden", "value_error")
    return location if alone else _known(tree, location)


def _is_branch(detail: ErrorDetails, tree: Any) -> bool:
    """Return whether a fault is that of one of several forms which a value may have."""
    location = detail["loc"]
    return (
        detail["type"] not in ("missing", "extra_forbidden", "value_error")
        and len(location) > 0
        and location[-1] != "[key]"
        and _known(tree, location) == location[:-1]
        and _wanted(detail) is not None
    )


def _without_echoes(details: Sequence[ErrorDetails]) -> list[ErrorDetails]:
    """Drop faults that only repeat another: a list short of its faulty items, a misspelt key."""
    inner = {d["loc"][:i] for d in details for i in range(len(d["loc"]))}
    details = [d for d in details if d["type"] != "too_short" or d["loc"] not in inner]
    missing: dict[Location, list[str]] = {}
    for d in details:
        if d["type"] == "missing":
            missing.setdefault(d["loc"][:-1], []).append(str(d["loc"][-1]))
    misspelt = {
        (d["loc"][:-1], close)
        for d in details
        if d["type"] == "extra_forbidden"
        for close in difflib.get_close_matches(
            str(d["loc"][-1]), missing.get(d["loc"][:-1], []), n=1
        )
    }
    items: set[Location] = set()
    kept: list[ErrorDetails] = []
    for d in details:
        if d["type"] == "missing":
            if (d["loc"][:-1], str(d["loc"][-1])) in misspelt:
                continue
            if isinstance(d["loc"][-1], int):  # a list that is short is reported once
                if d["loc"][:-1] in items:
                    continue
                items.add(d["loc"][:-1])
        kept.append(d)
    return kept


def _decimal_commas(
    node: Any, above: Location
) -> Iterator[tuple[Location, str | int, str | int, str]]:
    """Yield each number that a decimal comma cut in two, as in `{voltage: 4,5 V}`.

    Yields:
        position of its mapping, its key, the rest of it that became a key, and what is to be said.
    """
    if isinstance(node, CommentedMap):
        items = list(node.items())
        for (key, value), (rest, empty) in itertools.pairwise(items):
            whole = isinstance(value, int) and not isinstance(value, bool)
            if empty is None and whole and _AFTER_COMMA.fullmatch(str(rest)):
                words = (
                    f"{key}: {value},{rest} has a decimal comma, which ends a value here; "
                    f"write {value}.{rest}"
                )
                yield above, key, rest, words
        for key, value in items:
            yield from _decimal_commas(value, (*above, key))
    elif isinstance(node, CommentedSeq):
        for location, value in enumerate(node):
            yield from _decimal_commas(value, (*above, location))


def _spelt(location: Location) -> tuple[str, ...]:
    """Return a location to compare: a key of the tree may be a number, a key in a fault is none."""
    return tuple(str(step) for step in location)


def _at(tree: Any, location: Location) -> Any:
    for step in location:
        tree = tree[step]
    return tree


def _words(detail: ErrorDetails, schema: type[BaseModel], tree: Any) -> str:
    """Say what is wrong, what is allowed, and what was perhaps meant."""
    kind, location = detail["type"], detail["loc"]
    value, context = detail["input"], detail.get("ctx") or {}
    alone = kind in ("missing", "extra_forbidden") or "[key]" in location
    key = _label(location if alone else _known(tree, location))
    head = f"{key}: " if key else ""
    if kind == "missing":
        return _missing(location, value)
    if kind == "extra_forbidden":
        return f"unknown key {shortened(key)!r}{_guess(key, _keys_at(schema, location[:-1]))}"
    if kind == "literal_error":
        allowed = _literals(context["expected"])
        hint = did_you_mean(str(value), allowed)
        return f"{head}{found_in_words(value)} is not one of {', '.join(allowed)}{hint}"
    if kind == "value_error":
        return f"{head}{context['error']}{_cut_item(location, value, tree)}"
    if kind in ("too_short", "too_long"):
        least, most = context.get("min_length"), context.get("max_length")
        bound = f"at least {least}" if kind == "too_short" else f"at most {most}"
        text = f"{head}{context['actual_length']} values, {bound} are needed"
        return text + (_comma_hint(value) if kind == "too_long" else "")
    if kind == "string_too_short":
        return f"{head}is empty; write a text"
    if kind == "string_too_long":
        most = context["max_length"]
        return f"{head}{len(value)} characters, and there may be at most {most}"
    if kind == "string_pattern_mismatch":
        allowed = _PATTERNS.get(context["pattern"], "other characters")
        text = shortened(str(location[-2] if "[key]" in location else value))
        return f"{head}{text!r} is not allowed; it must be {allowed}"
    if kind in _BOUNDS:
        bound, word = _BOUNDS[kind]
        text = found_in_words(value)
        return f"{head}{text} is not allowed; it must be {word} {context[bound]:g}"
    wanted = _wanted(detail)
    if wanted is None:
        return f"{head}{found_in_words(value)} is not allowed here"
    return f"{head}must be {wanted}, found {found_in_words(value)}{_help(wanted, value)}" + (
        _keys_hint(schema, location) if wanted == "a mapping" else ""
    )


def _either(branches: Iterable[ErrorDetails], tree: Any) -> str:
    """Say what a value may be that may have several forms."""
    branches = list(branches)
    key = _label(_known(tree, branches[0]["loc"]))
    wanted = " or ".join(dict.fromkeys(_wanted(detail) or "" for detail in branches))
    return f"{key}: must be {wanted}, found {found_in_words(branches[0]['input'])}"


def _wanted(detail: ErrorDetails) -> str | None:
    if detail["type"] == "literal_error":
        return f"one of {', '.join(_literals((detail.get('ctx') or {})['expected']))}"
    return next((wanted for kinds, wanted in _WANTED if detail["type"] in kinds), None)


def _help(wanted: str, value: object) -> str:
    """Return how to write what was meant, where that can be guessed."""
    if wanted == "a text" and isinstance(value, (int, float, bool)):
        return f"; put it in quotes, '{found_in_words(value)}'"
    if wanted == "a list":
        if isinstance(value, Mapping):
            return "; begin each item with '- '"
        text = isinstance(value, str)
        return f"; write [{shortened(str(value))}] for a list of one" if text else ""
    if wanted.endswith("number") and isinstance(value, str):
        if re.fullmatch(r"\s*[+-]?\d*,\d+\s*", value):
            return f"; it has a decimal comma, write {value.strip().replace(',', '.')}"
        if re.match(r"\s*[+-]?[\d.,]+\s*\S", value):
            return "; write the number alone"
    return ""


def _missing(location: Location, value: object) -> str:
    """Say what is missing: a key, or an item of a list that has a length of its own."""
    key = _label(location)
    if isinstance(location[-1], int):
        count = len(value) if isinstance(value, (list, tuple)) else location[-1]
        return f"{_label(location[:-1])}: {count} values are too few"
    where = ".".join(str(step) for step in location[:-1])
    return f"missing key {key!r}" + (f" in {where}" if where else "")


def _comma_hint(value: object) -> str:
    """Return what is perhaps wrong with a list of too many numbers."""
    numbers = isinstance(value, (list, tuple)) and all(isinstance(v, (int, float)) for v in value)
    return "; a comma begins the next value, so write 12.5 and not 12,5" if numbers else ""


def _cut_item(location: Location, value: object, tree: Any) -> str:
    """Return what is perhaps wrong with a number without a unit before another item of a list."""
    known = _known(tree, location)
    if not known or not isinstance(known[-1], int) or not isinstance(value, int):
        return ""
    items = _at(tree, known[:-1])
    after = str(items[known[-1] + 1]) if known[-1] + 1 < len(items) else ""
    if not _AFTER_COMMA.fullmatch(after) or not after.strip("0123456789"):
        return ""
    return f"; where '{value},{after}' was meant, write '{value}.{after}'"


def _keys_hint(schema: Any, location: Location) -> str:
    keys = _keys_at(schema, location)
    return f"; its keys are {', '.join(keys)}" if keys else ""


def _label(location: Location) -> str:
    """Return the last key; an item of a list goes by the list's key, `speeds[1]`."""
    location = tuple(step for step in location if step != "[key]")
    if not location:
        return ""
    last = location[-1]
    if not isinstance(last, int):
        return shortened(str(last))
    return f"{_label(location[:-1]) or 'item'}[{last}]"


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
