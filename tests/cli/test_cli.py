"""The command line as people and scripts use it: words, objects, exit codes."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from datetime import datetime
from decimal import Decimal
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
import typer.main
from typer.testing import CliRunner

from tests.bundles import asked_for
from tests.conftest import Command
from workbench.bundle import Bundle
from workbench.cli.app import app
from workbench.run import load_bench, read_experiment

PROTOCOL = """\
schema: workbench/protocol-1
title: Short hop
steps:
  - run: {mode: hop, speed: 17 rad/s, rest: 1 s, duration: 2 s}
"""


@pytest.fixture
def protocol(tmp_path: Path) -> Path:
    path = tmp_path / "short.yaml"
    path.write_text(PROTOCOL)
    return path


def test_the_version_is_the_installed_package_s(workbench: Command) -> None:
    assert workbench("--version").out == f"workbench {metadata.version('hopping-workbench')}\n"


def verbs() -> list[list[str]]:
    """Every command that can be called, as its words."""
    found: list[list[str]] = []

    def walk(command: Any, words: list[str]) -> None:
        inner = getattr(command, "commands", None)
        if inner is None:
            found.append(words)
            return
        context = command.make_context("workbench", [], resilient_parsing=True)
        for name in inner:
            walk(command.resolve_command(context, [name])[1], [*words, name])

    walk(typer.main.get_command(app), [])
    return found


@pytest.mark.parametrize("words", verbs(), ids=" ".join)
def test_every_command_has_help_with_an_example(words: list[str]) -> None:
    result = CliRunner().invoke(app, [*words, "--help"])
    assert result.exit_code == 0
    assert f"Example: workbench {' '.join(words)}" in " ".join(result.output.split())


def test_run_prints_one_object_with_path_distances_and_error(
    workbench: Command, protocol: Path, tmp_path: Path
) -> None:
    answer = workbench("run", protocol, "--bench", "virtual", "--json", "--runs", tmp_path / "r")
    assert answer.code == 0
    found = answer.json
    assert found["status"] == "complete"
    assert Path(found["bundle"]).is_dir()
    for who in ("real", "twin"):
        assert set(found[who]) >= {"distance_m", "hop_height_m", "speed_rad_s"}
        assert all(isinstance(found[who][k], float) for k in ("distance_m", "hop_height_m"))
    assert found["error_mm"] > 0
    assert found["runs"][0]["bundle"] == found["bundle"]
    assert "drive 2 s: 4.52 V, 16.988 rad/s" in answer.err

    assert workbench("runs", "verify", found["bundle"]).out.endswith(": ok\n")
    (listed,) = workbench("runs", "list", "--runs", tmp_path / "r", "--json").json["runs"]
    assert listed.items() >= {k: v for k, v in found.items() if k != "runs"}.items()
    by_name = workbench("runs", "verify", Path(found["bundle"]).name, "--runs", tmp_path / "r")
    assert by_name.out == f"{Path(found['bundle']).name}: ok\n"
    shown = workbench("runs", "show", found["bundle"])
    assert "error of the twin" in shown.out


@pytest.mark.usefixtures("without_views")
def test_run_prints_a_table_for_people(workbench: Command, protocol: Path, tmp_path: Path) -> None:
    answer = workbench("run", protocol, "--runs", tmp_path / "r")
    assert answer.code == 0
    assert "distance [m]" in answer.out
    assert "twin - real" in answer.out
    assert "recording: workbench review " in answer.out


def test_a_dry_run_writes_nothing_and_prints_every_step(
    workbench: Command, protocol: Path, tmp_path: Path
) -> None:
    answer = workbench("run", protocol, "--dry-run", "--json", "--runs", tmp_path / "r")
    (run,) = answer.json["runs"]
    assert run["voltage_V"] == 4.52
    assert [step["voltage_V"] for step in run["steps"]] == [1.0, 1.7, 2.41, 3.11, 3.82, 4.52]
    assert answer.json["seconds"] == 3.0
    assert not (tmp_path / "r").exists()
    assert "4.52" in workbench("run", protocol, "--dry-run").out


@pytest.mark.usefixtures("without_views")
def test_a_decay_is_planned_run_and_told_by_its_ringing(
    workbench: Command, protocol: Path, tmp_path: Path
) -> None:
    drive = "{mode: hop, speed: 17 rad/s, rest: 1 s, duration: 2 s}"
    protocol.write_text(PROTOCOL.replace(drive, "{mode: decay, pull: 0.39 N, duration: 3 s}"))
    assert "pull 0.39 N" in workbench("run", protocol, "--dry-run").out
    (run,) = workbench("run", protocol, "--dry-run", "--json").json["runs"]
    assert (run["mode"], run["pull_N"], run["height_m"]) == ("decay", 0.39, None)
    assert run["prompts"][1] == "Burn or cut the thread now, then confirm."
    answer = workbench("run", protocol, "--runs", tmp_path / "r")
    assert answer.code == 0
    assert "ring frequency [Hz]" in answer.out
    assert "prompt: Burn or cut the thread now" in answer.err
    assert "distance" not in answer.out
    (listed,) = workbench("runs", "list", "--runs", tmp_path / "r", "--json").json["runs"]
    assert set(listed["real"]) == {"displacement_m", "ring_hz", "damping_ratio"}
    assert workbench("runs", "list", "--runs", tmp_path / "r").code == 0
    assert "damping ratio" in workbench("runs", "show", listed["bundle"]).out


@pytest.mark.parametrize(
    ("words", "displacement_m", "title"),
    [
        (["--mode", "decay", "--pull", "0.39"], 0.0157, "decay pulled with 0.39 N for 5 s"),
        (["--mode", "drop", "--height", "20"], 0.0245, "drop from 20 mm for 5 s"),
    ],
)
def test_a_release_is_simulated(
    workbench: Command, words: list[str], displacement_m: float, title: str
) -> None:
    found = workbench("simulate", *words, "--duration", 5, "--json").json
    assert found["displacement_m"] == pytest.approx(displacement_m, abs=0.0003)
    assert found["outcome"] == "completed"
    told = workbench("simulate", *words, "--duration", 5).out
    assert title in " ".join(told.split())
    assert "rotor speed" not in told


def test_a_faulty_protocol_ends_with_2_and_all_faults(workbench: Command, protocol: Path) -> None:
    protocol.write_text(PROTOCOL.replace("speed", "sped").replace("title", "titel"))
    answer = workbench("run", protocol)
    assert answer.code == 2
    assert answer.out == ""
    assert "short.yaml:2:1: unknown key 'titel'; did you mean 'title'?" in answer.err
    assert "short.yaml:4:22: unknown key 'sped'; did you mean 'speed'?" in answer.err
    assert "Traceback" not in answer.err


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["run", "gone.yaml"], 2, "gone.yaml: no such file"),
        (["run", "PROTOCOL", "--bench", "virtul"], 2, "no bench named 'virtul'; did you mean"),
        (["schema", "protocl"], 2, "no schema 'protocl'; did you mean 'protocol'?"),
        (["runs", "verify", "gone"], 2, "gone: no run, folder of runs"),
        (["review", "gone"], 2, "gone: no run, folder of runs"),
        (["simulate", "--model", "tesis"], 2, "no model named 'tesis'; did you mean 'thesis'?"),
        (["simulate", "--mode", "fly"], 2, "mode 'fly' cannot be simulated"),
        (["simulate", "--mode", "decay", "--pull", "90"], 2, "this robot does not stand"),
        (["simulate", "--omega", "1e9"], 2, "omega 1e+09 rad/s is outside -60 to 60 rad/s"),
        (["modes", "--driven", "--hold", "1"], 2, "1 s at each speed are too short for twice 5"),
        (["ingest", "gone.csv"], 2, "gone.csv"),
        (["supply", "read", "--bench", "virtual"], 2, "bench 'virtual' has no real supply"),
        (["supply", "simulate", "volta"], 2, "no simulated supply 'volta'; there are riden, dps,"),
        (["supply", "simulate", "korad", "--model", "RD6006"], 2, "RD6006 is of family riden, not"),
        (["supply", "simulate", "--fault", "silnt"], 2, "no fault 'silnt'; did you mean 'silent'?"),
        (["supply", "probe", "--family", "volta"], 2, "no supply family 'volta'; there are riden,"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_bad_input_is_answered_in_words(
    workbench: Command, protocol: Path, words: list[str], code: int, text: str
) -> None:
    answer = workbench(*(protocol if word == "PROTOCOL" else word for word in words))
    assert answer.code == code
    assert text in answer.err
    assert "Traceback" not in answer.err


def test_a_robot_that_cannot_stand_is_refused_before_anything_is_switched(
    workbench: Command, root: Path, protocol: Path, tmp_path: Path
) -> None:
    text = (root / "models" / "thesis-initial.yaml").read_text()
    (tmp_path / "bent.yaml").write_text(text.replace("-2.558", "-0.5"))
    protocol.write_text(PROTOCOL.replace("steps:", "shape: bent.yaml\nsteps:"))
    answer = workbench("run", protocol, "--runs", tmp_path / "r")
    assert answer.code == 2
    assert "this robot does not stand: with T at z = " in answer.err
    assert not (tmp_path / "r").exists()


@pytest.mark.parametrize(
    ("effect", "answer_begins"),
    [
        ("{name: tehter}", "effect 'tehter' is unknown"),
        (
            "{name: ground_slope, parameters: {slop: 0.1}}",
            "effect ground_slope has no quantity 'slop'",
        ),
        (
            "{name: ground_slope, parameters: {slope: 3}}",
            "effect ground_slope: slope is 3 rad; it must lie within -0.2 and 0.2 rad",
        ),
    ],
)
def test_a_model_with_an_impossible_effect_is_refused_before_anything_is_switched(
    workbench: Command, root: Path, protocol: Path, tmp_path: Path, effect: str, answer_begins: str
) -> None:
    text = (root / "models" / "thesis.yaml").read_text()
    (tmp_path / "wrong.yaml").write_text(text.replace("effects: []", f"effects: [{effect}]"))
    protocol.write_text(PROTOCOL.replace("steps:", "model: wrong.yaml\nsteps:"))
    answer = workbench("run", protocol, "--dry-run")
    assert answer.code == 2
    assert answer_begins in answer.err


def test_an_unknown_option_ends_with_2(workbench: Command) -> None:
    assert workbench("run", "--bensh", "x").code == 2


def test_a_supply_that_is_not_there_ends_with_3(
    workbench: Command, root: Path, tmp_path: Path
) -> None:
    text = (root / "docs" / "examples" / "lab-bench.yaml").read_text()
    bench = tmp_path / "bench.yaml"
    place = "{kind: rtu-over-tcp, address: '127.0.0.1:9'}"
    head, _, tail = text.partition("  connection:")
    bench.write_text(head + f"  connection: {place}\n" + tail.split("\n", 1)[1])
    answer = workbench("supply", "read", "--bench", bench)
    assert answer.code == 3
    assert "127.0.0.1:9 not reachable" in answer.err


def test_modes_prints_its_object(workbench: Command) -> None:
    point = workbench("modes", "--json").json
    locked = workbench("modes", "--rotor-angle", "270", "--increments", "24", "--json").json
    assert "driven" not in point
    assert [m["hz"] for m in point["clamped"][:2]] == pytest.approx([1.59, 2.93], abs=0.01)
    assert locked["clamped"][0]["hz"] < point["clamped"][0]["hz"]
    for mode in point["clamped"]:
        assert set(mode) == {"hz", "damping_ratio", "top_direction"}
        assert len(mode["top_direction"]) == 2


def test_modes_driven_prints_both_sweeps_apart_from_the_modes(workbench: Command) -> None:
    words = ("modes", "--driven", "--increments", "4", "--slowest", "12", "--fastest", "13")
    found = workbench(*words, "--hold", "6", "--json").json
    assert [row["speed_rad_s"] for row in found["driven"]["up"]] == [12, 12.5, 13]
    assert [row["speed_rad_s"] for row in found["driven"]["down"]] == [13, 12.5, 12]
    assert 0.005 < found["driven"]["up"][0]["amplitude_z_m"] < 0.1
    shown = workbench(*words, "--hold", "6").out
    assert "linear modes, foot clamped, rotor a point mass at T" in shown
    assert "driven peaks, which are not the linear modes" in shown


def test_simulate_prints_its_object(workbench: Command) -> None:
    found = workbench("simulate", "--duration", "4", "--spread", "4", "--json").json
    assert set(found) >= {
        "distance_m", "hop_height_m", "fell", "cost_of_transport", "simulated_s", "wall_s",
    }  # fmt: skip
    assert found["fell"] is False
    assert found["simulated_s"] == pytest.approx(4.0)
    assert found["distance_spread"]["draws"] == 4
    assert found["distance_spread"]["low_m"] < found["distance_spread"]["high_m"]
    shown = workbench("simulate", "--duration", "4", "--spread", "4").out
    assert re.search(r"its spread +│ -?\d+ to \d+ mm, median -?\d+ mm \(4 draws\)", shown)
    alone = workbench("simulate", "--duration", "1", "--spread", "0", "--json").json
    assert "distance_spread" not in alone


def test_verify_ends_with_1_when_a_file_changed(
    workbench: Command, finished: Path, tmp_path: Path
) -> None:
    (hop,) = finished.glob("*_hop-*")
    path = Path(shutil.copytree(hop, tmp_path / hop.name))
    take = next((path / "take").iterdir())
    take.write_bytes(take.read_bytes() + b"x")
    answer = workbench("runs", "verify", path)
    assert answer.code == 1
    assert "changed since the run was finished" in answer.out


def test_schema_and_doctor_and_models_answer(workbench: Command) -> None:
    assert json.loads(workbench("schema", "bench").out)["title"] == "BenchFile"
    assert workbench("doctor", "--json").json["ok"] is True
    models = workbench("supply", "models", "--json").json["models"]
    assert (models[0]["name"], models[0]["ids"]) == ("RD6006", [60061, 60062])
    channels = next(model["channels"] for model in models if model["name"] == "DP832")
    assert [own["voltage_max_V"] for own in channels] == [30, 30, 5]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no SIGINT to one process")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_a_real_time_run_ends_with_130_and_the_output_off(
    root: Path, protocol: Path, tmp_path: Path, number: signal.Signals
) -> None:
    text = (root / "workbench" / "run" / "bench-virtual.yaml").read_text()
    bench = tmp_path / "bench.yaml"
    bench.write_text(text.replace("  seed: 17\n", "  seed: 17\n  real_time: true\n"))
    command = [sys.executable, "-c", "from workbench.cli import main; main()"]
    words = ["run", str(protocol), "--bench", str(bench), "--runs", str(tmp_path / "r")]
    process = subprocess.Popen(
        [*command, *words], stderr=subprocess.PIPE, text=True, env=os.environ | {"NO_COLOR": "1"}
    )
    try:
        deadline = time.monotonic() + 60
        while '"output_on"' not in "".join(
            f.read_text() for f in (tmp_path / "r").glob("*/journal.jsonl")
        ):
            assert time.monotonic() < deadline
            assert process.poll() is None
            time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(number)
        _, err = process.communicate(timeout=30)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 130
    assert "stopped by the user" in err
    assert "the output is off, confirmed" in err
    (journal,) = (tmp_path / "r").glob("*/journal.jsonl")
    assert '"event": "output_off", "confirmed": true' in journal.read_text()


def test_a_dry_run_of_a_resume_tells_what_is_skipped_and_made(
    workbench: Command, protocol: Path, tmp_path: Path
) -> None:
    protocol.write_text(PROTOCOL.replace("duration: 2 s", "duration: 1 s, repeats: 3"))
    assert "repeats: 3" in protocol.read_text()
    bench = load_bench("virtual")
    asked = read_experiment(protocol, bench, Decimal("0.01"))
    facts = {"experiment": "e", "inputs": asked.inputs()}
    first = Bundle.create(tmp_path / "r", "x", datetime.now(), asked_for(**facts, number=1))
    first.record.end("complete", None)
    made = Bundle.create(tmp_path / "r", "x", datetime.now(), asked_for(**facts, number=2))
    words = ("run", protocol, "--dry-run", "--resume", made.path, "--runs", tmp_path / "r")
    answer = workbench(*words)
    told = "e: skipped would be run 1, made runs 2 to 3; begun before and made again: run 2"
    assert told in " ".join(answer.err.split())
    assert "2 runs, about" in answer.err
    assert not made.is_closed()
    found = workbench(*words, "--json").json
    assert found["resume"] == {
        "experiment": "e",
        "skipped": [1],
        "made": [{"number": 2, "attempt": 2}, {"number": 3, "attempt": 1}],
    }
    assert [run["number"] for run in found["runs"]] == [2, 3]
