"""`workbench optimize` and `workbench thesis`: small searches of short hops."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.conftest import Command
from workbench.schemas import load_shape

MAIN = [sys.executable, "-c", "from workbench.cli import main; main()"]
SMALL = ("--algorithm", "ga", "--duration", 1, "--evaluations", 24)


def test_a_search_tells_what_it_found(workbench: Command, tmp_path: Path) -> None:
    answer = workbench("optimize", "--omega", 17, *SMALL, "--out", tmp_path / "s", "--json")
    assert answer.code == 0, answer.err
    found = answer.json
    assert found["evaluations"] == 24
    assert found["generations"] == 2 == len(found["history"])
    assert found["best_distance_m"] == found["goals"]["distance"] > 0
    assert found["wall_s"] > 0
    spread = found["distance_spread"]
    assert 0 < spread["low_m"] < spread["median_m"] < spread["high_m"]
    assert spread["draws"] == 16
    assert load_shape(found["best_shape"], Path()).content.source.startswith("designed ")
    assert Path(found["report"]).exists()
    again = workbench(
        "simulate", "--shape", found["best_shape"], "--omega", 17, "--duration", 1, "--json"
    )
    assert again.json["distance_m"] == pytest.approx(found["best_distance_m"], abs=1e-9)

    shown = workbench("optimize", "--resume", tmp_path / "s").out
    assert Path(found["best_shape"]).stem.removeprefix("shape-") in shown, "g2-best"
    assert "cost [-]" in shown, "a ratio has no unit"
    assert f"median {1000 * spread['median_m']:.0f} mm (16 draws)" in shown
    page = Path(found["report"]).read_text(encoding="utf-8")
    assert f"median {1000 * spread['median_m']:.0f} mm (16 draws)" in page


@pytest.mark.long
def test_a_search_goes_on_from_its_folder_to_the_same_end(
    workbench: Command, tmp_path: Path
) -> None:
    whole = workbench("optimize", *SMALL, "--seed", 2, "--out", tmp_path / "a", "--json").json
    begun = (*SMALL[:-1], 12)
    workbench("optimize", *begun, "--seed", 2, "--out", tmp_path / "b")
    rest = workbench("optimize", "--resume", tmp_path / "b", "--evaluations", 24, "--json").json
    assert rest["history"] == whole["history"]
    assert Path(rest["best_shape"]).name == Path(whole["best_shape"]).name


def test_going_on_as_another_search_is_refused(workbench: Command, tmp_path: Path) -> None:
    workbench("optimize", *SMALL, "--out", tmp_path / "a")
    answer = workbench("optimize", "--resume", tmp_path / "a", "--omega", 18, "--min-radius", 50)
    assert answer.code == 2
    assert "leave out --omega, --min-radius" in answer.err


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--goal", "distance,cost"), "two different goals go with --algorithm pareto"),
        (("--goal", "speed"), "no goal named 'speed'; there are distance, height"),
        (("--vary", "top_mass=1"), "write NAME=LOWER:UPPER"),
        (("--bounds", "thesiss"), "no bounds named 'thesiss'; did you mean 'thesis'?"),
        (("--shape", "nowhere"), "no shape named 'nowhere'"),
        (("--omega", "1e6"), "omega 1e+06 rad/s is outside"),
        (("--scheduler", "tcp://127.0.0.1:1"), "no scheduler answers at tcp://127.0.0.1:1"),
    ],
)
def test_bad_input_is_answered_with_what_to_do(
    workbench: Command, tmp_path: Path, words: tuple[str, ...], why: str
) -> None:
    answer = workbench("optimize", *words, "--out", tmp_path / "s")
    assert answer.code == 2
    assert why in answer.err.replace("\n", " ")


def test_a_stopped_search_says_how_to_go_on(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    words = ["optimize", "--algorithm", "ga", "--duration", "1", "--out", str(folder)]
    running = subprocess.Popen([*MAIN, *words], stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + 60
    while not (folder / "search.json").exists() and time.monotonic() < end:
        time.sleep(0.1)
    running.send_signal(signal.SIGINT)
    _, told = running.communicate(timeout=60)
    assert running.returncode == 130
    assert f"go on with: workbench optimize --resume {folder}" in told
    assert len(json.loads((folder / "search.json").read_text())["generations"]) >= 1


@pytest.mark.parametrize(
    ("experiment", "words"),
    [
        ("increase", "almost 600"),
        ("repeatability", "0.97 to 1.48, once 2.05"),
        ("cross", "each shape goes farther at its own speed"),
        ("resonance", "2.88"),
        ("speeds", "/ 21.27"),
    ],
)
def test_an_experiment_of_the_thesis_is_beside_its_numbers(
    workbench: Command, tmp_path_factory: pytest.TempPathFactory, experiment: str, words: str
) -> None:
    folder = tmp_path_factory.getbasetemp() / "thesis"  # searches are shared, as a user's are
    answer = workbench("thesis", experiment, "--quick", "--out", folder)
    assert answer.code == 0, answer.err
    assert words in answer.out


def test_searches_of_other_settings_are_not_mixed(workbench: Command, tmp_path: Path) -> None:
    assert workbench("thesis", "increase", "--quick", "--out", tmp_path).code == 0
    answer = workbench("thesis", "increase", "--quick", "--bounds", "appendix-e", "--out", tmp_path)
    assert answer.code == 2
    assert "holds a search with other settings; give another --out" in answer.err
