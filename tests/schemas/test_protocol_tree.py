"""What a file may hold at most: told at once, with the line, whatever it could expand to."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from workbench.errors import FileFaults, InputError
from workbench.schemas import MOST_BYTES, SCHEMAS, ModelFile, Protocol, ShapeFile, load, parse
from workbench.schemas.tree import MOST_DEPTH, MOST_VALUES

HEAD = "schema: workbench/protocol-1\ntitle: T\n"


def aliases(count: int, each: int) -> str:
    """Each line stands for `each` of the line before."""
    lines = [f"a0: &a0 [{','.join('x' * each)}]"]
    lines += [f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * each)}]" for i in range(1, count)]
    return "\n".join([*lines, f"steps: *a{count - 1}\n"])


def merges(count: int) -> str:
    lines = ["m0: &m0 {k: 1}"]
    lines += [
        f"m{i}: &m{i}\n  <<: [*m{i - 1}, *m{i - 1}]\n  k{i}: {{<<: *m{i - 1}}}"
        for i in range(1, count)
    ]
    return "\n".join(lines) + "\n"


VALUES = f"more than {MOST_VALUES} values"
DEPTH = f"more than {MOST_DEPTH} deep"
BOMBS = {
    "aliases 9^9": (aliases(9, 9), VALUES),
    "aliases 9^5": (aliases(5, 9), VALUES),
    "aliases 2^40": (aliases(40, 2), VALUES),
    "merge keys": (merges(30), VALUES),
    "an alias of itself": ("steps: &a [*a]\n", "*a is inside itself"),
    "an alias of itself in a mapping": ("steps: &a {b: {c: *a}}\n", "*a is inside itself"),
    "lists in lists": ("steps: " + "[" * 3000 + "]" * 3000 + "\n", DEPTH),
    "lists without an end": ("steps: " + "[" * 20000 + "\n", DEPTH),
    "mappings in mappings": ("x: " + "{a: " * 3000 + "1" + "}" * 3000 + "\n", DEPTH),
    "lists by lines": ("x:\n" + "".join(" " * i + "-\n" for i in range(1, 400)), DEPTH),
    "lists in a line": ("x:\n  " + "- " * 3000 + "x\n", DEPTH),
    "aliases of a long text": (f"a: &a {'x' * 400_000}\nsteps: [{'*a, ' * 10_000}]\n", VALUES),
    "many bytes": ("steps:\n" + "  - prompt: x\n" * 60_000, f"more than {MOST_BYTES} bytes"),
    "one long text": ("x: " + "a" * 3_000_000 + "\n", f"more than {MOST_BYTES} bytes"),
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_file_that_holds_too_much_is_refused_at_once(tmp_path: Path, name: str) -> None:
    text, words = BOMBS[name]
    path = tmp_path / "p.yaml"
    path.write_text(HEAD + text)
    began = time.process_time()
    with pytest.raises(InputError) as caught:
        load(path, Protocol)
    assert time.process_time() - began < 1.5
    assert words in str(caught.value)
    assert len(str(caught.value)) < 1000
    if isinstance(caught.value, FileFaults):
        assert caught.value.faults[0].line > 2


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_kind_of_file_is_bounded(tmp_path: Path, name: str) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(f"schema: workbench/{name}-1\n{aliases(9, 9)}")
    with pytest.raises(FileFaults, match=VALUES):
        load(path, SCHEMAS[name])


def test_many_values_are_counted_one_by_one(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(f"{HEAD}x: [{'1,' * MOST_VALUES}]\n")
    with pytest.raises(FileFaults, match=rf"p\.yaml:3:\d+: {VALUES} up to here"):
        load(path, Protocol)


def test_an_alias_that_stands_for_little_is_read(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(
        f"{HEAD}steps:\n  - run: &a {{mode: hop, speed: 17 rad/s}}\n  - run: *a\n"
        "  - run: {<<: *a, duration: 2 s}\n"
    )
    runs = [step.run for step in load(path, Protocol).content.steps]
    assert [run.duration for run in runs if run is not None] == [10, 10, 2]


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("2026-13-45", "'2026-13-45' is no such value"),
        ("!!int abc", "'abc' is no such value"),
        ("!!timestamp abc", "failed to construct timestamp"),
        ("9" * 5000, "is no such value"),
        ("{<<: 3}", "expected a mapping"),
    ],
)
def test_a_value_that_its_tag_does_not_fit_is_told_with_its_line(
    tmp_path: Path, value: str, words: str
) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(f"{HEAD}x: {value}\n")
    with pytest.raises(FileFaults) as caught:
        load(path, Protocol)
    (fault,) = caught.value.faults
    assert fault.line == 3
    assert words in fault.text


def test_many_faults_are_told_in_part_and_at_once(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(f"{HEAD}steps:\n" + "  - {run: 3, x: 1}\n" * 1500)
    began = time.process_time()
    with pytest.raises(FileFaults, match="further faults; mend these first") as caught:
        load(path, Protocol)
    assert time.process_time() - began < 2
    assert str(caught.value).count("p.yaml:") == 40


def test_a_long_line_is_shown_around_its_fault(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(f"{HEAD}steps: [{'{prompt: x}, ' * 300}{{promt: x}}]\n")
    with pytest.raises(FileFaults) as caught:
        load(path, Protocol)
    head, source, caret = str(caught.value).splitlines()
    assert "unknown key 'promt'" in head
    assert source[caret.index("^") :].startswith("promt: x")
    assert len(source) < 200


def test_a_text_that_was_read_before_gives_the_same_and_faults_in_the_same_places(
    root: Path,
) -> None:
    text = (root / "models/thesis.yaml").read_text("utf-8")
    first = parse(Path("a.yaml"), text, ModelFile)
    with pytest.raises(FileFaults, match="this is a model, and a shape is needed here"):
        parse(Path("b.yaml"), text, ShapeFile)
    again = parse(Path("c.yaml"), text, ModelFile)
    assert (again.path, again.content) == (Path("c.yaml"), first.content)
    fault = again.fault(("parameters",), "here")
    assert (fault.file, text.splitlines()[fault.line - 1]) == ("c.yaml", "parameters:")
