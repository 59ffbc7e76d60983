from pathlib import Path

import pytest

from workbench.errors import FileFaults, InputError
from workbench.schemas import BenchFile, ModelFile, Protocol, ShapeFile, Sheet, load, load_shape

GOOD = """\
schema: workbench/protocol-1
title: Hop
steps:
  - run: {mode: hop, speed: 17 rad/s}
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "p.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def faults(folder: Path, text: str, schema: type = Protocol) -> list[str]:
    """Return each fault as line:column: words."""
    with pytest.raises(FileFaults) as caught:
        load(write(folder, text), schema)
    return [f"{f.line}:{f.column}: {f.text}" for f in caught.value.faults]


def test_a_good_file_is_read_with_its_defaults(tmp_path: Path) -> None:
    run = load(write(tmp_path, GOOD), Protocol).content.steps[0].run
    assert run is not None
    assert (run.speed, run.rest, run.ramp, run.duration, run.role) == (17, 2, 0.5, 10, "train")


def test_every_fault_is_reported_at_once_with_place_range_and_guess(tmp_path: Path) -> None:
    text = """\
schema: workbench/protocol-1
titel: Hop
steps:
  - run: {mode: hopp, sped: 17 rad/s, rest: 2 s, ramp: 0.5, duration: -3 s}
  - sweep: {mode: hop, speeds: [16 rad/s, 17 radd/s], repeats: 0}
  - prompt: x
    run: {mode: hop, voltage: 4 V}
  - foo: 3
