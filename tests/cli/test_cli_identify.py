"""`workbench identify` from runs on the virtual bench to the new model and its report."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from tests.bundles import carried_out
from tests.conftest import Command
from workbench.schemas import ModelFile, load

STEPS = """\
  - run: {mode: decay, pull: 0.8 N, rest: 1 s, duration: 2 s}
  - run: {mode: decay, pull: 0.4 N, rest: 1 s, duration: 2 s}
  - run: {mode: decay, pull: 0.6 N, rest: 1 s, duration: 2 s, role: held_out}
"""
FALL = "  - run: {mode: drop, height: 20 mm, rest: 1 s, duration: 2 s}\n"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three runs of the beam, one held out."""
    folder = tmp_path_factory.mktemp("beam")
    carried_out(folder, STEPS)
    return folder / "runs"


def test_neither_a_model_nor_its_report_is_overwritten(
    workbench: Command, runs: Path, tmp_path: Path
) -> None:
    out = tmp_path / "mine.yaml"
    words = ("identify", runs, "--fit", "hinge_stiffness", "--out", out)
    for there in (out, out.with_suffix(".html")):
        there.touch()
        answer = workbench(*words)
        assert answer.code == 2
        assert f"{there.name}: exists and is never overwritten; give another --out" in answer.err
        there.unlink()


@pytest.mark.long
def test_the_beam_is_found_and_its_report_lies_beside_the_new_model(
    workbench: Command, runs: Path, tmp_path: Path
) -> None:
    out = tmp_path / "models" / "mine.yaml"
    answer = workbench("identify", runs, "--fit", "hinge_stiffness", "--out", out, "--json")
    assert answer.code == 0, answer.err
    found = answer.json
    stiffness = found["parameters"]["hinge_stiffness"]
    assert stiffness["value"] == pytest.approx(9.31, rel=0.01)  # of bench-virtual.yaml
    value = load(out, ModelFile).content.values()["hinge_stiffness"]
    assert value == pytest.approx(stiffness["value"], rel=1e-5)
    assert (found["model"], found["report"]) == (str(out), str(out.with_suffix(".html")))
    page = Path(found["report"]).read_text(encoding="utf-8")
    (held,) = found["validation"]["held_out_runs"]
    fitted = found["validation"]["rmse_mm"]["fitted"]
    for words_in_page in (
        "k, stiffness of a hinge", held, f"{fitted:.3f}",
        "run 3, held out", "mine.yaml (", *found["runs"],
    ):  # fmt: skip
        assert words_in_page in page, words_in_page
    shown = re.search(r"k, stiffness of a hinge</th>\s*<td[^>]*>([\d.]+)<", page)
    assert shown is not None
    low, high = stiffness["interval90"]
    assert float(shown[1]) == pytest.approx(stiffness["value"], abs=(high - low) / 4)
    assert not re.search(r'(src|href)="(?!#)', page)


@pytest.mark.long
def test_beam_and_ground_are_fitted_at_once_and_a_run_that_was_cut_short_is_left_out(
    workbench: Command, tmp_path: Path
) -> None:
    carried_out(tmp_path, STEPS + FALL + FALL)
    cut = sorted((tmp_path / "runs").iterdir())[-1]
    manifest = json.loads((cut / "manifest.json").read_text(encoding="utf-8"))
    (cut / "manifest.json").write_text(json.dumps(manifest | {"status": "interrupted"}))
    shutil.rmtree(cut / "take")
    (cut / "model.yaml").unlink()
    out = tmp_path / "ground.yaml"
    fit = "hinge_stiffness,ground_stiffness"
    answer = workbench("identify", tmp_path / "runs", "--fit", fit, "--out", out)
    assert answer.code == 0, answer.err
    assert f"left out {cut.name}: its status is interrupted" in answer.err
    assert f"report: {out.with_suffix('.html')}" in answer.out
    values = load(out, ModelFile).content.values()
    assert values["hinge_stiffness"] == pytest.approx(9.31, rel=0.01)  # of bench-virtual.yaml
    page = out.with_suffix(".html").read_text(encoding="utf-8")
    assert '<th scope="row">ground stiffness</th>' in page
