"""What people read of a wrong value: in their words, with what is allowed and how to write it."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError
from ruamel.yaml import YAML

from workbench.errors import FileFaults
from workbench.schemas import SCHEMAS, BenchFile, Protocol, Section, load
from workbench.schemas.files import _plain  # pyright: ignore[reportPrivateUsage]
from workbench.schemas.wording import faults_of

ROOT = Path(__file__).resolve().parents[2]
HEAD = "schema: workbench/protocol-1\ntitle: T\n"
JARGON = re.compile(
    r"\bvalid\b|tuple|dict|instance|Input|None|unpack|pydantic|regular|pattern|pars(e|ing)|\bstr\b|"
    r"\bint\b|integer|float|bool|object|iterab|JSON|True|False"
)
WRONG: tuple[Any, ...] = (17, 2.5, -1e9, "x", "", [], {}, None, True, [1, 2], ["a"], {"a": 1},
                          float("inf"), "z" * 300, {"a b": {"c": 3}}, [[1]])  # fmt: skip
FILES = {
    "protocol": "protocols/hop-17.yaml", "part": "protocols/parts/clamped.yaml",
    "bench": "docs/examples/lab-bench.yaml", "sheet": "docs/examples/sheet.yaml",
    "model": "models/thesis.yaml", "shape": "models/thesis-initial.yaml",
    "calibration": "docs/examples/calibration.yaml", "rig": "examples/pendulum/rig.yaml",
}  # fmt: skip
RICH = """\
schema: workbench/protocol-1
title: T
limits: {voltage: 5 V}
steps:
  - prompt: {text: x, picture: p.png, value: {name: a, quantity: length, low: 1 mm, high: 2 mm}}
  - prompt: {text: x, value: {name: b, one_of: [left, right]}}
  - pause: {time: 1 s, why: x}
  - run: {mode: hop, speed: 17 rad/s, repeats: 2, role: train, before: [x], after: [{text: y}]}
  - sweep: {mode: hop, speeds: [16 rad/s], order: random, seed: 3}
  - sweep: {mode: hop, voltages: {from: 3 V, to: 4 V, count: 3}}
  - staircase: {mode: hop, speeds: [16 rad/s], dwell: 1 s, down: true}
  - include: x.yaml
"""


def places(node: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every key and item of a tree."""
    items = node.items() if isinstance(node, dict) else enumerate(node)
    for step, value in items:
        yield (*way, step)
        if isinstance(value, (dict, list)):
            yield from places(value, (*way, step))


def wrong(tree: Any, way: tuple[Any, ...], value: Any) -> Any:
    changed = copy.deepcopy(tree)
    node = changed
    for step in way[:-1]:
        node = node[step]
    node[way[-1]] = YAML().load(YAML_OF[repr(value)]) if isinstance(value, (dict, list)) else value
    return changed


YAML_OF = {repr(v): repr(v).replace("'", '"') for v in WRONG if isinstance(v, (dict, list))}


@pytest.mark.parametrize("name", [*SCHEMAS, "rich"])
def test_no_word_of_a_library_reaches_people(name: str) -> None:
    schema: type[Section] = SCHEMAS.get(name, Protocol)
    text = RICH if name == "rich" else (ROOT / FILES[name]).read_text(encoding="utf-8")
    tree = YAML().load(text)
    every = list(places(tree))[:60]
    told = 0
    for number, way in enumerate(every):
        for value in WRONG[number % 2 :: 2]:
            changed = wrong(tree, way, value)
            try:
                schema.model_validate(_plain(changed))
            except ValidationError as error:
                for _, words in faults_of(error.errors(include_url=False), schema, changed):
                    told += 1
                    assert not JARGON.search(words), (way, value, words)
                    assert len(words) < 400
    assert told > 10


def faults(tmp_path: Path, text: str, schema: type[Section] = Protocol) -> list[str]:
    path = tmp_path / "p.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileFaults) as caught:
        load(path, schema)
    return [f"{f.line}:{f.column}: {f.text}" for f in caught.value.faults]