"""
    assert faults(tmp_path, text) == [
        "2:1: unknown key 'titel'; did you mean 'title'?",
        "4:11: mode: 'hopp' is not one of hop, clamped, decay, drop; did you mean 'hop'?",
        "4:23: unknown key 'sped'; did you mean 'speed'?",
        "4:50: ramp: 0.5 has no unit; write for example '0.5 s'",
        "4:61: duration: -3 s is not allowed; it must be above 0 s, at most 3600 s",
        "5:43: speeds[1]: unknown unit 'radd/s' in '17 radd/s'; known units: rad/s, rpm, Hz; "
        "did you mean 'rad/s'?",
        "5:55: repeats: 0 is not allowed; it must be at least 1",
        "6:5: steps[2]: a step is exactly one of prompt, pause, run, sweep, staircase, include; "
        "found prompt and run",
        "8:5: unknown key 'foo'; known here: prompt, pause, run, sweep, staircase, include",
    ]


def test_the_caret_stands_under_the_offending_key(tmp_path: Path) -> None:
    with pytest.raises(FileFaults) as caught:
        load(write(tmp_path, GOOD.replace("speed", "sped")), Protocol)
    head, source, caret = str(caught.value).splitlines()
    assert head.endswith("p.yaml:4:22: unknown key 'sped'; did you mean 'speed'?")
    assert source[caret.index("^") :].startswith("sped: 17 rad/s")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "1:1: the file must be a mapping, found nothing"),
        ("- a\n", "1:1: the file must be a mapping, found seq"),
        ("a: [1\n", "2:1: not valid YAML: while parsing a flow sequence expected ',' or ']'"),
        (GOOD + "title: Again\n", '5:1: repeated key "title"'),
        (GOOD.replace("protocol-1", "bench-1"), "1:1: this is a bench, and a protocol is needed"),
        (GOOD.replace("title: Hop\n", ""), "1:1: missing key 'title'"),
        (GOOD.replace("speed: 17 rad/s", "speed: 17"), "4:22: speed: 17 has no unit; write for"),
        (GOOD.replace("17 rad/s", "fast"), "4:22: speed: 'fast' is not a number with a unit"),
        (GOOD.replace("17 rad/s", "17 V"), "unknown unit 'V' in '17 V'; known units: rad/s"),
        (GOOD.replace("speed: 17 rad/s", "rest: 1 s"), "needs either speed or voltage, found 0"),
        (GOOD.replace("mode: hop,", "mode: decay,"), "mode decay has no drive; remove speed"),
        (
            GOOD.replace("hop, speed: 17 rad/s", "decay"),
            "mode decay needs pull, for example 'pull:",
        ),
        (GOOD.replace("hop, speed: 17 rad/s", "drop"), "mode drop needs height, for example"),
        (
            GOOD.replace("hop, speed: 17 rad/s", "drop, pull: 1 N"),
            "mode drop has no pull, only mode decay has; remove it",
        ),
        (
            GOOD.replace("hop, speed: 17 rad/s", "decay, pull: 1 N, ramp: 1 s"),
            "mode decay has no drive; remove ramp",
        ),
        ("a: \t\x01\n", "1:1: not valid YAML: "),
    ],
)
def test_a_fault_is_told_in_words(tmp_path: Path, text: str, words: str) -> None:
    found = faults(tmp_path, text)
    assert any(words in fault for fault in found), found


def test_a_missing_file_is_told_with_a_guess(tmp_path: Path) -> None:
    (tmp_path / "hop-17.yaml").write_text(GOOD)
    with pytest.raises(InputError, match=r"no such file; did you mean 'hop-17.yaml'\?"):
        load(tmp_path / "hop17.yaml", Protocol)


def test_a_binary_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_bytes(b"PK\x03\x04\xff\xfe")
    with pytest.raises(InputError, match="not a UTF-8 text file"):
        load(tmp_path / "p.yaml", Protocol)


def test_a_shape_needs_sixteen_angles(tmp_path: Path) -> None:
    text = (
        "schema: workbench/shape-1\nname: a\nangles: [0.1, 0.2]\nlength: 0.6 m\n"
        "state: unloaded\nsource: none\n"
    )
    assert any(
        "angles: 2 values, at least 16 are needed" in f for f in faults(tmp_path, text, ShapeFile)
    )


def test_an_impossible_mass_and_a_wrong_unit_are_refused(tmp_path: Path, root: Path) -> None:
    text = (root / "models" / "thesis.yaml").read_text(encoding="utf-8")
    bad = text.replace("value: 0.088, unit: kg", "value: -0.088, unit: kg").replace(
        "value: 9.5, unit: N m/rad", "value: 9.5, unit: Nm"
    )
    found = faults(tmp_path, bad, ModelFile)
    assert any("top_mass: -0.088 kg is impossible; it must be above 0" in f for f in found)
    assert any("hinge_stiffness: unit is 'Nm'; it must be 'N m/rad'" in f for f in found)


def test_a_bench_whose_protection_would_trip_at_once_is_refused(tmp_path: Path, root: Path) -> None:
    text = (root / "workbench" / "run" / "bench-virtual.yaml").read_text(encoding="utf-8")
    found = faults(tmp_path, text.replace("over_voltage: 6 V", "over_voltage: 5 V"), BenchFile)
    assert any("over_voltage 5 V must be above voltage 5.5 V" in f for f in found)


def test_a_sheet_run_needs_a_drive(tmp_path: Path) -> None:
    text = "schema: workbench/sheet-1\nruns:\n  - {take: a.csv, mode: hop}\n"
    assert faults(tmp_path, text, Sheet) == ["3:5: runs[0]: mode hop needs either omega or voltage"]


def test_an_unknown_shape_names_those_that_exist(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"no shape named 'thesis-inital'; did you mean 'thesis-initial'\?; built"
    ):
        load_shape("thesis-inital", tmp_path)


@pytest.mark.parametrize(
    ("connection", "words"),
    [
        ("{kind: tcp, address: 10.0.0.5}", "address: '10.0.0.5' is not host:port with a port from"),
        ("{kind: rtu-over-tcp, address: lab-supply}", "address: 'lab-supply' is not host:port"),
        ("{kind: tcp, address: '10.0.0.5:'}", "is not host:port"),
        ("{kind: tcp, address: ':5025'}", "is not host:port"),
        ("{kind: tcp, address: '10.0.0.5:99999'}", "a port from 1 to 65535"),
        ("{kind: tcp, address: '10.0.0.5:scpi'}", "is not host:port"),
        ("{kind: tcp, address: 'tcp://10.0.0.5:5025'}", "is not host:port"),
        ("{kind: serial, port: COM3, address: '10.0.0.5:5025'}", "kind: serial has no address"),
        ("{kind: tcp, port: COM3, address: '10.0.0.5:5025'}", "kind: tcp has no port; remove it"),
        ("{kind: rtu-over-tcp, port: A, address: 'a:5'}", "kind: rtu-over-tcp has no port"),
        ("{kind: simulated, port: COM3}", "kind: simulated has no port; remove it"),
        ("{kind: tcp}", "kind: tcp needs an address, host:port"),
    ],
)
def test_a_supply_that_cannot_be_reached_as_it_is_written_is_told(
    tmp_path: Path, root: Path, connection: str, words: str
) -> None:
    text = (root / "docs" / "examples" / "lab-bench.yaml").read_text(encoding="utf-8")
    head, _, tail = text.partition("  connection:")
    text = f"{head}  connection: {connection}\n{tail.partition(chr(10))[2]}"
    (found,) = faults(tmp_path, text, BenchFile)
    assert found.startswith("7:3: connection: ")
    assert words in found
