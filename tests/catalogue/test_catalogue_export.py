"""What a colleague gets: the bundles as they are, and traces that read back equal."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
import zipfile
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from tests.bundles import NOW, STATE, SUPPLY, TRACK, TWIN, make_bundle, remarked
from workbench.bundle import Manifest, verify
from workbench.bundle.inside import printable
from workbench.catalogue import export
from workbench.catalogue.matlab import as_mat
from workbench.catalogue.traces import as_csv, column_lines, heading
from workbench.errors import InputError, RecordError
from workbench.timeseries import TimeSeries

TRACES = {
    "measured": TRACK,
    "simulated": TWIN,
    "supply": SUPPLY,
    "unfiltered": TRACK,
    "estimated": STATE,
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    root = tmp_path_factory.mktemp("lab") / "runs"
    first = remarked(make_bundle(root)).path
    return [make_bundle(root, "hop-18.00", NOW + timedelta(1), title='Hop, "18"').path, first]


@pytest.fixture(scope="module")
def folder(runs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export(runs, tmp_path_factory.mktemp("out") / "new" / "x", csv=True, mat=True).target


def test_bundles_arrive_whole_and_everything_has_a_checksum(runs: list[Path], folder: Path) -> None:
    for run in runs:
        assert verify(folder / "bundles" / run.name) == []
        here = {p.relative_to(run): p.read_bytes() for p in run.rglob("*") if p.is_file()}
        there = folder / "bundles" / run.name
        assert here == {
            p.relative_to(there): p.read_bytes() for p in there.rglob("*") if p.is_file()
        }
    named = {line.split("  ", 1)[1] for line in (folder / "checksums.txt").read_text().splitlines()}
    held = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
    assert held == named | {"checksums.txt"}
    if shutil.which("sha256sum"):
        subprocess.run(["sha256sum", "-c", "--quiet", "checksums.txt"], cwd=folder, check=True)


def test_csv_reads_back_equal_and_what_was_not_seen_is_empty(
    runs: list[Path], folder: Path
) -> None:
    for name, series in TRACES.items():
        with (folder / "csv" / runs[0].name / f"{name}.csv").open(newline="") as file:
            head, *rows = csv.reader(file)
        assert head == [heading("time_s"), *map(heading, series.names)]
        cells = np.array([[float(c) if c else np.nan for c in row] for row in rows])
        assert np.array_equal(cells[:, 0], series.times)
        seen = np.where(series.valid, series.values, np.nan)
        assert np.array_equal(cells[:, 1:], seen, equal_nan=True)
    assert heading("rotor_speed_rad_s") == "rotor_speed [rad/s]"


def test_the_overview_has_a_line_a_run_oldest_first(runs: list[Path], folder: Path) -> None:
    with (folder / "runs.csv").open(newline="") as file:
        first, second = csv.DictReader(file)
    assert [first["run"], second["run"]] == [runs[1].name, runs[0].name]
    assert second["title"] == 'Hop, "18"'
    assert first["distance of the twin [m]"] == "0.248"
    assert (first["verdict"], first["tags"], first["notes"]) == (
        "good",
        "paper",
        "die Folie löst sich",
    )


def test_mat_reads_back_equal_with_units(runs: list[Path], folder: Path) -> None:
    run = loadmat(folder / "mat" / f"{runs[1].name}.mat", simplify_cells=True)["run"]
    for name, series in TRACES.items():
        assert np.array_equal(run[name]["time_s"], series.times)
        for column in series.names:
            seen = np.where(series.validity(column), series[column], np.nan)
            assert np.array_equal(run[name][column], seen, equal_nan=True)
    assert run["measured"]["units"] == {
        "time_s": "s",
        "foot_x_m": "m",
        "rotor_speed_rad_s": "rad/s",
    }
    assert (run["title"], run["verdict"], run["speed_rad_s"]) == ("Hop at 17 rad/s", "good", 16.988)
    assert json.loads(run["manifest"])["twin"]["distance_m"] == 0.248


OCTAVE = """\
load('run.mat');
assert(size(run.measured.foot_x_m), [4 1]);
assert(isnan(run.measured.foot_x_m(3)));
assert(run.measured.foot_x_m(2) == 1/3);
assert(run.measured.units.rotor_speed_rad_s, 'rad/s');
assert(run.simulated.hinge_15_rad, [1; 2; 3]);
assert(run.title, 'Hop at 17 rad/s');
assert(strfind(run.notes, 'Grace') > 0);
printf('equal\\n');
"""


def test_octave_reads_it_too(runs: list[Path], folder: Path, tmp_path: Path) -> None:
    octave = shutil.which("octave-cli") or shutil.which("octave")
    if octave is None:
        pytest.skip("no GNU Octave here")
    shutil.copy(folder / "mat" / f"{runs[1].name}.mat", tmp_path / "run.mat")
    done = subprocess.run(
        [octave, "--no-gui", "--norc", "--quiet", "--eval", OCTAVE],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stdout.strip() == "equal", done.stderr


def test_a_name_that_matlab_cannot_have_is_refused() -> None:
    for name in ("valid:x", "x" * 64):
        with pytest.raises(InputError, match=f"column '{name}': MATLAB takes no such name"):
            as_mat(Manifest(id="x"), {"measured": TimeSeries.of([0.0], {name: [1.0]})}, {})


def test_the_readme_tells_every_column_that_is_there(folder: Path) -> None:
    readme = (folder / "README.txt").read_text()
    for line in (
        "2 run(s)",
        "  foot_x [m]           the foot's centre of gravity, forward of the foot's centre at rest",
        "  hinge_15 [rad]  bend of the beam at this hinge",
        "  current [A]      current that was read back",
        "Columns of simulated: its twin",
    ):
        assert line in readme
    assert "DAMAGED" not in readme


def test_no_column_that_the_workbench_writes_is_without_a_meaning() -> None:
    from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, ROTOR_SPEED, TOP

    written = [*FOOT, *TOP, *ROTOR, PITCH, ROTOR_ANGLE, ROTOR_SPEED, *SUPPLY.names, "hinge_0_rad",
               "ground_x_N", "corners_touching", "corners_sliding", "motor_power_W",
               "missing_top_x_N", "missing_foot_pitch_sigma_N_m", "missing_foot_pitch_N_m",
               "missing_mode_0_N_per_sqrt_kg", "top_x_sigma_m"]  # fmt: skip
    assert not [line for line in column_lines(written) if line.endswith("as its name says")]


def test_a_zip_is_the_same_byte_for_byte_whenever_it_is_made(
    runs: list[Path], folder: Path, tmp_path: Path
) -> None:
    first = export(runs, tmp_path / "a.zip", csv=True, mat=True)
    export(runs[::-1], tmp_path / "b.zip", csv=True, mat=True)
    assert (
        b"Created on" not in as_mat(Manifest(id="x"), TRACES, {})[:116]
    )  # where scipy tells the time
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    with zipfile.ZipFile(first.target) as archive:
        assert archive.testzip() is None
        packed = {name: archive.read(name) for name in archive.namelist()}
    unpacked = {
        p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()
    }
    assert packed == unpacked


def test_nothing_is_overwritten(runs: list[Path], folder: Path, tmp_path: Path) -> None:
    (tmp_path / "a.zip").write_text("mine")
    for target in (folder, tmp_path / "a.zip"):
        with pytest.raises(InputError, match="is there already; an export overwrites nothing"):
            export(runs, target, csv=False, mat=False)
    assert (tmp_path / "a.zip").read_text() == "mine"


def test_two_runs_of_one_name_are_refused(runs: list[Path], tmp_path: Path) -> None:
    other = Path(shutil.copytree(runs[0], tmp_path / "elsewhere" / runs[0].name))
    with pytest.raises(InputError, match=f"two runs are called {runs[0].name}"):
        export([runs[0], other], tmp_path / "x", csv=False, mat=False)
    assert not (tmp_path / "x").exists()


def test_a_damaged_run_is_exported_with_what_there_is(runs: list[Path], tmp_path: Path) -> None:
    run = Path(shutil.copytree(runs[0], tmp_path / runs[0].name))
    (run / "track.parquet").write_bytes(b"PAR1")
    (run / "manifest.json").write_text("{")
    done = export([run], tmp_path / "x", csv=True, mat=True)
    assert f"{run.name}: manifest.json: changed since the run was finished" in done.problems
    assert any("track.parquet: cannot be read" in text for text in done.problems)
    readme = (done.target / "README.txt").read_text()
    assert "DAMAGED" in readme
    assert all(text in readme for text in done.problems)
    held = {p.name for p in (done.target / "csv" / run.name).iterdir()}
    assert held == {"estimated.csv", "simulated.csv", "unfiltered.csv", "supply.csv"}
    kept = loadmat(done.target / "mat" / f"{run.name}.mat", simplify_cells=True)["run"]
    assert "track.parquet" in kept["problems"]


needs_links = pytest.mark.skipif(sys.platform == "win32", reason="needs symbolic links and pipes")


@needs_links
@pytest.mark.parametrize("name", ["x", "x.zip"])
def test_a_link_is_not_followed_and_is_told(runs: list[Path], tmp_path: Path, name: str) -> None:
    run = Path(shutil.copytree(runs[0], tmp_path / runs[0].name))
    secret = tmp_path / "secret"
    secret.mkdir()
    (secret / "passwd").write_text("root:x:0:0")
    shutil.copy(runs[0] / "track.parquet", secret / "track.parquet")
    (run / "take" / "x.csv").symlink_to(secret / "passwd")
    (run / "folder").symlink_to(secret)
    (run / "dangling").symlink_to(tmp_path / "gone")
    os.mkfifo(run / "pipe")
    for own in ("track.parquet", "remarks.jsonl", "journal.jsonl"):
        (run / own).unlink(missing_ok=True)
        (run / own).symlink_to(secret / "track.parquet")
    done = export([run], tmp_path / name, csv=True, mat=True)
    links = {"take/x.csv", "folder", "dangling", "track.parquet", "remarks.jsonl", "journal.jsonl"}
    assert set(done.omitted) == {f"{run.name}/{n}" for n in {*links, "pipe"}}
    for link in links:
        told = f"{run.name}: {link}: a link, and no file of the run; it is not opened"
        assert told in done.problems
    assert f"{run.name}: pipe: a pipe, and no file of the run; it is not opened" in done.problems
    held = _held(done.target)
    assert not [n for n in held if any(n.endswith(link) for link in {*links, "pipe"})]
    assert not [n for n, data in held.items() if b"root:x" in data]
    assert f"csv/{run.name}/measured.csv" not in held
    assert "LEFT OUT" in held["README.txt"].decode()


@needs_links
def test_a_run_that_is_a_link_is_refused(runs: list[Path], tmp_path: Path) -> None:
    (tmp_path / runs[0].name).symlink_to(runs[0])
    with pytest.raises(InputError, match="is a link; name the folder that it leads to"):
        export([tmp_path / runs[0].name], tmp_path / "x.zip", csv=False, mat=False)


@needs_links
@pytest.mark.parametrize(
    "name",
    [
        "..\\evil.txt", "C:evil.txt", "C:\\evil.txt", "\\\\server\\share", "evil.txt:stream", "CON",
        "nul.txt", "com1", "LPT9.csv", "aux .txt", "evil.", "evil ", "...",
        "a\nb", "a\x1bb", "a\u202eb", "what?", "take/..\\..\\evil.txt",
    ],
)  # fmt: skip
def test_no_name_of_an_export_leaves_its_folder(
    runs: list[Path], tmp_path: Path, name: str
) -> None:
    run = Path(shutil.copytree(runs[0], tmp_path / runs[0].name))
    (run / name).write_text("evil")
    done = export([run], tmp_path / "x.zip", csv=False, mat=False)
    assert len(done.omitted) == 1
    assert not [n for n, data in _held(done.target).items() if data == b"evil"]
    assert any(printable(name) in problem for problem in done.problems)


def test_a_run_of_no_portable_name_is_refused(runs: list[Path], tmp_path: Path) -> None:
    for bad in ("a:b", "CON", "x\\y"):
        with pytest.raises(InputError, match="rename the folder of the run"):
            export([tmp_path / bad], tmp_path / "x.zip", csv=False, mat=False)


def test_a_run_named_by_dots_has_its_own_name(runs: list[Path], tmp_path: Path) -> None:
    done = export([runs[0] / "take" / ".."], tmp_path / "x.zip", csv=False, mat=False)
    assert f"bundles/{runs[0].name}/manifest.json" in _held(done.target)


def _held(target: Path) -> dict[str, bytes]:
    if target.is_dir():
        files = (p for p in target.rglob("*") if p.is_file())
        return {p.relative_to(target).as_posix(): p.read_bytes() for p in files}
    with zipfile.ZipFile(target) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_an_export_that_breaks_off_leaves_nothing(
    runs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(series: TimeSeries) -> bytes:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("workbench.catalogue.exported.as_csv", full)
    for name in ("x", "x.zip"):
        with pytest.raises(RecordError, match=rf"{name}: cannot be written \(No space left"):
            export(runs, tmp_path / name, csv=True, mat=False)
    assert list(tmp_path.iterdir()) == []


def test_csv_of_a_series_without_gaps_has_no_empty_cell() -> None:
    assert as_csv(TWIN).splitlines()[1] == b"0,0,1"
