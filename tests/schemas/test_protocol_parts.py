"""Protocols that include files of steps."""

from decimal import Decimal
from pathlib import Path

import pytest

from workbench.errors import FileFaults
from workbench.run import load_bench
from workbench.schemas import Plan, PlannedPrompt, load_protocol, make_plan

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
    write(tmp_path, "parts/clamp.png", "")
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


@pytest.mark.parametrize(
    ("step", "place"),
    [
        ("prompt: {text: x, picture: NAME}", "3:23"),
        ("run: {mode: hop, voltage: 4 V, before: [{text: x, picture: NAME}]}", "3:55"),
        ("run: {mode: hop, voltage: 4 V, after: [a, {text: x, picture: NAME}]}", "3:57"),
        ("sweep: {mode: hop, voltages: [4 V], after: [{text: x, picture: NAME}]}", "3:59"),
        ("staircase: {mode: hop, voltages: [4 V], dwell: 2 s, before: [{text: x, picture: NAME}]}",
         "3:76"),
    ],
)  # fmt: skip
def test_a_picture_that_is_not_there_is_told_where_it_is_named(
    tmp_path: Path, step: str, place: str
) -> None:
    write(tmp_path, "clamp.png", "")
    (tmp_path / "folder").mkdir()
    path = write(tmp_path, "p.yaml", f"{HEAD}  - include: part.yaml\n")
    for name, words in (
        ("clamps.png", "no such picture: .*clamps.png; did you mean 'clamp.png'"),
        ("folder", "a folder, no picture: .*folder"),
        ("gone/x.png", "no such picture: .*x.png"),
        ("z" * 300, "no such picture"),
    ):
        write(tmp_path, "part.yaml", f"{PART}  - {step.replace('NAME', name)}\n")
        with pytest.raises(FileFaults, match=rf"part\.yaml:{place}: {words}"):
            load_protocol(path)


def test_parts_inside_parts_have_an_end(tmp_path: Path) -> None:
    path = write(tmp_path, "p.yaml", f"{HEAD}  - include: a0.yaml\n")
    for i in range(30):
        write(tmp_path, f"a{i}.yaml", f"{PART}  - include: a{i + 1}.yaml\n")
    write(tmp_path, "a30.yaml", f"{PART}  - prompt: x\n")
    with pytest.raises(FileFaults, match="more than 20 parts inside each other"):
        load_protocol(path)


def test_parts_that_include_parts_many_times_are_refused_at_once(tmp_path: Path) -> None:
    path = write(tmp_path, "p.yaml", HEAD + "  - include: a0.yaml\n" * 10)
    for i in range(12):
        write(tmp_path, f"a{i}.yaml", PART + f"  - include: a{i + 1}.yaml\n" * 10)
    write(tmp_path, "a12.yaml", f"{PART}  - prompt: x\n")
    with pytest.raises(
        FileFaults, match="50001 steps and prompts up to here, and a protocol may have at most"
    ):
        plan_of(path)
