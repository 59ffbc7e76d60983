"""`workbench template board` and `template read`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from workbench.cli.app import app
from workbench.errors import InputError
from workbench.schemas import load_shape

TARGET = load_shape("thesis-initial", Path()).content


def run(*words: str) -> Result:
    return CliRunner().invoke(app, ["template", *words], catch_exceptions=False)


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    degrees = np.degrees(TARGET.angles)
    degrees[4] += 3
    path = tmp_path / "angles.csv"
    path.write_text("".join(f"{one:.4f},0.2\n" for one in degrees))
    return path


def test_the_board_is_written(tmp_path: Path) -> None:
    told = json.loads(run("board", "--out", str(tmp_path / "b.pdf"), "--json").stdout)
    assert told["pages"] == 2
    assert Path(told["files"][0]).read_bytes().startswith(b"%PDF")


def test_measured_angles_become_a_shape_and_a_page(measured: Path, tmp_path: Path) -> None:
    out = tmp_path / "as-bent.yaml"
    words = ["--angles", str(measured), "--shape", "thesis-initial", "--out", str(out)]
    done = run("read", *words, "--duration", "0.5", "--draws", "2", "--json")
    told = json.loads(done.stdout)
    assert [one["joint"] for one in told["correct"]] == [4]
    assert told["correct"][0]["deg"] == pytest.approx(-3, abs=1e-3)
    assert told["distance"]["target_m"] != told["distance"]["bent_m"]
    assert len(told["distance"]["around_bent_m"]) == 2
    assert [Path(file).suffix for file in told["files"]] == [".yaml", ".html", ".svg"]
    assert load_shape(str(out), Path()).content.uncertainty is not None


def test_people_read_what_to_do(measured: Path, tmp_path: Path) -> None:
    out = str(tmp_path / "as-bent.yaml")
    done = run(
        "read", "--angles", str(measured), "--shape", "thesis-initial", "--out", out,
        "--no-simulate",
    )  # fmt: skip
    assert "open by 3.0" in done.stdout
    assert "tip off by" in done.stdout
    assert "distance" not in done.stdout


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (["--shape", "thesis-initial"], "give one of: a photograph, --angles, --points"),
        (["x.jpg", "--angles", "a.csv", "--shape", "thesis-initial"], "give one of"),
        (["x.jpg"], "--shape is needed"),
        (["x.jpg", "--shape", "thesis-initial", "--h", "198"], "--h 198 mm is -1.00 % off"),
        (["x.jpg", "--shape", "thesis-initial", "--v", "408"], r"--v 408 mm is \+2.00 % off"),
    ],
)
def test_what_cannot_be_is_refused(words: list[str], match: str) -> None:
    with pytest.raises(InputError, match=match):
        run("read", *words)
