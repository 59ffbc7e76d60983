"""Protocols that include files of steps."""

from decimal import Decimal
from pathlib import Path

import pytest

from workbench.bench import load_bench
from workbench.errors import FileFaults
from workbench.protocol import Plan, PlannedPrompt, load_protocol, make_plan

HEAD = "schema: workbench/protocol-1\ntitle: T\nsteps:\n"
PART = "schema: workbench/part-1\nsteps:\n"


def plan_of(path: Path) -> Plan:
    protocol, parts = load_protocol(path)
    return make_plan(protocol, load_bench("virtual").content, Decimal("0.01"), parts)


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return path


def test_parts_are_found_from_their_own_folder_at_any_depth(tmp_path: Path) -> None:
    write(tmp_path, "parts/clamp.yaml", f"{PART}  - prompt: Clamp.\n  - include: warm.yaml\n")
    write(tmp_path, "parts/warm.yaml", f"{PART}  - run: {{mode: clamped, voltage: 3 V}}\n")
    run = "  - run: {mode: hop, voltage: 4 V}\n"
    twice = "  - include: parts/clamp.yaml\n"
    plan = plan_of(write(tmp_path, "p.yaml", HEAD + twice + run + twice))
    assert [run.name for run in plan.runs] == ["clamped-10.30", "hop-14.70", "clamped-10.30"]
    assert sum(isinstance(item, PlannedPrompt) for item in plan.items) == 2


def test_a_picture_and_a_shape_are_found_beside_the_file_that_names_them(tmp_path: Path) -> None:
    text = (
        f"{PART}  - prompt: {{text: Like this., picture: clamp.png}}\n"
        "  - run: {mode: hop, voltage: 4 V, shape: bent.yaml}\n"
    )
    write(tmp_path, "parts/clamp.yaml", text)
    plan = plan_of(write(tmp_path, "p.yaml", f"{HEAD}  - include: parts/clamp.yaml\n"))
    prompt, run = plan.items[0], plan.runs[0]
    assert isinstance(prompt, PlannedPrompt)
    assert run.shape is not None
    assert prompt.picture is not None
    assert {prompt.picture.parent.name, run.shape.beside.name} == {"parts"}


def test_a_fault_in_a_part_is_told_there(tmp_path: Path) -> None:
    write(tmp_path, "parts/hop.yaml", f"{PART}  - run: {{mode: hop, voltage: 9 V}}\n")
    path = write(tmp_path, "p.yaml", f"{HEAD}  - include: parts/hop.yaml\n")
    with pytest.raises(FileFaults, match=r"hop.yaml:3:22: 9 V is outside the range of calibration"):
        plan_of(path)


def test_a_part_that_is_missing_or_includes_itself_is_told_where_it_is_named(
    tmp_path: Path,
) -> None:
    path = write(tmp_path, "p.yaml", f"{HEAD}  - include: gone.yaml\n")
    with pytest.raises(FileFaults, match=r"p.yaml:4:5: no such file: .*gone.yaml"):
        load_protocol(path)
    write(tmp_path, "a.yaml", f"{PART}  - include: b.yaml\n")
    write(tmp_path, "b.yaml", f"{PART}  - include: a.yaml\n")
    path = write(tmp_path, "p.yaml", f"{HEAD}  - include: a.yaml\n")
    with pytest.raises(FileFaults, match=r"b.yaml:3:5: .*itself: a.yaml -> b.yaml -> a.yaml"):
        load_protocol(path)


def test_a_protocol_is_no_part(tmp_path: Path) -> None:
    path = write(tmp_path, "p.yaml", f"{HEAD}  - include: p2.yaml\n")
    write(tmp_path, "p2.yaml", f"{HEAD}  - prompt: x\n")
    with pytest.raises(FileFaults, match="this is a protocol, and a part is needed here"):
        load_protocol(path)
