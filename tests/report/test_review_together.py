"""Several runs in one recording, and one page for all of them."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun.blueprint as rrb
from rerun.chunk import Chunk, RrdReader
from scipy import stats

from tests.report.conftest import DURATION_S, FIGURE, make_motion
from tests.report.test_review_recording import shows, views_in
from tests.report.test_review_report import parse
from workbench.motion import Summary, summarize
from workbench.report import (
    Comparison,
    ExperimentPage,
    HeadlessViewer,
    write_experiment_page,
    write_recording,
    write_together,
)
from workbench.report.lanes import lanes
from workbench.report.repeats import conditions, mean_interval

WAYS = (0.20, 0.23, 0.26, 0.90)


def run(base: Comparison, number: int, way: float, *label: str) -> Comparison:
    """A run of the experiment whose twin goes its own way."""
    twin = make_motion(120.0, way, 0.019, 17.0)
    return replace(
        base,
        run=f"run-{number}",
        label=("hop", *label),
        twin=twin,
        twin_summary=summarize(twin, DURATION_S),
    )


@pytest.fixture(scope="module")
def runs(comparison: Comparison) -> list[Comparison]:
    """Three repeats of one condition and one run of another."""
    labels = [("17 rad/s", f"repeat {k}") for k in (1, 2, 3)] + [("19 rad/s", "repeat 1")]
    return [
        run(comparison, number, way, *label)
        for number, (way, label) in enumerate(zip(WAYS, labels, strict=True), start=1)
    ]


@pytest.fixture(scope="module")
def recording(runs: list[Comparison], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("together") / "runs.rrd"
    write_together("Two speeds", runs, path)
    return path


@pytest.fixture(scope="module")
def page(runs: list[Comparison], tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "runs.html"
    marked = [*runs[:3], replace(runs[3], mark="ABORTED (safety-stop): 9 A at the motor")]
    links = ("a/report.html", "b/report.html", "c/report.html", "")
    write_experiment_page(
        ExperimentPage("Two speeds", "two.yaml", tuple(marked), links, "workbench review two"), path
    )
    return path.read_text(encoding="utf-8")


def static(chunks: list[Chunk], path: str, part: str) -> Any:
    found = [c.to_record_batch() for c in chunks if c.entity_path == path]
    columns = [b.column(n) for b in found for n in b.schema.names if part in n]
    return columns[0].to_pylist()[0]


def test_each_run_has_all_that_a_recording_of_its_own_has(
    chunks: list[Chunk], runs: list[Comparison], tmp_path: Path
) -> None:
    write_recording(runs[1], tmp_path / "alone.rrd")
    alone = {
        chunk.entity_path
        for chunk in RrdReader(tmp_path / "alone.rrd").stream().to_chunks()
        if not chunk.entity_path.startswith("/__")
    }
    together = {chunk.entity_path for chunk in chunks}
    assert len(alone) > 30
    assert {f"/runs/2{path}" for path in alone} <= together


def test_lanes_lie_beside_one_another(chunks: list[Chunk]) -> None:
    places = [static(chunks, f"/runs/{k}", "translation")[0] for k in (1, 2, 3, 4)]
    assert [place[0] for place in places] == [0.0] * 4
    gaps = np.diff([place[1] for place in places])
    assert np.all(np.abs(gaps) > 0.25)  # a foot is 0.25 m wide
    assert np.ptp(gaps) < 1e-6


def test_many_lanes_lie_in_rows_that_do_not_meet(runs: list[Comparison], tmp_path: Path) -> None:
    many = [replace(one, run=f"{one.run}-{k}") for k in range(3) for one in runs]
    write_together("many", many, tmp_path / "many.rrd")
    sent = list(RrdReader(tmp_path / "many.rrd").stream().to_chunks())
    places = np.array([static(sent, f"/runs/{k}", "translation")[0] for k in range(1, 13)])
    starts, ends = zip(*(one.reach() for one in runs), strict=True)
    assert len(set(map(tuple, places))) == 12
    np.testing.assert_allclose(places[:4, 1], places[4:8, 1])
    assert np.diff(places[::4, 0]).min() > max(ends) - min(starts) + FIGURE.foot_length


def test_every_label_of_the_tree_has_a_name_that_fits_its_width(runs: list[Comparison]) -> None:
    def names(part: Any) -> list[Any]:
        parts = part.contents if isinstance(part, rrb.Container) else ()
        return [part.name, *(name for one in parts for name in names(one))]

    tabs: Any = lanes(runs).root_container.contents
    tree = [name for tab in tabs for part in tab.contents for name in names(part)]
    assert len(tree) > 60
    assert [name for name in tree if name is None or len(name) > 15] == []


def test_each_run_tells_its_numbers_and_the_table_all_of_them(chunks: list[Chunk]) -> None:
    for number, way in enumerate(WAYS, start=1):
        (chunk,) = [c for c in chunks if c.entity_path == f"/__properties/run_{number}"]
        told = chunk.to_record_batch().to_pylist()[0]
        assert told["run"] == [f"run-{number}"]
        assert told["twin_distance_m"][0] == pytest.approx(way, abs=0.01)
    table = static(chunks, "/notes", "text")[0]
    assert "| 4 | 19 rad/s, repeat 1 |" in table
    assert "hop" not in table.replace("hopping", "")  # what is the same of all is not repeated


def test_every_view_of_every_tab_has_something_to_show(
    chunks: list[Chunk], runs: list[Comparison]
) -> None:
    sent = {chunk.entity_path for chunk in chunks}
    empty = [view.name for view in views_in(lanes(runs).root_container) if not shows(view, sent)]
    assert set(empty) == {"All robots"}  # there is no extended twin


def test_the_ways_that_tell_most_are_laid_over_one_another(runs: list[Comparison]) -> None:
    names = [view.name for view in views_in(lanes(runs).root_container)]
    assert "Real foot x [m]" in names
    clamped = [replace(one, mode="clamped") for one in runs]
    names = [view.name for view in views_in(lanes(clamped).root_container)]
    assert "Twin T x [m]" in names


@pytest.mark.viewer
def test_the_viewer_shows_a_tab_for_each_pair_and_one_for_all(viewer: HeadlessViewer) -> None:
    views = viewer.state().views
    assert [report for view in views for report in view.reports] == []
    pairs = sorted(view.origin for view in views if view.name == "Both robots")
    assert pairs == [f"/runs/{k}" for k in (1, 2, 3, 4)]
    assert {"All robots", "Runs"} <= {view.name for view in views}
    (recorded,) = viewer.state().recordings
    assert [timeline.name for timeline in recorded.timelines] == ["t"]


def test_intervals_are_those_of_student() -> None:
    values = [0.20, 0.23, 0.27]
    found = mean_interval([*values, math.nan])
    low, high = stats.t.interval(0.9, 2, loc=np.mean(values), scale=stats.sem(values))
    assert found.known == 3
    assert (found.mean - found.half, found.mean + found.half) == pytest.approx((low, high))
    assert math.isnan(mean_interval([0.2]).half)
    assert mean_interval([]).known == 0


def test_repeats_are_one_condition(runs: list[Comparison]) -> None:
    assert [(one.name, len(one.runs)) for one in conditions(runs)] == [
        ("17 rad/s", 3),
        ("19 rad/s", 1),
    ]


def test_a_marked_run_counts_in_no_number(runs: list[Comparison]) -> None:
    cut = [*runs[:2], replace(runs[2], mark="ABORTED")]
    (condition,) = conditions(cut)
    assert condition.interval(lambda one: one.twin_summary.as_json()["distance_m"]).known == 2


def test_the_page_needs_nothing_from_outside(page: str) -> None:
    assert not re.search(r"https?:|src=|<script .|<link|@import|url\((?!#)|fetch|XMLHttp", page)
    assert parse(page).open == []
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page


def test_the_page_tells_means_intervals_runs_and_how_to_see_them(
    page: str, runs: list[Comparison]
) -> None:
    twins = [one.twin_summary.as_json()["distance_m"] for one in runs[:3]]
    found = mean_interval(twins)
    assert f"<td>{1000 * found.mean:.1f} \N{PLUS-MINUS SIGN} {1000 * found.half:.1f}</td>" in page
    assert parse(page).count["polyline"] >= 8  # robot and twin of four thumbnails
    assert page.count("/report.html") == 3
    assert "workbench review two" in page
    assert "Run 4: ABORTED (safety-stop): 9 A at the motor" in page
    assert "1 of them not whole and left out of the numbers" in page
    assert "title: Hop at 17 rad/s" in page  # the protocol as it was given


def test_the_paths_stand_on_the_same_axes_simulated_left_real_right(page: str) -> None:
    for condition in ("17 rad/s", "19 rad/s"):
        assert page.index(f"Simulated: {condition}") < page.index(f"Real: {condition}")


def test_conditions_are_sorted_whatever_the_draw(comparison: Comparison) -> None:
    drawn = [("hop", "17 rad/s"), ("hop", "9.5 rad/s"), ("hop", "18 rad/s"), ("decay", "0.2 N")]
    found = conditions([replace(comparison, label=(*one, "repeat 1")) for one in drawn])
    names = ["decay, 0.2 N", "hop, 9.5 rad/s", "hop, 17 rad/s", "hop, 18 rad/s"]
    assert [one.name for one in found] == names


def test_runs_of_which_nothing_moved_have_a_page(comparison: Comparison, tmp_path: Path) -> None:
    nothing, unknown = comparison.twin.between(100.0, 200.0), Summary(*[math.nan] * 3)
    cut = replace(
        comparison, real=nothing, twin=nothing, real_summary=unknown, twin_summary=unknown,
        mark="ABORTED",
    )  # fmt: skip
    path = tmp_path / "cut.html"
    write_experiment_page(ExperimentPage("Cut", "cut.yaml", (cut,), ("",), "workbench"), path)
    text = path.read_text(encoding="utf-8")
    assert "not measured" in text
    assert ">nan" not in text
