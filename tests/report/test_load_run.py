"""What a bundle keeps is enough to show its run again, and what is left of a broken one."""

from __future__ import annotations

import json
import pickle
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bundles import manifest_of, report_of
from workbench.bundle import Bundle, runs_named, verify
from workbench.errors import InputError
from workbench.report import Comparison, load_any, sections, write_recording, write_report
from workbench.report.geometry import beam_points, certainty
from workbench.report.load_run import load_comparison, load_damaged
from workbench.twin import comparison as twin_comparison


@pytest.fixture
def hop(finished: Path, tmp_path: Path) -> Bundle:
    """A copy of the hop, to be broken."""
    (path,) = finished.glob("*_hop-*")
    return Bundle.open(Path(shutil.copytree(path, tmp_path / "runs" / path.name)))


def once_a_curve(plot: Callable[..., str], kept: dict[bytes, str]) -> Callable[..., str]:
    """Draw a figure only where what it may show has not been drawn before."""

    def drawn(*shown: Any) -> str:
        curves = [
            replace(one, title="", run="", label=(), protocol="", mark=None, facts={}, log=(),
                    warnings=()) if isinstance(one, Comparison) else one
            for one in shown
        ]  # fmt: skip
        key = pickle.dumps((plot.__name__, curves))
        if key not in kept:
            kept[key] = plot(*shown)
        return kept[key]

    return drawn


@pytest.fixture(scope="module")
def drawings() -> dict[bytes, str]:
    return {}


