import base64
import io
import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.report.conftest import NOISE_M
from workbench.motion import RingDown, Summary
from workbench.report import Comparison, PredictionError, as_jpeg, write_report
from workbench.report.headline import verdict
from workbench.report.plots import trajectory_plot
from workbench.timeseries import TimeSeries

VOID = {"meta", "br", "link", "img", "hr", "input"}


class Balance(HTMLParser):
    """Counts every element and remembers what was opened and not closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.count: dict[str, int] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.count[tag] = self.count.get(tag, 0) + 1
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.count[tag] = self.count.get(tag, 0) + 1

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag


def parse(page: str) -> Balance:
    balance = Balance()
    balance.feed(page)
    balance.close()
    return balance


@pytest.fixture(scope="module")
def page(comparison: Comparison, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(comparison, path)
    return path.read_text(encoding="utf-8")


def test_the_page_needs_nothing_from_outside(page: str) -> None:
    assert not re.search(r"https?:|src=|<script .|<link|@import|url\((?!#)|fetch|XMLHttp", page)


def test_every_element_is_closed_in_order(page: str) -> None:
    balance = parse(page)
    assert balance.open == []
    assert balance.count["svg"] == 7


def test_ids_are_unique(page: str) -> None:
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_the_headline_numbers_are_there(page: str, comparison: Comparison) -> None:
    for text in (
        "0.217 m",
        "0.251 m",
        "+0.034 m (+16 %)",
        "16.90 rad/s",
        f"{comparison.misfit.top_mm:.1f} mm",
        "workbench review 2026-11-21_0001_hop-17",
        "T was not seen for 0.4 s",
        comparison.facts["SHA-256"],
    ):
        assert text in page


def test_the_trajectory_has_two_panels_on_the_same_axes(comparison: Comparison) -> None:
    twin = comparison.twin
    higher = TimeSeries(twin.times, 3 * twin.values, twin.names, twin.valid)
    svg = trajectory_plot(replace(comparison, twin=higher))
    titles = [svg.index("Real: the robot"), svg.index("Simulated: its twin")]
    assert titles == sorted(titles)
    assert svg.count("z [m]") == 2
    assert svg.count("x [m]") == 1
    heights = Counter(re.findall(r"text-anchor: end[^>]*>([^<]+)<", svg))
    assert len(heights) > 2
    assert set(heights.values()) == {2}  # each height is marked in both panels


def test_the_largest_error_is_told_with_its_time(page: str, comparison: Comparison) -> None:
    error = comparison.error()
    at = int(np.nanargmax(error["top_error_mm"]))
    told = f"{error['top_error_mm'][at]:.1f} mm at {error.times[at]:.2f} s"
    assert f"<td>{told}</td>" in page


def test_noise_alone_is_told_beside_the_error(page: str) -> None:
    assert page.count(f"<td>{1000 * NOISE_M * 2**0.5:.2f} mm</td>") == 2


def test_predictions_stand_beside_the_free_error(comparison: Comparison, tmp_path: Path) -> None:
    known = (
        PredictionError(0.1, 0.512),
        PredictionError(2.0, 4.2),
        PredictionError(float("inf"), 12.64),
    )
    write_report(replace(comparison, predictions=known), tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    rows = {
        "0.1 s ahead, from the estimated state": "0.51 mm",
        "2 s ahead, from the estimated state": "4.20 mm",
        "Free simulation, turned as measured": "12.6 mm",
        "Free simulation, turned as commanded": f"{comparison.misfit.both_mm:.1f} mm",
    }
    for name, value in rows.items():
        assert f'<th scope="row">{name}</th><td>{value}</td>' in page
    assert page.index("<h2>Error of the twin") < page.index("<h2>Prediction")


def test_a_run_without_predictions_has_no_such_section(page: str) -> None:
    assert "<h2>Prediction" not in page


def test_a_picture_is_kept_in_the_page_itself(comparison: Comparison, tmp_path: Path) -> None:
    shot = Image.new("RGB", (40, 20), "#14a08c")
    write_report(comparison, tmp_path / "report.html", as_jpeg(shot))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    (data,) = re.findall(r'src="data:image/jpeg;base64,([^"]+)"', page)
    with Image.open(io.BytesIO(base64.b64decode(data))) as kept:
        assert kept.size == shot.size
    assert parse(page).open == []
    assert page.index("<h2>Recording") < page.index(data) < page.index("<h2>Journal")


def test_a_marked_run_says_so_first(comparison: Comparison, tmp_path: Path) -> None:
    cut = replace(comparison, mark="ABORTED, the program was killed")
    write_report(cut, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<h1>ABORTED - Initial shape at 17 rad/s</h1>" in page
    assert "ABORTED, the program was killed. What is left of it is shown." in page


def test_pictures_take_the_ink_of_the_page(page: str) -> None:
    assert "prefers-color-scheme: dark" in page
    assert "currentColor" in page
    assert "fill: #000000" not in page


def test_hostile_text_stays_text(comparison: Comparison, tmp_path: Path) -> None:
    evil = "<script>alert('x')</script> & \"{{ 7*7 }}\""
    hostile = replace(
        comparison, title=evil, run=evil, facts={evil: evil}, log=((0.0, evil),), warnings=(evil,)
    )
    write_report(hostile, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("<script") == 1, "only the page's own"
    assert "&lt;script&gt;" in page
    assert "{{ 7*7 }}" in page
    assert parse(page).open == []


def test_unmeasured_numbers_are_named_so(comparison: Comparison, tmp_path: Path) -> None:
    unknown = Summary(float("nan"), float("nan"), float("nan"))
    write_report(replace(comparison, real_summary=unknown), tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "not measured" in page
    assert "Too little of the run was seen" in page
    assert "nan" not in re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL)


def test_empty_sections_are_left_out(comparison: Comparison, tmp_path: Path) -> None:
    write_report(replace(comparison, supply=None, log=(), warnings=()), tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    headings = re.findall(r"<h2>(.*?)</h2>", page)
    assert "Result" in headings
    assert not {"Supply", "Journal", "Warnings"} & set(headings)


def test_the_same_comparison_gives_the_same_bytes(
    page: str, comparison: Comparison, tmp_path: Path
) -> None:
    write_report(comparison, tmp_path / "again.html")
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == page


def test_a_robot_that_was_never_seen_has_a_report(comparison: Comparison, tmp_path: Path) -> None:
    real = comparison.real
    unseen = TimeSeries(real.times, real.values, real.names, np.zeros_like(real.valid))
    write_report(replace(comparison, real=unseen), tmp_path / "report.html")
    assert parse((tmp_path / "report.html").read_text(encoding="utf-8")).open == []


def released(comparison: Comparison) -> Comparison:
    """The same motions as if they were a ring-down."""
    return replace(
        comparison,
        mode="decay",
        supply=None,
        floor_m=-0.02,
        real_summary=RingDown(0.0158, 1.626, 0.0039),
        twin_summary=RingDown(0.0157, 1.643, 0.0036),
    )


def test_a_ring_down_is_told_by_its_own_numbers(comparison: Comparison, tmp_path: Path) -> None:
    write_report(released(comparison), tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Let go, the robot rang at 1.626 Hz and its twin at 1.643 Hz" in page
    for text in ("15.8 mm", "0.39 %", "time since the release [s]", "Path of T, the tip"):
        assert text in page
    for text in ("Distance</th>", "Rotor speed", "rotor's first motion", "of drive"):
        assert text not in page
    assert parse(page).open == []


def test_summaries_of_two_kinds_are_refused(comparison: Comparison) -> None:
    mixed = replace(comparison, twin_summary=RingDown(0.1, 1.0, 0.1))
    with pytest.raises(TypeError, match="summarized in different ways"):
        verdict(mixed)