def run(keys: str) -> str:
    return f"{HEAD}steps:\n  - run: {{mode: hop, {keys}}}\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"{HEAD}steps: {{run: x}}\n", "3:1: steps: must be a list, found a mapping; begin each"),
        (f"{HEAD}steps:\n  - sweep: {{mode: hop, speeds: 8 rad/s}}\n",
         "4:24: speeds: must be a list, found '8 rad/s'; write [8 rad/s] for a list of one"),
        (f"{HEAD}steps:\n  - prompt: 17\n",
         "4:5: prompt: must be a text or a mapping, found 17; put it in quotes, '17'"),
        (f"{HEAD}steps:\n  - prompt: {{text: x, value: {{name: a, one_of: [1, b]}}}}\n",
         "4:49: one_of[0]: must be a text, found 1; put it in quotes, '1'"),
        (HEAD.replace("T", "2026") + "steps:\n  - prompt: x\n",
         "2:1: title: must be a text, found 2026; put it in quotes, '2026'"),
        (run("voltage: 4 V, repeats: two"), "repeats: must be a whole number, found 'two'"),
        (f"{HEAD}steps:\n  - prompt: {{text: x, value: {{name: A b}}}}\n",
         "name: 'A b' is not allowed; it must be small letters, digits and _"),
        # a decimal comma
        (run("voltage: 4,5 V"),
         "4:22: voltage: 4,5 V has a decimal comma, which ends a value here; write 4.5 V"),
        (run("voltage: 4 V, rest: 1,5 s"), "4:36: rest: 1,5 s has a decimal comma"),
        (f"{HEAD}steps:\n  - pause: 1,5 min\n", "'1,5 min' has a decimal comma; write '1.5 min'"),
        (f"{HEAD}steps:\n  - sweep: {{mode: hop, speeds: {{from: 16,5 rad/s, to: 17 rad/s, count: "
         "2}}\n", "from: 16,5 rad/s has a decimal comma"),
        (f"{HEAD}steps:\n  - sweep: {{mode: hop, voltages: [4,5 V, 5 V]}}\n",
         "voltages[0]: 4 has no unit; write for example '4 V'; where '4,5 V' was meant, write"),
        (run("voltage: 4 V, duration: 1:30"), "'1:30' may be hours or minutes; write '90 min' or"),
        # hints are of the kind that is allowed
        (f"{HEAD}steps:\n  - prompt: {{text: x, value: {{name: a, quantity: temperature, "
         "low: 10 K}}\n", "low: unknown unit 'K' in '10 K'; known units: degC, °C"),
        (run("speed: 17 rad/s, rest: 3 Sec"), "known units: s, ms, min, h; did you mean 's'?"),
        (run("speed: 170 U/min"), "known units: rad/s, rpm, Hz; did you mean 'rpm'?"),
        (run("speed: 17 m/s"), "known units: rad/s, rpm, Hz; did you mean 'rad/s'?"),
        (run("speed: 17 rad/s, rest: 3 V"), "known units: s, ms, min, h; V is a unit of voltage"),
    ],
)  # fmt: skip
def test_a_wrong_value_is_told_once_with_what_to_write(
    tmp_path: Path, text: str, words: str
) -> None:
    (found,) = faults(tmp_path, text)
    assert words in found


@pytest.mark.parametrize(
    ("given", "wrong", "words"),
    [
        ("bodies:", "markers: {foot: [[12,5, 3, 0]]}\n  bodies:",
         "foot[0]: 4 values, at most 3 are needed; a comma begins the next value, so write 12.5"),
        ("bodies:", "markers: {foot: [['12,5', 3, 1]]}\n  bodies:",
         "foot[0][0]: must be a number, found '12,5'; it has a decimal comma, write 12.5"),
        ("bodies:", "markers: {foot: [[12, 3]]}\n  bodies:", "foot[0]: 2 values are too few"),
        ("date: 2026-03-12", "date: 12.03.2026", "date: must be a date such as 2026-03-12, found"),
        ("model: RD6006", "model: RD6006\n  serial: [1]",
         "serial: must be a whole number or a text, found a list"),
    ],
)  # fmt: skip
def test_a_wrong_value_of_a_bench_too(tmp_path: Path, given: str, wrong: str, words: str) -> None:
    text = (ROOT / FILES["bench"]).read_text(encoding="utf-8")
    (found,) = faults(tmp_path, text.replace(given, wrong, 1), BenchFile)
    assert words in found


@pytest.mark.parametrize("key", ["title", "model", "shape"])
def test_a_text_that_would_steer_a_terminal_or_end_a_name_is_refused(
    tmp_path: Path, key: str
) -> None:
    for written in (r"a\e[31mb", r"a\0b", r"a\x9bb"):
        text = f'schema: workbench/protocol-1\n{key}: "{written}"\nsteps:\n  - prompt: x\n'
        (found,) = faults(tmp_path, text)
        assert found.startswith(f"2:1: {key}: a character that cannot be shown, ")
        assert found.isprintable()


def test_an_include_with_a_nul_is_a_fault(tmp_path: Path) -> None:
    (found,) = faults(tmp_path, f'{HEAD}steps:\n  - include: "a\\0b"\n')
    assert "4:5: include: a character that cannot be shown" in found