@pytest.fixture
def _drawn_once(drawings: dict[bytes, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw the same curves once: they take most of a report's time; most damage changes none."""
    for name in [name for name in vars(sections) if name.endswith("_plot")]:
        monkeypatch.setattr(sections, name, once_a_curve(getattr(sections, name), drawings))


def cut_off(bundle: Bundle) -> Bundle:
    """Leave what a run has that was killed while the motor turned."""
    for name in ("track", "twin", "raw", "supply", "state"):
        (bundle.path / f"{name}.parquet").unlink()
    for name in ("compare.rrd", "report.html", "checksums.txt"):
        (bundle.path / name).unlink()
    shutil.rmtree(bundle.path / "take")
    later = ("sent", "output_off", "cameras", "release", "command", "real", "twin", "error_mm",
             "error_foot_mm", "error_top_mm", "track", "warnings", "noise_mm", "noise_rad",
             "rotor_speed_rad_s", "floor", "alignment", "state", "prediction_mm",
             "compared_s", "commanded_mm", "measured_input_mm", "measured_start_mm",
             "noise_floor_mm")  # fmt: skip
    facts = {key: value for key, value in manifest_of(bundle).items() if key not in later}
    text = json.dumps(facts | {"status": "failed"})
    (bundle.path / "manifest.json").write_text(text, encoding="utf-8")
    journal = bundle.path / "journal.jsonl"
    lines = journal.read_text(encoding="utf-8").splitlines()
    journal.write_text("\n".join(lines[:12]) + '\n{"time_s": 2.', encoding="utf-8")
    return Bundle.open(bundle.path)


@pytest.mark.parametrize("half", [0, 1])
def test_every_run_is_shown_again_as_its_report_tells_it(
    finished: Path, tmp_path: Path, half: int
) -> None:
    runs = sorted(path for path in finished.iterdir() if path.is_dir())
    assert len(runs) > 1
    for path in runs[half::2]:
        bundle = Bundle.open(path)
        write_report(load_comparison(bundle), tmp_path / "again.html")
        again = (tmp_path / "again.html").read_text(encoding="utf-8")
        assert again == bundle.view("report").read_text(encoding="utf-8")
        assert "measured to the end" in again  # drawn once the journal is complete


def test_a_whole_run_is_not_marked(hop: Bundle) -> None:
    found = load_any(hop)
    assert found.mark is None
    assert found.label == ("hop", "17 rad/s", "thesis-initial", "repeat 1")
    assert [state.name for state in found.phases] == ["rest", "ramp", "hold", "off"]
    assert found.protocol == hop.document("protocol").read_text(encoding="utf-8")
    rest = manifest_of(hop)["noise_mm"]["foot_z_m"]["rest"]
    assert found.noise["foot_z_m"] == pytest.approx(rest / 1000)


def test_the_twin_s_corners_carry_it(finished: Path) -> None:
    (path,) = finished.glob("*_hop-*")
    twin = Bundle.open(path).series.read("twin")
    corners = np.sum([twin[f"corner_{k}_z_N"] for k in range(4)], axis=0)
    np.testing.assert_allclose(corners, twin["ground_z_N"], atol=1e-9)
    assert corners[0] == pytest.approx(0.2574 * 9.81, rel=0.01)  # the robot's weight at rest


def test_the_estimated_pose_follows_the_track_and_has_a_beam(finished: Path) -> None:
    for path in sorted(finished.glob("*_*-*")):
        bundle = Bundle.open(path)
        found = load_comparison(bundle)
        assert manifest_of(bundle)["state"] == "estimated"
        assert found.estimate is not None
        estimate = found.estimate.at(found.real.times)
        seen = estimate.validity("top_x_m") & found.real.validity("top_x_m")
        assert seen.sum() > 300
        apart = (estimate["top_x_m"] - found.real["top_x_m"])[seen]
        assert np.std(apart) < 1e-3
        assert np.isfinite(beam_points(found.estimate, found.figure)).all()
        told = manifest_of(bundle)["prediction_mm"]
        assert list(told) == ["0.1", "0.5", "2"]
        assert [row.mm for row in found.predictions] == list(told.values())
        facts, sources = manifest_of(bundle), found.sources
        assert sources is not None
        assert sources.started == facts["measured_start_mm"] < sources.commanded
        assert (sources.turned is None) == (found.mode not in ("hop", "clamped"))
        sure = certainty(found.estimate)
        assert sure.shape[1] == 16
        assert np.median(sure) > 0.9


def test_a_run_that_cannot_be_observed_is_whole_but_for_its_state(
    hop: Bundle, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise InputError("foot and T were seen in only 12 % of the run")

    monkeypatch.setattr(twin_comparison, "estimate", refuse)
    (hop.path / "state.parquet").unlink()
    twin_comparison.compare_with_twin(hop)
    hop.finish("complete")
    assert not hop.series.has("state")
    shown = load_comparison(hop)
    assert shown.estimate is None
    assert shown.facts["estimated pose"] == "foot and T were seen in only 12 % of the run"
    assert shown.misfit.both_mm > 0
    assert "foot and T were seen in only 12 % of the run" in report_of(hop)


def test_views_that_were_damaged_do_not_mark_a_run(hop: Bundle) -> None:
    for name in ("compare.rrd", "report.html"):
        (hop.path / name).write_bytes(b"broken")
    assert load_any(hop).mark is None


@pytest.mark.usefixtures("_drawn_once")
@pytest.mark.parametrize("kind", ["track", "twin", "supply", "state"])
@pytest.mark.parametrize("spoil", [lambda data: data[: len(data) // 2], lambda data: b""])
def test_a_series_that_was_damaged_is_named_and_the_rest_is_shown(
    hop: Bundle, tmp_path: Path, kind: str, spoil: Callable[[bytes], bytes]
) -> None:
    file = hop.path / f"{kind}.parquet"
    file.write_bytes(spoil(file.read_bytes()))
    found = load_any(hop)
    assert found.mark is not None
    assert found.mark.startswith("DAMAGED")
    assert any(f"{kind}.parquet" in warning for warning in found.warnings)
    left = {
        "track": found.real,
        "twin": found.twin,
        "supply": found.supply or (),
        "state": found.estimate or (),
    }
    assert {name: len(series) > 0 for name, series in left.items()} == {
        name: name != kind for name in left
    }
    write_recording(found, tmp_path / "left.rrd")
    write_report(found, tmp_path / "left.html")
    assert "DAMAGED - A short hop" in (tmp_path / "left.html").read_text(encoding="utf-8")


def test_one_byte_of_a_take_marks_the_run(hop: Bundle) -> None:
    take = hop.take()
    data = bytearray(take.read_bytes())
    data[len(data) // 2] ^= 1
    take.write_bytes(bytes(data))
    found = load_any(hop)
    assert found.mark == "DAMAGED, 1 of its files are not as they were written"
    assert any(take.name in warning for warning in found.warnings)
    assert len(found.real) > 100


def test_a_run_that_was_killed_shows_what_was_sent(hop: Bundle, tmp_path: Path) -> None:
    cut = cut_off(hop)
    with pytest.raises(InputError, match="was never compared with its twin"):
        load_comparison(cut)
    found = load_any(cut)
    assert found.mark == "ABORTED, the program was killed or the computer stopped"
    assert len(found.real) == len(found.twin) == 0
    assert found.phases[0].name == "rest"
    assert found.phases[1].time_s == pytest.approx(0.0)
    assert any("output on" in text for _, text in found.log)
    write_recording(found, tmp_path / "cut.rrd")
    write_report(found, tmp_path / "cut.html")
    page = (tmp_path / "cut.html").read_text(encoding="utf-8")
    assert "What is left of it is shown" in page
    assert ">nan" not in page


def test_an_error_that_ended_a_run_is_its_mark(hop: Bundle) -> None:
    cut = cut_off(hop)
    cut.finish("safety-stop", error="9 A at the motor, 1 A allowed\nmore of it")
    assert load_damaged(cut).mark == "ABORTED (safety-stop): 9 A at the motor, 1 A allowed"


def changed(path: Path) -> None:
    """Change one byte in the middle."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)


def cut(path: Path) -> None:
    """Leave the first half, as a full disk does."""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


@pytest.mark.usefixtures("_drawn_once")
@pytest.mark.parametrize(
    "harm", [cut, *(pytest.param(harm, marks=pytest.mark.long) for harm in (changed, Path.unlink))]
)
def test_whatever_file_is_harmed_verify_names_it_and_the_rest_is_shown(
    hop: Bundle, tmp_path: Path, harm: Callable[[Path], None]
) -> None:
    """As `review`, `report` and `verify` meet it; views are drawn anew, so they mark no run."""
    root, views = hop.path.parent, ("compare.rrd", "report.html")
    files = [f for f in hop.path.rglob("*") if f.is_file() and f.stat().st_size]
    assert len(files) > 10
    for file in files:
        kept = file.read_bytes()
        harm(file)
        name = file.relative_to(hop.path).as_posix()
        named = any(problem.startswith(name) for problem in verify(hop.path))
        assert named == (name not in views), name
        (folder,) = runs_named([hop.path], root)
        shown = load_any(Bundle.recover(folder)[0])
        assert (shown.mark is not None) == (name not in views), name
        write_recording(shown, tmp_path / "shown.rrd")
        write_report(shown, tmp_path / "shown.html")
        if shown.mark is not None:
            assert shown.mark in (tmp_path / "shown.html").read_text(encoding="utf-8"), name
        file.write_bytes(kept)
    assert load_any(Bundle.open(hop.path)).mark is None
