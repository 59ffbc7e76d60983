"""Views are drawn after the seal, and what keeps them from being drawn costs no run."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.bundles import carried_out, manifest_of, report_of
from tests.conftest import Command
from workbench import report as views
from workbench.bundle import Bundle, View, verify
from workbench.errors import WorkbenchError
from workbench.report import write_views
from workbench.run import ingest

PROTOCOL = """\
schema: workbench/protocol-1
title: Short ring-down
steps:
  - run: {mode: decay, pull: 0.4 N, rest: 1 s, duration: 2 s}
"""
SHEET = """\
schema: workbench/sheet-1
model: thesis
shape: thesis-initial
tracking: {up: y, forward: -z}
bodies: {foot: Foot, top: T, rotor: Rotor}
runs:
  - {take: TAKE, mode: decay, pull: 0.4 N}
"""
VIEWS: tuple[View, ...] = ("recording", "report")
DRAWING = ("PIL", "jinja2", "matplotlib", "rerun", "rerun_cli")
WITHOUT = f"""\
import sys
sys.modules.update(dict.fromkeys({DRAWING}))
sys.argv = ["workbench", *sys.argv[1:]]
from workbench.cli import main
main()
"""


class PanicError(BaseException):
    """As a panic in Rust comes to Python: it is no Exception."""


@pytest.fixture
def protocol(tmp_path: Path) -> Path:
    path = tmp_path / "short.yaml"
    path.write_text(PROTOCOL, encoding="utf-8")
    return path


@pytest.fixture
def bare(finished: Path, tmp_path: Path) -> Bundle:
    """A ring-down without views."""
    (path,) = finished.glob("*_decay-*")
    bundle = Bundle.open(Path(shutil.copytree(path, tmp_path / "runs" / path.name)))
    for kind in VIEWS:
        bundle.view(kind).unlink()
    return bundle


def raising(error: BaseException) -> Callable[..., Any]:
    def draw(*_: object) -> None:
        raise error

    return draw


@pytest.fixture
def _no_viewer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "write_recording", raising(RuntimeError("the viewer is broken")))


def test_a_run_and_a_sheet_need_no_viewer_and_no_drawing(
    workbench: Command, protocol: Path, tmp_path: Path
) -> None:
    """Neither imported nor carried out; the views are drawn where they can be."""
    runs = tmp_path / "r"

    def without(*words: object) -> Any:
        done = subprocess.run(
            [sys.executable, "-c", WITHOUT, *map(str, words), "--runs", runs, "--json"],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert "compare.rrd and report.html could not be drawn" in done.stderr
        return json.loads(done.stdout)

    found = without("run", protocol)
    driven = Bundle.open(Path(found["bundle"]))
    sheet = tmp_path / "sheet.yaml"
    sheet.write_text(SHEET.replace("TAKE", str(driven.take())), encoding="utf-8")
    (ingested,) = without("ingest", sheet)["bundles"]
    assert found["status"] == "complete"
    for bundle in (driven, Bundle.open(Path(ingested))):
        assert manifest_of(bundle)["status"] == "complete"
        assert manifest_of(bundle)["error_mm"] > 0
        assert verify(bundle.path) == []
        assert views_of(bundle) == []
    assert write_views(driven) is None
    assert views_of(driven) == ["recording", "report"]
    assert verify(driven.path) == []


def views_of(bundle: Bundle) -> list[str]:
    return [kind for kind in VIEWS if bundle.view(kind).exists()]


@pytest.mark.usefixtures("_no_viewer")
def test_a_broken_viewer_costs_the_recording_alone(
    workbench: Command, protocol: Path, tmp_path: Path
) -> None:
    answer = workbench("run", protocol, "--runs", tmp_path / "r", "--json")
    assert answer.code == 0
    (warning,) = [line for line in answer.err.splitlines() if "could not be drawn" in line]
    assert "compare.rrd could not be drawn (" in warning
    assert "the viewer is broken" in warning
    found = answer.json
    assert found["status"] == "complete"
    assert found["runs"][0]["warnings"][-1] == found["warnings"][-1] == warning
    bundle = Bundle.open(Path(found["bundle"]))
    assert views_of(bundle) == ["report"]
    assert warning not in manifest_of(bundle)["warnings"]
    assert verify(bundle.path) == []


def test_the_command_in_the_warning_draws_what_is_missing(
    workbench: Command, bare: Bundle, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "workbench.report.comparison_set.ComparisonSet.picture",
        raising(WorkbenchError("no driver")),
    )
    with monkeypatch.context() as patch:
        patch.setattr(views, "write_recording", raising(PanicError("unreachable code")))
        patch.setattr(views, "write_report", raising(ImportError("no module named jinja2")))
        told = write_views(bare)
    assert told is not None
    assert "\n" not in told
    for part in ("PanicError: unreachable code", "ImportError: no module named jinja2"):
        assert part in told
    command = shlex.split(told.partition("workbench review ")[2])
    assert workbench("review", *command).code == 0
    assert views_of(bare) == ["recording", "report"]
    assert verify(bare.path) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full disk")
def test_a_full_disk_costs_a_view(bare: Bundle) -> None:
    (bare.path / ".report.html").symlink_to("/dev/full")
    told = write_views(bare)
    assert told is not None
    assert told.startswith("report.html could not be drawn (RecordError: ")
    assert "No space left" in told
    assert views_of(bare) == ["recording"]


def test_ctrl_c_is_no_broken_viewer(bare: Bundle, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "write_recording", raising(KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        write_views(bare)


@pytest.mark.usefixtures("_no_viewer")
def test_a_take_that_is_added_gets_its_views(
    workbench: Command, bare: Bundle, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ingest, "add_take", lambda take, bundle, progress, insist: None)
    answer = workbench("ingest", bare.take(), "--into", bare.path, "--json")
    assert answer.code == 0
    assert "the viewer is broken" in answer.json["warnings"][-1]
    assert views_of(bare) == ["report"]


@pytest.mark.usefixtures("_no_viewer")
def test_a_sheet_s_runs_get_their_views(
    workbench: Command, bare: Bundle, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def made(*_: object) -> Iterator[Bundle]:
        yield bare

    monkeypatch.setattr(ingest, "ingest_sheet", made)
    sheet = tmp_path / "sheet.yaml"
    sheet.write_text(SHEET.replace("TAKE", str(bare.take())), encoding="utf-8")
    answer = workbench("ingest", sheet, "--json")
    assert answer.code == 0
    assert answer.json["bundles"] == [str(bare.path)]
    assert "the viewer is broken" in answer.json["warnings"][0]
    assert views_of(bare) == ["report"]


def test_a_report_says_how_the_run_compares_with_the_last_one(tmp_path: Path) -> None:
    one = "  - run: {mode: decay, pull: 0.4 N, rest: 0.5 s, duration: 1 s}\n"
    first, second = carried_out(tmp_path, one + one)
    said = "Beside the last run of the same condition: error of the twin"
    assert said not in report_of(first)
    assert said in report_of(second)
