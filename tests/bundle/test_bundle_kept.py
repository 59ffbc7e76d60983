"""Bundles that an earlier version made read the same: three short runs of the virtual bench.

Their facts, their reports' numbers and their diagnosis were written down by that version, before
the manifest was typed and views left the seal. The views themselves are left out, as they can be
made again.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import tarfile
from pathlib import Path
from typing import Any

import pytest

from tests.bundles import journal_of, manifest_of
from tests.conftest import ROOT, Command
from workbench.bundle import Bundle, events, verify
from workbench.diagnose import robot_of
from workbench.report import write_recording, write_report
from workbench.report.load_run import load_comparison

KEPT = ROOT / "tests" / "data" / "record"
EXPECTED = json.loads((KEPT / "bundle-1.json").read_text(encoding="utf-8"))
NAMES = sorted(EXPECTED["runs"])
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("kept")
    with tarfile.open(KEPT / "bundle-1.tar.xz") as archive:
        archive.extractall(folder, filter="data")
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_a_kept_bundle_is_whole_and_typed_without_a_change(runs: Path, name: str) -> None:
    bundle = Bundle.open(runs / name)
    assert verify(bundle.path) == []
    assert manifest_of(bundle) == json.loads((bundle.path / "manifest.json").read_text())
    lines = bundle.record.journal_log.read_text().splitlines()
    assert journal_of(bundle) == [json.loads(line) for line in lines]
    assert not [one for _, one in bundle.record.events() if isinstance(one, events.Other)]


@pytest.mark.parametrize("name", NAMES)
def test_a_kept_bundle_is_shown_with_the_same_facts(
    runs: Path, workbench: Command, name: str
) -> None:
    shown = workbench("runs", "show", str(runs / name), "--json").json
    del shown["bundle"]
    assert shown == EXPECTED["runs"][name]["shown"]


@pytest.mark.parametrize("name", NAMES)
def test_a_kept_bundle_is_reviewed_with_the_same_numbers(
    runs: Path, tmp_path: Path, name: str
) -> None:
    shown = load_comparison(Bundle.open(runs / name))
    write_recording(shown, tmp_path / "compare.rrd")
    write_report(shown, tmp_path / "report.html")
    assert (tmp_path / "compare.rrd").stat().st_size > 100_000
    assert _numbers(tmp_path / "report.html") == EXPECTED["runs"][name]["report"]


def test_a_run_that_was_stopped_is_left_out_of_a_diagnosis(runs: Path, tmp_path: Path) -> None:
    stopped = shutil.copytree(runs / NAMES[0], tmp_path / f"{NAMES[0]}_stopped")
    shutil.rmtree(stopped / "take")
    text = (stopped / "manifest.json").read_text(encoding="utf-8")
    text = text.replace('"status": "complete"', '"status": "interrupted"')
    (stopped / "manifest.json").write_text(text, encoding="utf-8")
    messages: list[str] = []
    bundles = [Bundle.open(runs / name) for name in NAMES] + [Bundle.open(stopped)]
    rig, files = robot_of(bundles, messages.append)
    assert list(rig.names) == NAMES
    assert list(files) == ["shape", *NAMES]
    assert f"left out {stopped.name}: its status is interrupted" in messages


@pytest.mark.budget(25)  # a whole diagnosis
def test_kept_bundles_are_diagnosed_the_same(
    runs: Path, workbench: Command, tmp_path: Path
) -> None:
    found = workbench("diagnose", str(runs), "--out", str(tmp_path / "out"), "--json").json
    expected = EXPECTED["diagnosis"]
    assert found["answer"] == expected["answer"]
    causes = {one["effect"]: one["parameters"] for one in found["causes"]}
    assert causes.keys() == expected["causes"].keys()
    for part in (causes, found["refit"], found["prediction_mm"], found["rmse_mm"]):
        assert part
    _same(causes, expected["causes"])
    _same(found["refit"], expected["refit"])
    _same(found["prediction_mm"], expected["prediction_mm"])
    _same(found["rmse_mm"], expected["rmse_mm"])


def _numbers(page: Path) -> list[str]:
    """The numbers of a page's text, in order; words may change."""
    text = page.read_text(encoding="utf-8")
    text = re.sub(r"<(style|script|svg).*?</\1>", "", text, flags=re.DOTALL)
    return NUMBER.findall(html.unescape(re.sub(r"<[^>]+>", "\n", text)))


def _same(found: Any, expected: Any) -> None:
    """Hold found against expected values, as far as those go."""
    match expected:
        case dict():
            for key, value in expected.items():
                _same(found[key], value)
        case list():
            assert len(found) == len(expected)
            for one, other in zip(found, expected, strict=True):
                _same(one, other)
        case float():
            assert found == pytest.approx(expected, rel=1e-4)
        case _:
            assert found == expected
