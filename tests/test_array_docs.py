"""Whoever passes an array to a function, or gets one, reads its shape and its unit.

Counted is each array among the parameters, fields and results of what is public in any module: its
text in the docstring has a shape such as "(n, 3)" and a unit such as "[m]"; "[1]" where it has no
dimension. Whole numbers, truth values and names need a shape alone.
`python -m tests.test_array_docs` lists what lacks either.
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from functools import cached_property
from typing import Any, NamedTuple

import workbench

LEAST = 0.95
ARRAY = re.compile(r"\b(?:NDArray|[Aa]rray|ArrayLike|Points|Picture|ndarray)\b")
COUNTED = re.compile(r"np\.(?:bool_?|str_|u?int\w+)\]")
SIZE = r"(?:\w+|\.\.\.)(?: [+*-] \w+| \w+)*"
SHAPE = re.compile(rf"\({SIZE},(?: {SIZE},?)*\)")
WITHIN: dict[type, str] = {
    property: "fget", cached_property: "func", classmethod: "__func__", staticmethod: "__func__"
}  # fmt: skip
"""Where the function of a member lies."""
UNIT = re.compile(r"\[[^\]\d][^\]]*\]|\[1\]")


class Passed(NamedTuple):
    """An array that goes into something or comes out of it.

    Args:
        where: room and name, with the parameter's.
        kind: annotation.
        text: what the docstring says of it.
    """

    where: str
    kind: str
    text: str

    @property
    def shaped(self) -> bool:
        return bool(SHAPE.search(self.text))

    @property
    def measured(self) -> bool:
        return bool(UNIT.search(self.text) or COUNTED.search(self.kind))


class Doc(NamedTuple):
    """A docstring in Google's form."""

    text: str

    @classmethod
    def of(cls, thing: Any) -> Doc:
        return cls(inspect.cleandoc(thing.__doc__ or ""))

    def section(self, name: str) -> str:
        found = re.search(rf"(?ms)^{name}:\n(.*?)(?=^\S|\Z)", self.text)
        return found[1] if found else ""

    def argument(self, name: str) -> str:
        found = re.search(rf"(?ms)^    {name}: (.*?)(?=^    \w|\Z)", self.section("Args"))
        return found[1] if found else ""

    def result(self) -> str:
        return self.section("Returns") or self.section("Yields") or self.text.split("\nArgs:")[0]


def passed() -> Iterator[Passed]:
    """Yield every array of the public functions and classes of all modules."""
    for found in pkgutil.walk_packages(workbench.__path__, "workbench."):
        if found.name.endswith("__main__"):
            continue
        for name, thing in vars(importlib.import_module(found.name)).items():
            if name[0] != "_" and getattr(thing, "__module__", "") == found.name:
                yield from of_class(thing) if inspect.isclass(thing) else of_function(thing)


def of_class(thing: type) -> Iterator[Passed]:
    """Yield the arrays of a class: fields, and its public methods' and properties'."""
    where = f"{thing.__module__}.{thing.__qualname__}"
    fields = {k: v for k, v in vars(thing).get("__annotations__", {}).items() if k[0] != "_"}
    yield from _arguments(where, fields, Doc.of(thing))
    for name, member in vars(thing).items():
        if name == "__init__" and not dataclasses.is_dataclass(thing):
            yield from _arguments(where, _annotations(member), Doc.of(thing))
        elif name[0] != "_":
            function = getattr(member, WITHIN.get(type(member), ""), member)
            above = next((vars(c)[name] for c in thing.__mro__[1:] if name in vars(c)), None)
            yield from of_function(function, Doc.of(above))


def of_function(thing: Any, above: Doc | None = None) -> Iterator[Passed]:
    """Yield the arrays of a function; arguments that its contract `above` describes count."""
    if not inspect.isfunction(inspect.unwrap(thing)):
        return
    where, kinds = f"{thing.__module__}.{thing.__qualname__}", _annotations(thing)
    own = Doc.of(thing)
    yield from _arguments(where, kinds, own if own.section("Args") else above or own)
    if ARRAY.search(kinds.get("return", "")):
        yield Passed(f"{where} ->", kinds["return"], Doc.of(thing).result())


def _annotations(function: Any) -> dict[str, str]:
    return {name: str(kind) for name, kind in inspect.unwrap(function).__annotations__.items()}


def _arguments(where: str, kinds: dict[str, str], doc: Doc) -> Iterator[Passed]:
    for name, kind in kinds.items():
        if name != "return" and ARRAY.search(str(kind)):
            yield Passed(f"{where}({name})", str(kind), doc.argument(name))


def test_arrays_have_shape_and_unit_in_the_docstrings() -> None:
    found = list(passed())
    assert len(found) > 850
    lacking = [one for one in found if not (one.shaped and one.measured)]
    share = 1 - len(lacking) / len(found)
    print(f"{share:.1%} of {len(found)} arrays have shape and unit")
    assert share >= LEAST, "\n".join(one.where for one in lacking)


if __name__ == "__main__":
    everything = list(passed())
    for one in everything:
        lack = [
            word for word, there in (("shape", one.shaped), ("unit", one.measured)) if not there
        ]
        if lack:
            print(f"{one.where}: {' and '.join(lack)}: {' '.join(one.text.split())[:110]}")
    for word, there in (("shape", "shaped"), ("unit", "measured")):
        print(word, sum(getattr(one, there) for one in everything), "of", len(everything))
