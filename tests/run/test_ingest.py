"""Takes measured elsewhere, listed in a sheet, become bundles with twins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bundles import carried_out, manifest_of, report_of
from workbench.bundle import verify
from workbench.errors import FileFaults, InputError, TakeError
from workbench.motion import TOP
from workbench.run import ingest_sheet
from workbench.schemas import Sheet, load, load_model, load_shape
from workbench.sim import applied, make_robot, settle, unloaded
from workbench.tracking import read_take, write_motive

HEAD = """\
schema: workbench/sheet-1
model: thesis
shape: thesis-initial
tracking: {up: y, forward: -z}
bodies: {foot: Foot, top: T, rotor: Rotor}
runs:
"""
MARKED = HEAD.replace(
    "runs:\n",
    "markers:\n"
    "  Foot: [[120, -110, 12], [120, 110, 12], [-120, -110, 12], [-120, 110, 12]]\n"
    "runs:\n",
)


def quiet(text: str) -> None:
    del text


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export of a 3 s hop, as a laboratory would hand it over."""
    run = "{mode: hop, speed: 17 rad/s, rest: 1 s, ramp: 0.2 s, duration: 3 s}"
    return measured(tmp_path_factory.mktemp("lab"), run)


@pytest.fixture(scope="module")
def decay(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ring-down from 0.39 N of a robot that is just the model."""
    run = "{mode: decay, pull: 0.39 N, rest: 1 s, duration: 5 s}"
    return measured(tmp_path_factory.mktemp("lab"), run, parameters={})


@pytest.fixture(scope="module")
def drop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drop from 20 mm of a robot that is just the model."""
    run = "{mode: drop, height: 20 mm, rest: 1 s, duration: 4 s}"
    return measured(tmp_path_factory.mktemp("lab"), run, parameters={})


def measured(folder: Path, run: str, **virtual: Any) -> Path:
    (bundle,) = carried_out(folder, f"  - run: {run}\n", **virtual)
    return bundle.take()


def write_sheet(folder: Path, runs: str, head: str = HEAD) -> Path:
    path = folder / "sheet.yaml"
    path.write_text(head + runs)
    return path


def test_a_listed_take_becomes_a_bundle_with_its_twin(tmp_path: Path, take: Path) -> None:
    (tmp_path / "hop_17.csv").write_bytes(take.read_bytes())
    sheet = write_sheet(
        tmp_path, "  - {take: hop_17.csv, mode: hop, omega: 17 rad/s, ramp: 0.2 s}\n"
    )
    (bundle,) = ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet)
    assert manifest_of(bundle)["status"] == "complete"
    assert manifest_of(bundle)["real"]["speed_rad_s"] == pytest.approx(16.93, abs=0.3)
    assert manifest_of(bundle)["twin"]["speed_rad_s"] == pytest.approx(17.0, abs=0.3)
    assert 0.1 < manifest_of(bundle)["error_mm"] < 20
    assert bundle.take().read_bytes() == take.read_bytes()
    assert verify(bundle.path) == []


def test_a_voltage_goes_through_the_sheet_s_calibration(tmp_path: Path, take: Path) -> None:
    (tmp_path / "hop.csv").write_bytes(take.read_bytes())
    sheet = write_sheet(
        tmp_path, "  - {take: hop.csv, mode: hop, voltage: 4.52 V, role: held_out}\n"
    )
    (bundle,) = ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet)
    assert manifest_of(bundle)["speed_rad_s"] == pytest.approx(4.4 * 4.52 - 2.9)
    assert manifest_of(bundle)["role"] == "held_out"


def test_angles_listed_in_the_sheet_are_a_shape(tmp_path: Path, take: Path) -> None:
    (tmp_path / "hop.csv").write_bytes(take.read_bytes())
    angles = load_shape("thesis-initial", tmp_path).content.angles
    head = HEAD.replace("thesis-initial", str(list(angles)))
    sheet = write_sheet(tmp_path, "  - {take: hop.csv, mode: hop, omega: 17 rad/s}\n", head)
    (bundle,) = ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet)
    assert load_shape(str(bundle.document("shape")), tmp_path).content.angles == angles


