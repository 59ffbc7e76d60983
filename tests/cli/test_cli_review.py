"""`workbench review --model`: a run beside its twin and the twin of an extended model."""

from __future__ import annotations

from pathlib import Path

import pytest
from rerun.chunk import RrdReader

from tests.conftest import ROOT, Command
from tests.test_ingest import measured
from workbench.bundle import Bundle, verify
from workbench.pairing import pair_extended
from workbench.protocol import load_model

DAMPING = 0.05  # [N m s^2/rad^2] that the robot has and the stated model lacks


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ring-down of a robot that damps more the faster its beam bends."""
    cause = {"hinge_quadratic_damping": {"c": DAMPING}}
    run = "{mode: decay, pull: 0.8 N, rest: 1 s, duration: 4 s}"
    folder = tmp_path_factory.mktemp("lab")
    return measured(folder, run, parameters={}, effects=cause).parent.parent


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
    found = pair_extended(Bundle.open(bundle), load_model(str(model), Path()))
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
    assert {"/real/foot", "/sim/beam", "/extended/beam"} <= paths
    assert verify(bundle) == []


def motions(recording: Path) -> dict[str, dict[str, list[object]]]:
    """What moves and what is plotted; the journal goes on after the recording was made."""
    chunks = RrdReader(recording).stream().to_chunks()
    told = {c.entity_path: c.to_record_batch() for c in chunks if not c.is_static}
    return {
        path: {name: batch.column(name).to_pylist() for name in batch.schema.names if ":" in name}
        for path, batch in told.items()
        if path.startswith(("/real", "/sim", "/plots"))
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
    assert "'workbench/rig-1' is not one of workbench/model-1" in answer.err
