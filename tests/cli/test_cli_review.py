"""`workbench review`: runs beside their twins and the twin of an extended model."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest
from rerun.chunk import RrdReader

from tests.bundles import carried_out, manifest_of
from tests.conftest import ROOT, Command
from workbench.bundle import Bundle, sha256, verify
from workbench.errors import WorkbenchError
from workbench.report import compare_extended
from workbench.schemas import load_model

DAMPING = 0.05  # [N m s^2/rad^2] that the robot has and the stated model lacks


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ring-down of a robot that damps more the faster its beam bends."""
    cause = {"hinge_quadratic_damping": {"c": DAMPING}}
    run = "  - run: {mode: decay, pull: 0.8 N, rest: 1 s, duration: 4 s}\n"
    folder = tmp_path_factory.mktemp("lab")
    (bundle,) = carried_out(folder, run, views=True, parameters={}, effects=cause)
    return bundle.path


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a diagnosis would have written."""
    found = (
        f"effects:\n  - name: hinge_quadratic_damping\n    parameters: {{c: {DAMPING}}}\n"
        "    standard_errors: {c: 0.001}\n    diagnosis: april\n"
    )
    text = (ROOT / "models" / "thesis.yaml").read_text(encoding="utf-8")
    path = tmp_path_factory.mktemp("model") / "april-model.yaml"
    path.write_text(text.replace("effects: []\n", found), encoding="utf-8")
    return path


def test_the_model_that_has_the_cause_rings_like_the_robot(bundle: Path, model: Path) -> None:
    found = compare_extended(Bundle.open(bundle), load_model(str(model), Path()))
    assert found.extended is not None
    assert found.extended.misfit.top_mm < 0.5
    assert found.misfit.top_mm > 4 * found.extended.misfit.top_mm
    assert found.facts["extended model"].startswith(found.extended.model)


def test_the_recording_is_saved_and_the_bundle_stays_as_it_is(
    workbench: Command, bundle: Path, model: Path, tmp_path: Path
) -> None:
    target = tmp_path / "three.rrd"
    answer = workbench("review", bundle, "--model", model, "--save", target)
    assert answer.code == 0
    assert "extended twin" in answer.out
    paths = {chunk.entity_path for chunk in RrdReader(target).stream().to_chunks()}
    assert {"/real/foot", "/twin/beam", "/extended/beam"} <= paths
    assert verify(bundle) == []


def motions(recording: Path) -> dict[str, dict[str, list[object]]]:
    """What moves and what is plotted."""
    chunks = RrdReader(recording).stream().to_chunks()
    told = {c.entity_path: c.to_record_batch() for c in chunks if not c.is_static}
    return {
        path: {name: batch.column(name).to_pylist() for name in batch.schema.names if ":" in name}
        for path, batch in told.items()
        if path.startswith(("/real", "/twin", "/plots"))
    }


def test_without_a_model_the_run_s_own_recording_is_shown(
    workbench: Command, bundle: Path, tmp_path: Path
) -> None:
    target = tmp_path / "two.rrd"
    assert workbench("review", bundle, "--save", target).code == 0
    again, own = motions(target), motions(Bundle.open(bundle).view("recording"))
    assert len(own) > 20
    assert again == own


def test_a_model_that_is_none_is_refused_by_name(
    workbench: Command, bundle: Path, root: Path
) -> None:
    answer = workbench("review", bundle, "--model", "tesis")
    assert answer.code == 2
    assert "no model named 'tesis'; did you mean 'thesis'?" in answer.err
    rig = root / "examples" / "pendulum" / "rig.yaml"
    answer = workbench("review", bundle, "--model", rig)
    assert answer.code == 2
    assert "this is a rig, and a model is needed here" in answer.err


@pytest.fixture(scope="module")
def diagnoses(
    bundle: Path, model: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path]:
    """A folder with the answer that knows the run."""
    folder = tmp_path_factory.mktemp("diagnoses") / "april"
    folder.mkdir()
    (folder / model.name).write_bytes(model.read_bytes())
    run = Bundle.open(bundle)
    told = {
        "schema": "workbench/diagnosis-1",
        "extended_model": str(folder / model.name),
        "files": {run.path.name: sha256(run.take())},
    }
    (folder / "april.json").write_text(json.dumps(told), encoding="utf-8")
    return folder.parent, folder


def test_a_diagnosis_of_the_run_brings_its_extended_twin(
    workbench: Command, bundle: Path, diagnoses: tuple[Path, Path], tmp_path: Path
) -> None:
    target = tmp_path / "found.rrd"
    answer = workbench("review", bundle, "--diagnoses", diagnoses[0], "--save", target)
    assert answer.code == 0
    assert "extended twin" in answer.out
    paths = {chunk.entity_path for chunk in RrdReader(target).stream().to_chunks()}
    assert "/extended/beam" in paths


def test_several_runs_stand_in_one_recording_and_one_page(
    workbench: Command, bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("workbench.report.comparison_set.ComparisonSet.picture", no_viewer)
    runs = bundle.parent
    other = shutil.copytree(bundle, runs / f"{bundle.name}_2", dirs_exist_ok=True)
    text = (other / "manifest.json").read_text(encoding="utf-8")
    (other / "manifest.json").write_text(text.replace(bundle.name, other.name), encoding="utf-8")
    target, page = tmp_path / "all.rrd", tmp_path / "all.html"
    answer = workbench("review", bundle, other, "--save", target, "--page", page)
    assert answer.code == 0
    assert "the page has no picture of the viewer: no driver" in answer.err
    assert f"{other.name}: DAMAGED" in answer.err  # its manifest is not as it was written
    paths = {chunk.entity_path for chunk in RrdReader(target).stream().to_chunks()}
    assert {"/runs/1/real/foot", "/runs/2/twin/beam"} <= paths
    told = page.read_text(encoding="utf-8")
    assert f'href="{Path(os.path.relpath(bundle / "report.html", tmp_path)).as_posix()}"' in told
    experiment = manifest_of(Bundle.open(bundle))["experiment"]  # both are all its runs
    assert f"workbench review {experiment}</pre>" in told


def no_viewer(shown: object) -> None:
    """Stand for a computer without graphics."""
    raise WorkbenchError("no driver")


def test_a_film_of_several_runs_is_refused(
    workbench: Command, bundle: Path, tmp_path: Path
) -> None:
    answer = workbench("review", bundle, bundle, "--video", tmp_path / "two.mp4")
    assert answer.code == 2
    assert "a film shows one run and 2 were named" in answer.err
    assert not (tmp_path / "two.mp4").exists()


def test_without_anything_to_write_the_viewer_opens(
    workbench: Command, bundle: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[tuple[bool, int]] = []

    def show(path: Path, web: bool, tell: object) -> None:
        opened.append((web, path.stat().st_size))

    monkeypatch.setattr("workbench.report.viewer.open_viewer", show)
    assert workbench("review", bundle).code == 0
    assert workbench("review", bundle, "--web").code == 0
    assert [web for web, _ in opened] == [False, True]
    assert min(size for _, size in opened) > 50_000
