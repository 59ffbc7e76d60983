"""Base and extended model as a diagnosis compared them: answer, page and recording agree."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from tests.bundles import carried_out
from tests.conftest import Command
from tests.report.diagnosis.test_diagnose_report import diagnosis, text_of
from workbench.bundle import Bundle
from workbench.diagnose import Diagnosis, HopperRig, digits
from workbench.fit import measured_run
from workbench.report import kept_replay, replay_of
from workbench.report.diagnosis.written import write_report
from workbench.schemas import ModelFile, ShapeFile, load

DAMPING = 0.05  # [N m s^2/rad^2] that the robot has and the stated model lacks
EFFECT = {"hinge_quadratic_damping": {"c": (DAMPING, 0.001)}}


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    """A ring-down of a robot that damps more the faster its beam bends, held out."""
    run = "  - run: {mode: decay, pull: 0.8 N, rest: 1 s, duration: 3 s, role: held_out}\n"
    cause = {"hinge_quadratic_damping": {"c": DAMPING}}
    folder = tmp_path_factory.mktemp("lab")
    (made,) = carried_out(folder, run, views=False, parameters={}, effects=cause)
    return made


@pytest.fixture(scope="module")
def found(bundle: Bundle, tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """An answer whose errors are a rig's own, its fits made up."""
    folder = tmp_path_factory.mktemp("diagnoses") / "april"
    folder.mkdir()
    document = load(bundle.document("model"), ModelFile)
    shape = load(bundle.document("shape"), ShapeFile).content
    rig = HopperRig([measured_run(bundle)], document, shape)
    extended = rig.extend(folder / "april-model", {}, EFFECT, "april")
    name = bundle.path.name
    paper = diagnosis(folder, "NAMED")
    return replace(
        paper, rig=rig, held_out=(name,), errors=rig.errors([0], None, None, 1),
        extended=extended, extended_errors=extended.errors([0], None, None, 1),
    )  # fmt: skip


@pytest.fixture(scope="module")
def page(found: Diagnosis, bundle: Bundle) -> Path:
    assert found.extended is not None
    folder = found.extended.source.parent
    files = {bundle.path.name: bundle.take()}
    return write_report(folder, found, files, None, b"jpeg", [bundle])


def plotted(recording: Path, who: str) -> float:
    """The root mean square of what a recording plots."""
    chunks = RrdReader(recording).stream().to_chunks()
    path = f"/plots/compared/t_mm/{who}"
    (chunk,) = [c for c in chunks if c.entity_path == path and not c.is_static]
    batch = chunk.to_record_batch()
    (name,) = [n for n in batch.schema.names if "Scalars" in n]
    values = [cell[0] for cell in batch.column(name).to_pylist() if cell]
    return float(np.sqrt(np.mean(np.square(values))))


def test_page_recording_and_answer_have_one_error(
    workbench: Command, found: Diagnosis, bundle: Bundle, page: Path, tmp_path: Path
) -> None:
    assert found.extended is not None
    assert found.errors is not None
    name, model, target = bundle.path.name, found.extended.source, tmp_path / "three.rrd"
    answer = json.loads(page.with_suffix(".json").read_text(encoding="utf-8"))
    told = answer["errors_by_run"][name]
    shown = workbench("review", bundle.path, "--model", model, "--save", target)
    assert shown.code == 0
    text = text_of(page.read_text(encoding="utf-8"))
    assert told["base"]["rmse"] > 4 * told["extended"]["rmse"]
    assert told["extended"]["rmse"] == pytest.approx(told["noise_floor"], rel=0.2)
    for who in ("base", "extended"):
        assert answer["rmse_mm"][who] == pytest.approx(told[who]["rmse"], rel=1e-12)
        assert plotted(target, who) == pytest.approx(told[who]["rmse"], rel=1e-9)
        assert f"{told[who]['rmse']:.2f} mm" in shown.out
    errors = (told["base"]["rmse"], told["extended"]["rmse"], told["noise_floor"])
    assert f"{name} {' '.join(map(digits, errors))}" in text
    assert "as compared" in shown.out
    assert f"workbench review {bundle.path} --model {model}" in text


def test_what_was_kept_is_what_was_compared(found: Diagnosis, bundle: Bundle, page: Path) -> None:
    assert found.extended is not None
    name = bundle.path.name
    made, kept = replay_of(found, name), kept_replay(found.extended.source, name, bundle.take())
    assert made is not None
    assert kept is not None
    for one, other in zip(made.both, kept.both, strict=True):
        assert other[1].rms_mm == pytest.approx(one[1].rms_mm, rel=1e-12)
        assert np.array_equal(one[1].motion.values, other[1].motion.values)
    assert kept.about == made.about
    assert "held out of the diagnosis april" in kept.about


def test_another_take_of_that_name_is_not_what_was_compared(
    found: Diagnosis, bundle: Bundle, page: Path, tmp_path: Path
) -> None:
    assert found.extended is not None
    other = tmp_path / bundle.take().name
    other.write_bytes(bundle.take().read_bytes() + b"\n")
    assert kept_replay(found.extended.source, bundle.path.name, other) is None


def test_the_page_draws_the_residual_first(page: Path) -> None:
    html = page.read_text(encoding="utf-8")
    section = html[html.index("<h2>Error on the runs held out") :]
    assert section.index("<svg") < section.index("<table")
    assert re.search(r"base</text>", section)
    assert re.search(r"noise alone</text>", section)
