"""A text in YAML as a tree of keys and values, within bounds that no file of ours comes near.

A few lines of YAML can mean billions of values, by aliases of aliases. So values are counted
while the tree is made, each alias for as many as it means, and it is given up at once.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.constructor import ConstructorError, RoundTripConstructor
from ruamel.yaml.error import MarkedYAMLError, StringMark
from ruamel.yaml.events import AliasEvent, ScalarEvent

__all__ = ["MOST_BYTES", "MOST_DEPTH", "MOST_VALUES", "BeyondBounds", "tree_of"]

MOST_BYTES = 500_000
"""Of a file: a hundred times the longest of ours."""
MOST_VALUES = 15_000
"""Keys, values, lists and mappings of a file: a thousand runs that all differ."""
MOST_DEPTH = 40
"""Lists and mappings inside each other; our schemas need ten."""
_LONG = 1000  # characters of a text that count as another value


class BeyondBounds(MarkedYAMLError):
    """A file holds more than any of ours; the problem is in words of their own."""


@lru_cache(maxsize=16)
def tree_of(text: str) -> Any:
    """Return the tree of a text, with line and column marks; nobody may change it.

    The last ones are kept: a run reads its model, shape and protocol several times.

    Raises:
        BeyondBounds: where it holds too much.
        YAMLError: where it is no YAML.
    """
    if len(text) > MOST_BYTES:
        said = f"{len(text)} characters, and a file may have at most {MOST_BYTES}"
        raise BeyondBounds(problem=f"{said}; split it, or see that it is the file you mean")
    yaml = YAML(typ="rt")
    yaml.Composer, yaml.Constructor = _Counting, _Placing
    return yaml.load(text)


class _Counting(Composer):
    """Counts values, with those that aliases mean."""

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader)
        self.warn_double_anchors = False
        self._count = self._level = 0
        self._sizes: dict[str, int] = {}

    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.parser.peek_event()
        anchor, before = event.anchor, self._count
        if isinstance(event, AliasEvent):
            if anchor in self.anchors and anchor not in self._sizes:
                raise _beyond(event.start_mark, f"*{anchor} is inside itself; write it out")
            self._count += self._sizes.get(anchor, 1)
        else:
            # a long text counts for many, as an alias of it is a copy
            long = len(event.value) // _LONG if isinstance(event, ScalarEvent) else 0
            self._count += 1 + long
            self._level += 1
        if self._level > MOST_DEPTH:
            text = f"lists and mappings inside each other, more than {MOST_DEPTH} deep"
            raise _beyond(event.start_mark, f"{text}; see that it is the file you mean")
        if self._count > MOST_VALUES:
            text = f"more than {MOST_VALUES} values up to here, with those that aliases mean"
            raise _beyond(event.start_mark, f"{text}; give values as a range, or split the file")
        node = super().compose_node(parent, index)
        if not isinstance(event, AliasEvent):
            self._level -= 1
            if anchor is not None:
                self._sizes[anchor] = self._count - before
        return node


class _Placing(RoundTripConstructor):
    """Says where a value is that its tag does not fit, such as a 13th month."""

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError) as error:
            raise _unfit(node, error) from None
        except ValueError as error:
            raise _unfit(node, error) from None


def _beyond(mark: StringMark, words: str) -> BeyondBounds:
    return BeyondBounds(problem=words, problem_mark=mark)


def _unfit(node: Any, error: Exception) -> ConstructorError:
    written = f"{node.value[:40]!r} " if isinstance(node.value, str) else ""
    return ConstructorError(
        problem=f"{written}is no such value ({error}); put it in quotes if it is a text",
        problem_mark=node.start_mark,
    )
