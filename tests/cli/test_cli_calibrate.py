"""`workbench calibrate` from runs on the virtual bench to a bench that names the file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.bundles import carried_out, manifest_of
from tests.conftest import Command
from workbench.bundle import Bundle
from workbench.schemas import CalibrationFile, Protocol, load

STEPS = """\
  - sweep: {mode: clamped, voltages: [3 V, 4.5 V, 2 V, 3.7 V], rest: 1 s, ramp: 0 s, duration: 5 s}
  - run: {mode: clamped, voltage: 1 V, rest: 1 s, ramp: 0 s, duration: 3 s}
"""
SLOPE, OFFSET = 4.38, -2.87  # of bench-virtual.yaml


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four runs that count and one that is too slow."""
    folder = tmp_path_factory.mktemp("line")
    carried_out(folder, STEPS)
    return folder / "runs"


@pytest.mark.budget(20)  # makes the five runs of this module
def test_the_line_is_found_written_and_never_overwritten(
    workbench: Command, runs: Path, tmp_path: Path
) -> None:
    out = tmp_path / "calibrations" / "day.yaml"
    answer = workbench("calibrate", runs, "--out", out, "--id", "spring", "--json")
    assert answer.code == 0, answer.err
    found = answer.json
    slope, offset = found["parameters"]["slope"], found["parameters"]["offset"]
    assert slope["value"] == pytest.approx(SLOPE, rel=0.005)
    assert offset["value"] == pytest.approx(OFFSET, abs=0.03)
    assert slope["interval90"][0] < slope["value"] < slope["interval90"][1]
    assert (slope["unit"], offset["unit"]) == ("rad/s/V", "rad/s")
    assert (found["not_determined"], found["warnings"]) == ([], [])
    assert not found["validation"]["checks"]["curvature"]["found"]
    (left,) = found["left_out"]
    assert "clamped-1.50" in left["run"]
    assert "turns 0.4 times" in left["reason"]
    assert Path(found["figure"]).read_text(encoding="utf-8").startswith("<?xml")

    file = load(out, CalibrationFile).content
    assert (file.id, file.lowest, file.highest, len(file.runs)) == ("spring", 2.0, 4.5, 4)
    assert file.slope == pytest.approx(slope["value"], rel=1e-5)
    again = workbench("calibrate", runs, "--out", out)
    assert again.code == 2
    assert "day.yaml: exists and is never overwritten; give another --out" in again.err


def test_voltages_that_tell_no_line_get_a_protocol_that_does(
    workbench: Command, runs: Path, tmp_path: Path
) -> None:
    two = sorted(runs.iterdir())[:2]
    answer = workbench("calibrate", *two, "--out", tmp_path / "c.yaml", "--json")
    assert answer.code == 1
    assert answer.json["parameters"] == {}
    assert "have 2 different voltages (3.00 V, 4.50 V)" in answer.json["not_determined"][0]
    proposed = Path(answer.json["next_protocol"])
    sweep = load(proposed, Protocol).content.steps[1].sweep
    assert sweep is not None
    assert sweep.voltages is not None
    assert (len(sweep.voltages), sweep.order) == (10, "random")
    assert workbench("run", proposed, "--dry-run").code == 0
    assert not (tmp_path / "c.yaml").exists()


@pytest.mark.long
def test_a_bench_names_the_file_and_its_bundles_keep_it(
    workbench: Command, runs: Path, tmp_path: Path, root: Path
) -> None:
    workbench("calibrate", runs, "--out", tmp_path / "cal" / "day.yaml")
    text = (root / "workbench" / "run" / "bench-virtual.yaml").read_text(encoding="utf-8")
    begin, end = text.index("calibration:"), text.index("tracking:")
    bench = tmp_path / "bench.yaml"
    bench.write_text(text[:begin] + "calibration: cal/day.yaml\n" + text[end:], encoding="utf-8")
    short = tmp_path / "p.yaml"
    short.write_text(
        "schema: workbench/protocol-1\ntitle: T\nsteps:\n"
        "  - run: {mode: clamped, speed: 10 rad/s, rest: 1 s, duration: 2 s}\n"
    )
    answer = workbench("run", short, "--bench", bench, "--runs", tmp_path / "r", "--json")
    assert answer.code == 0, answer.err
    bundle = Bundle.open(Path(answer.json["bundle"]))
    assert manifest_of(bundle)["calibration"] == "day"
    kept = bundle.document("calibration").read_bytes()
    assert kept == (tmp_path / "cal" / "day.yaml").read_bytes()
    resolved = json.loads((bundle.path / "bench.json").read_text(encoding="utf-8"))
    assert resolved["calibration"]["slope"] == pytest.approx(SLOPE, rel=0.005)
    assert manifest_of(bundle)["speed_rad_s"] == pytest.approx(10, abs=0.03)

    (tmp_path / "cal" / "day.yaml").write_text(kept.decode().replace("lowest: 2 V", "lowest: 2"))
    bad = workbench("run", short, "--bench", bench, "--dry-run")
    assert bad.code == 2
    assert "day.yaml:8:1: lowest: 2.0 has no unit" in bad.err.replace(
        "lowest: 2 has", "lowest: 2.0 has"
    )
    bench.write_text(bench.read_text().replace("cal/day.yaml", "cal/dai.yaml"))
    missing = workbench("run", short, "--bench", bench, "--dry-run")
    assert missing.code == 2
    assert "dai.yaml: no such file; did you mean 'day.yaml'?" in missing.err
