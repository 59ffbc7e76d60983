"""Why a model is believed: errors as compared, the real beam, the missing force; in the viewer."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from rerun.chunk import Chunk

from tests.panel.chromium import browser
from tests.report.conftest import NOISE_M, make_comparison, make_motion
from workbench.motion import FOOT_ERROR, TOP_ERROR
from workbench.report import (
    Comparison,
    ErrorSources,
    HeadlessViewer,
    Replayed,
    ValidationReplay,
    write_recording,
    write_report,
)
from workbench.report.geometry import certainty, missing_force, missing_scale
from workbench.report.palette import REAL, SHADES, rgb
from workbench.timeseries import TimeSeries

NOISE_MM = 1000 * NOISE_M * np.sqrt(2)
DOUBT_S = (4.0, 4.4)  # T is lost: its beam is a guess
DRAWN_S = 20.0


def estimated(comparison: Comparison) -> TimeSeries:
    """The real robot's pose as an observer would have it, less sure while T is lost."""
    motion = comparison.twin.between(-1.0, 9.0)
    lost = (motion.times > DOUBT_S[0]) & (motion.times < DOUBT_S[1])
    columns = {name: motion[name] for name in motion.names if not name.startswith("corner")}
    for k in range(17):
        columns[f"beam_{k}_sigma_m"] = np.where(lost, 8e-3, 1e-4) * (k / 16)
    for point, size in (("top", 0.02), ("foot", 1e-5)):
        for axis in "xz":
            columns[f"missing_{point}_{axis}_N"] = size * np.sin(9 * motion.times)
            columns[f"missing_{point}_{axis}_sigma_N"] = np.full(len(motion), 2e-3)
    return TimeSeries.of(motion.times, columns)


def replay(name: str, advance: float, mm: float) -> Replayed:
    motion = make_motion(120.0, advance, 0.016, 16.9).between(-0.1, 2.0)
    rng = np.random.default_rng(1)
    columns = {
        key: mm * np.abs(rng.standard_normal(len(motion))) for key in (FOOT_ERROR, TOP_ERROR)
    }
    error = TimeSeries.of(motion.times, columns)
    rms = float(np.sqrt(np.mean(error.values**2)))
    return Replayed(name, motion, error, rms, {"0.1": 0.4, "2": 2 * mm})


@pytest.fixture(scope="module")
def evident() -> Comparison:
    comparison = make_comparison()
    replays = replay("refitted", 0.23, 5.0), replay("april-model", 0.213, 0.3)
    validation = ValidationReplay(*replays, NOISE_MM, 2.0, "Held out of april.")
    return replace(comparison, estimate=estimated(comparison), validation=validation,
                   sources=ErrorSources(2.0, 7.5, 2.8, 2.5, 0.28))  # fmt: skip