def test_everything_wrong_in_the_sheet_is_told_before_anything_is_written(tmp_path: Path) -> None:
    sheet = write_sheet(
        tmp_path,
        "  - {take: gone.csv, mode: hop, omega: 17 rad/s}\n"
        "  - {take: lost.csv, mode: decay, pull: 0.4 N}\n"
        "  - {take: sheet.yaml, mode: hop, voltage: 12 V}\n",
    )
    with pytest.raises(FileFaults) as caught:
        list(ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet))
    assert [(f.line, f.text.split(";")[0]) for f in caught.value.faults] == [
        (7, "no such file 'gone.csv'"),
        (8, "no such file 'lost.csv'"),
        (
            9,
            "12 V is outside the range of calibration 'thesis': 1 V to 5.5 V, that is 1.50 rad/s "
            "to 21.30 rad/s",
        ),
    ]
    assert not (tmp_path / "runs").exists()


def test_wrong_body_names_are_answered_with_those_that_exist(tmp_path: Path, take: Path) -> None:
    (tmp_path / "hop.csv").write_bytes(take.read_bytes())
    head = HEAD.replace("foot: Foot", "foot: Fooot")
    sheet = write_sheet(tmp_path, "  - {take: hop.csv, mode: hop, omega: 17 rad/s}\n", head)
    with pytest.raises(InputError, match=r"run 1 \(hop.csv\): .*Fooot.*Foot"):
        list(ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet))


def test_a_take_that_is_none_leaves_a_failed_bundle(tmp_path: Path) -> None:
    sheet = write_sheet(tmp_path, "  - {take: sheet.yaml, mode: hop, omega: 17 rad/s}\n")
    with pytest.raises(TakeError, match=r"run 1 \(sheet.yaml\)"):
        list(ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet))
    (bundle,) = (tmp_path / "runs").iterdir()
    assert '"status": "failed"' in (bundle / "manifest.json").read_text()


def test_a_pull_that_the_sheet_leaves_out_is_found_in_the_data(tmp_path: Path, decay: Path) -> None:
    (tmp_path / "decay.csv").write_bytes(decay.read_bytes())
    sheet = write_sheet(tmp_path, "  - {take: decay.csv, mode: decay}\n", MARKED)
    (bundle,) = ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet)
    found = manifest_of(bundle)["release"]
    assert found["pull_N"] == pytest.approx(0.39, abs=0.003)
    assert 1e-5 < found["standard_error"] < 0.003
    assert manifest_of(bundle)["title"] == "decay, decay.csv"
    assert manifest_of(bundle)["error_top_mm"] < 1.0
    assert "N, found in the data" in report_of(bundle)


def test_a_height_that_the_sheet_leaves_out_is_found_in_the_data(
    tmp_path: Path, drop: Path
) -> None:
    (tmp_path / "drop.csv").write_bytes(drop.read_bytes())
    sheet = write_sheet(tmp_path, "  - {take: drop.csv, mode: drop, duration: 4 s}\n", MARKED)
    (bundle,) = ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet)
    assert manifest_of(bundle)["release"]["height_m"] == pytest.approx(0.02, abs=0.0003)
    assert manifest_of(bundle)["error_mm"] < 1.0
    assert "mm, found in the data" in report_of(bundle)


def test_a_pull_that_the_sheet_tells_is_taken_as_told(tmp_path: Path, decay: Path) -> None:
    (tmp_path / "decay.csv").write_bytes(decay.read_bytes())
    sheet = write_sheet(
        tmp_path, "  - {take: decay.csv, mode: decay, pull: 0.45 N, duration: 4 s}\n"
    )
    (bundle,) = ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet)
    told = {"pull_N": 0.45, "pull_up_N": 0.0, "height_m": 0.0, "standard_error": None}
    assert manifest_of(bundle)["release"] == told
    real, twin = (manifest_of(bundle)[who]["displacement_m"] for who in ("real", "twin"))
    assert twin / real == pytest.approx(0.45 / 0.39, abs=0.02)


def test_the_direction_of_a_pull_is_found_in_the_data(tmp_path: Path, decay: Path) -> None:
    (tmp_path / "decay.csv").write_bytes(decay.read_bytes())
    turned = HEAD.replace("forward: -z", "forward: z")  # the same take, seen from behind
    sheet = write_sheet(tmp_path, "  - {take: decay.csv, mode: decay, pull: 0.39 N}\n", turned)
    (bundle,) = ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet)
    assert manifest_of(bundle)["release"]["pull_N"] == -0.39
    assert "T was pulled backwards, and so is the twin's" in manifest_of(bundle)["warnings"]


