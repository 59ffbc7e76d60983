"""Read a YAML file into a schema and report every fault with line, column and caret."""

from __future__ import annotations

import difflib
import typing
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from workbench.errors import FileFault, FileFaults, InputError, what_to_do
from workbench.schemas.tree import MOST_BYTES, BeyondBounds, tree_of
from workbench.schemas.wording import Location, faults_of, holds, unshown_in

__all__ = ["Document", "Location", "load", "parse"]

KINDS = ("protocol", "part", "bench", "sheet", "model", "shape", "calibration", "rig")
"""All kinds of files, as their `schema` names them."""

_ALIKE = 0.75  # of a name to one in a folder below
_NAMED = 5  # files of a folder that a message names

S = TypeVar("S", bound=BaseModel)


@dataclass(frozen=True)
class Document(Generic[S]):
    """A file as read: its content and the position of each value.

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
        return _fault(self.path, self.text, _position(self.tree, location), text)


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
    """Check a text in place of a file; arguments and errors as for `load`."""
    tree = _parse(path, text)
    if not isinstance(tree, CommentedMap):
        found = "nothing" if tree is None else type(tree).__name__.removeprefix("Commented").lower()
        wanted = f"a {_kind(schema)} begins with `schema: {_name(schema)}`"
        words = f"the file must be a mapping, found {found}; {wanted}"
        raise FileFaults([_fault(path, text, (0, 0), words)])
    if (other := _other(tree.get("schema"), schema)) is not None:
        words = f"this is a {other}, and a {_kind(schema)} is needed here; name another file"
        raise FileFaults([_fault(path, text, _position(tree, ("schema",)), words)])
    if unshown := unshown_in(tree):
        raise FileFaults([_fault(path, text, _position(tree, at), words) for at, words in unshown])
    try:
        content = schema.model_validate(_plain(tree))
    except ValidationError as error:
        found = faults_of(error.errors(include_url=False), schema, tree)
        raise FileFaults(
            [_fault(path, text, _position(tree, location), words) for location, words in found]
        ) from None
    return Document(path, content, text, tree)


def _read_text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)  # and no more, however long it is
        if len(data) > MOST_BYTES:
            raise InputError(
                f"{path}: more than {MOST_BYTES} bytes, which no file of the workbench has; split "
                "it, or see that it is the file you mean"
            )
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
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
    if not path.suffix:  # a name alone, as models and shapes have
        files = {one.stem: one for one in sorted(Path().glob("*/*.yaml"), reverse=True)}
        if near := difflib.get_close_matches(path.name, list(files), n=1, cutoff=_ALIKE):
            return f"did you mean {files[near[0]].as_posix()}?"
    if close := difflib.get_close_matches(path.stem, list(names), n=1):
        return f"did you mean {names[close[0]]!r}?"
    some = ", ".join(list(names.values())[:_NAMED]) + (", ..." if len(names) > _NAMED else "")
    return f"in {path.parent.resolve().name} there is {some or 'no YAML file'}"


def _parse(path: Path, text: str) -> Any:
    try:
        return tree_of(text)
    except BeyondBounds as error:
        raise FileFaults([_fault(path, text, _mark(error.problem_mark), error.problem)]) from None
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


def _fault(path: Path, text: str, position: tuple[int, int], words: str) -> FileFault:
    line, column = position
    lines = _lines(text)
    source = lines[line] if line < len(lines) else ""
    return FileFault(str(path), line + 1, column + 1, words, source)


@lru_cache(maxsize=8)
def _lines(text: str) -> tuple[str, ...]:
    """Return the lines of a file, which may have many faults."""
    return tuple(text.splitlines())


def _position(tree: Any, location: Location) -> tuple[int, int]:
    """Return line and column, from 0, of the key that leads to a location."""
    position, node = (tree.lc.line, tree.lc.col), tree
    for step in location:
        if not holds(node, step):
            break
        position = node.lc.key(step) if isinstance(node, CommentedMap) else node.lc.item(step)
        node = node[step]
    return position