@pytest.fixture(scope="module")
def recording(evident: Comparison, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("evidence") / "compare.rrd"
    write_recording(evident, path)
    return path


def moving(chunks: list[Chunk], path: str) -> Chunk:
    (found,) = [c for c in chunks if c.entity_path == path and not c.is_static]
    return found


def test_a_beam_is_the_fainter_the_less_certain_it_is(
    chunks: list[Chunk], evident: Comparison
) -> None:
    assert evident.estimate is not None
    sure = certainty(evident.estimate)
    assert sure.shape == (len(evident.estimate), 16)
    assert sure[0].min() == 1.0
    row = int(np.searchsorted(evident.estimate.times, np.mean(DOUBT_S)))
    assert sure[row, -1] == pytest.approx(0.15)
    assert np.all(np.diff(sure[row]) <= 0), "the root is sure, the tip is not"
    batch = moving(chunks, "/real/beam").to_record_batch()
    (name,) = [n for n in batch.schema.names if "colors" in n]
    colors = batch.column(name)[row].as_py()
    red = [color >> 24 for color in colors]  # 0xRRGGBBAA
    ground, ink = rgb(SHADES["ground"])[0], rgb(REAL)[0]
    assert len(colors) == 16
    np.testing.assert_allclose(red, ground + sure[row] * (ink - ground), atol=1)
    assert red[-1] < 90 < 200 < red[0]


def test_only_a_force_beyond_noise_is_an_arrow(chunks: list[Chunk], evident: Comparison) -> None:
    assert evident.estimate is not None
    _, beyond = missing_force(evident.estimate, "top")
    batch = moving(chunks, "/real/missing/top").to_record_batch()
    (name,) = [n for n in batch.schema.names if "vectors" in n]
    sent = [bool(cell) for cell in batch.column(name).to_pylist()]
    assert sent == beyond.tolist()
    assert 0.5 < np.mean(sent) < 1.0
    batch = moving(chunks, "/real/missing/foot").to_record_batch()
    (name,) = [n for n in batch.schema.names if "vectors" in n]
    assert not any(batch.column(name).to_pylist()), "a force within the noise is none"
    assert missing_scale(evident.estimate) == pytest.approx(2.0), "0.028 N are 57 mm"


def in_front(viewer: HeadlessViewer, name: str, png: Path) -> np.ndarray:
    """Return the picture of the view of a name in the front tab; both tabs may have one."""
    pictures = []
    for view in viewer.state().views:
        if view.name == name:
            with suppress(ConnectionError):  # that of the tab behind is not drawn
                viewer.screenshot(png, view.view_id)
                pictures.append(matplotlib.image.imread(png)[..., :3])
    (picture,) = pictures
    return picture


@pytest.mark.viewer
def test_the_viewer_opens_on_the_models_as_compared(
    viewer: HeadlessViewer, evident: Comparison, tmp_path: Path
) -> None:
    viewer.set_time(1.5)
    views = viewer.state().views
    assert [report for view in views for report in view.reports] == []
    names = {view.name for view in views}
    errors = {f"{point} error [mm]" for point in ("T", "Foot")}
    robots = {"Real", "Base", "Extended", "All three"}
    assert robots | errors | {"Missing [mN]", "Notes"} <= names
    for view, colors in (("Real", "ov"), ("Base", "b"), ("Extended", "g")):
        deadline = time.monotonic() + DRAWN_S
        seen = colors_in(in_front(viewer, view, tmp_path / "shot.png"))
        while seen != set(colors) and time.monotonic() < deadline:  # a busy viewer draws in steps
            seen = colors_in(in_front(viewer, view, tmp_path / "shot.png"))
        assert seen == set(colors), view


def colors_in(picture: np.ndarray) -> set[str]:
    """Return which of orange, blue, green and violet a picture shows."""
    red, green, blue = np.moveaxis(picture, -1, 0)
    shares = {
        "o": np.mean(red - blue > 0.4),
        "b": np.mean((blue - red > 0.4) & (green - red > 0.15)),
        "g": np.mean((green - red > 0.3) & (green - blue > 0.15)),
        "v": np.mean((blue - green > 0.2) & (red - green > 0.1)),
    }
    return {color for color, share in shares.items() if share > 2e-4}


@pytest.mark.viewer
def test_the_real_beam_fades_in_the_viewer(viewer: HeadlessViewer, tmp_path: Path) -> None:
    strong = []
    for instant in (3.5, float(np.mean(DOUBT_S))):
        viewer.set_time(instant)
        picture = in_front(viewer, "Real", tmp_path / "shot.png")
        upper = picture[: picture.shape[0] // 2]  # the beam without the foot
        strong.append(np.mean(upper[..., 0] - upper[..., 2] > 0.6))
    assert strong[1] < 0.6 * strong[0]


def test_the_report_says_what_is_drive_start_and_model(evident: Comparison, tmp_path: Path) -> None:
    write_report(evident, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert (
        "Of the 7.50 mm at foot and T over the first 2.0 s, 4.70 mm are the drive&#39;s, 0.30 mm "
        "are the start&#39;s, and 2.50 mm the model&#39;s; noise alone makes 0.28 mm."
    ) in page
    assert "<td>2.80 mm</td><td>4.70 mm less: the drive</td>" in page
    assert "0.30 mm less: the start; what remains is the model&#39;s" in page
    assert "then it is chaotic" in page
    assert "<h2>Pose</h2>" in page
    assert "fainter where that is less certain" in page
    assert "<h2>Missing force</h2>" in page


def test_a_pose_that_was_not_estimated_is_a_line_and_says_why(
    comparison: Comparison, tmp_path: Path
) -> None:
    bare = replace(comparison, unestimated="hop-1: less than 0.5 s were seen")
    write_report(bare, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "was not estimated (hop-1: less than 0.5 s were seen)" in page
    assert "<h2>Missing force</h2>" not in page


def test_a_step_that_does_not_help_is_said_to_be_none(evident: Comparison, tmp_path: Path) -> None:
    worse = replace(evident, sources=ErrorSources(2.0, 2.0, 2.3, 2.2, 0.28))
    write_report(worse, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "0.30 mm more: not the drive" in page


def test_a_page_is_read_and_magnified_in_a_browser(evident: Comparison, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    write_report(evident, path)
    with browser() as running:
        page = running.open(path.as_uri(), 420, 900)
        assert page.complaints() == []
        assert page.evaluate("document.documentElement.scrollWidth") <= 420
        least = page.evaluate(
            "Math.min(...[...document.querySelectorAll('figure svg text')].map(one => "
            "parseFloat(getComputedStyle(one).fontSize) * one.ownerSVGElement.getScreenCTM().a))"
        )
        assert least >= 9.0
        page.resize(1000, 900)
        whole = page.evaluate("document.querySelector('figure > svg').getAttribute('viewBox')")
        page.evaluate("document.querySelector('figure > svg').scrollIntoView({block: 'center'})")
        left, top = page.evaluate(
            "(r => [r.x + 200, r.y + 40])(document.querySelector('figure > svg')"
            ".getBoundingClientRect())"
        )
        for kind, x, y in (
            ("mousePressed", left, top), ("mouseMoved", left + 90, top + 50),
            ("mouseReleased", left + 90, top + 50),
        ):  # fmt: skip
            page.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
        part = page.evaluate("document.querySelector('figure > svg').getAttribute('viewBox')")
        assert float(part.split()[2]) < 0.5 * float(whole.split()[2])
        again = "document.querySelector('figure > svg')"
        page.evaluate(f"{again}.dispatchEvent(new MouseEvent('dblclick'))")
        assert page.evaluate(f"{again}.getAttribute('viewBox')") == whole
