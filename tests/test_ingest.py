"""Takes measured elsewhere, listed in a sheet, become bundles with twins."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest

from workbench.bench import VirtualBench, load_bench
from workbench.bundle import verify
from workbench.cli.output import QuietOperator
from workbench.engine import Experiment, carry_out
from workbench.errors import FileFaults, InputError, TakeError
from workbench.ingest import ingest_sheet
from workbench.protocol import Protocol, Sheet, load, load_model, load_shape, make_plan

HEAD = """\
schema: workbench/sheet-1
model: thesis
shape: thesis-initial
tracking: {up: y, forward: -z}
bodies: {foot: Foot, top: T, rotor: Rotor}
runs:
"""


def quiet(text: str) -> None:
    del text


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export of a 3 s hop, as a laboratory would hand it over."""
    folder = tmp_path_factory.mktemp("lab")
    path = folder / "p.yaml"
    path.write_text(
        "schema: workbench/protocol-1\ntitle: T\nsteps:\n"
        "  - run: {mode: hop, speed: 17 rad/s, rest: 1 s, ramp: 0.2 s, duration: 3 s}\n"
    )
    bench = load_bench("virtual")
    protocol = load(path, Protocol)
    plan = make_plan(protocol, bench.content, Decimal("0.01"))
    model, shape = load_model("thesis", folder), load_shape("thesis-initial", folder)
    asked = Experiment(protocol, bench, model, shape, plan)
    device = VirtualBench(bench.content)
    (bundle,) = carry_out(asked, device, folder / "runs", QuietOperator(), quiet)
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
    assert bundle.manifest["status"] == "complete"
    assert bundle.manifest["real"]["speed_rad_s"] == pytest.approx(16.93, abs=0.3)
    assert bundle.manifest["twin"]["speed_rad_s"] == pytest.approx(17.0, abs=0.3)
    assert 0.1 < bundle.manifest["error_mm"] < 20
    assert bundle.take().read_bytes() == take.read_bytes()
    assert verify(bundle.path) == []


def test_a_voltage_goes_through_the_sheet_s_calibration(tmp_path: Path, take: Path) -> None:
    (tmp_path / "hop.csv").write_bytes(take.read_bytes())
    sheet = write_sheet(
        tmp_path, "  - {take: hop.csv, mode: hop, voltage: 4.52 V, role: held_out}\n"
    )
    (bundle,) = ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet)
    assert bundle.manifest["speed_rad_s"] == pytest.approx(4.4 * 4.52 - 2.9)
    assert bundle.manifest["role"] == "held_out"


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
        "  - {take: sheet.yaml, mode: decay, pull: 0.4 N}\n"
        "  - {take: sheet.yaml, mode: hop, voltage: 12 V}\n",
    )
    with pytest.raises(FileFaults) as caught:
        list(ingest_sheet(load(sheet, Sheet), tmp_path / "runs", quiet))
    assert [(f.line, f.text.split(";")[0]) for f in caught.value.faults] == [
        (7, "no such file 'gone.csv'"),
        (8, "mode 'decay' has no twin yet"),
        (9, "12 V is outside the range of calibration 'thesis': 1 V to 5.5 V, that is 1.50 rad/s "
            "to 21.30 rad/s"),
    ]  # fmt: skip
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