def test_a_pull_forward_and_up_starts_the_twin_where_both_hold_it(
    tmp_path: Path, decay: Path
) -> None:
    (tmp_path / "decay.csv").write_bytes(decay.read_bytes())
    sheet = write_sheet(
        tmp_path, "  - {take: decay.csv, mode: decay, pull: [0.3 N, -200 mN], duration: 4 s}\n"
    )
    (bundle,) = ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet)
    assert (manifest_of(bundle)["pull_N"], manifest_of(bundle)["pull_up_N"]) == (0.3, -0.2)
    page = report_of(bundle)
    assert "T pulled forward with 0.3 N and upward with -0.2 N" in page
    shape, model = load_shape("thesis-initial", tmp_path), load_model("thesis", tmp_path)
    robot = make_robot(model.content.values(), shape.content)
    angle = manifest_of(bundle)["track"]["start_angle_rad"]
    pulled, rest = (
        settle(unloaded(applied(robot)), "fixed", angle, pull)[1].body("top").xpos[[0, 2]]
        for pull in ((0.3, -0.2), (0.0, 0.0))
    )
    twin = bundle.series.read("twin")
    started, ended = (
        np.array([np.median(twin[name][part]) for name in (TOP[0], TOP[2])])
        for part in (twin.times < -0.1, twin.times > 3.0)
    )
    assert started - ended == pytest.approx(pulled - rest, abs=3e-3)


@pytest.mark.parametrize(
    ("run", "text"),
    [
        (
            "mode: decay, pull: [0.3 N]",
            r"pull: two forces are meant, forward and up: \[0\.3 N, -0\.2 N\]",
        ),
        ("mode: decay, omega: 17 rad/s", "mode decay has no drive; remove omega"),
        ("mode: drop, ramp: 1 s", "mode drop has no drive; remove ramp"),
        ("mode: drop, pull: 0.4 N", "mode drop has no pull, only mode decay has; remove it"),
        ("mode: hop, omega: 17 rad/s, height: 1 cm", "mode hop has no height, only mode drop"),
        ("mode: hop", "mode hop needs either omega or voltage"),
    ],
)
def test_a_sheet_s_run_has_the_keys_of_its_mode(tmp_path: Path, run: str, text: str) -> None:
    with pytest.raises(FileFaults, match=text):
        load(write_sheet(tmp_path, f"  - {{take: x.csv, {run}}}\n"), Sheet)


def test_what_a_sheet_states_of_its_takes_is_obeyed_and_noted(tmp_path: Path, take: Path) -> None:
    found = read_take(take)
    write_motive(found, tmp_path / "cm.csv", version="1.24", units="Centimeters")
    data = (tmp_path / "cm.csv").read_bytes().replace(b"Units,Centimeters", b"Units,Meters")
    (tmp_path / "cm.csv").write_bytes(data)
    head = HEAD.replace("forward: -z}", "forward: -z, unit: cm}").replace(
        "runs:\n", "limits: {Foot: 500 mm}\nruns:\n"
    )
    run = (
        "  - {take: cm.csv, mode: hop, omega: 17 rad/s,"
        " exchanged: [{bodies: [T, Rotor], frames: [0, 3]}]}\n"
    )
    (bundle,) = ingest_sheet(
        load(write_sheet(tmp_path, run, head), Sheet), tmp_path / "runs", quiet
    )
    warnings = manifest_of(bundle)["warnings"]
    assert "lengths are read in cm, as stated; the file was read in m" in warnings
    assert "'T' and 'Rotor' were exchanged in 4 samples, as stated" in warnings
    assert manifest_of(bundle)["real"]["speed_rad_s"] == pytest.approx(16.93, abs=0.3)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("up: y", "unit: feet, up: y", "unit"),
        ("hop,", "hop, exchanged: [{bodies: [T, T]}],", "T twice; an exchange has two bodies"),
        ("hop,", "hop, exchanged: [{bodies: [T, R], frames: [9, 3]}],", "9 comes after 3"),
    ],
)
def test_a_statement_that_cannot_be_is_refused_by_line(
    old: str, new: str, match: str, tmp_path: Path
) -> None:
    sheet = write_sheet(tmp_path, "  - {take: hop.csv, mode: hop, omega: 17 rad/s}\n")
    sheet.write_text(sheet.read_text().replace(old, new))
    with pytest.raises(FileFaults, match=match):
        load(sheet, Sheet)
