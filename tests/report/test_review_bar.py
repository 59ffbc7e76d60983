"""A whole run, from the virtual bench to the headless viewer, held against what the report says.

With WORKBENCH_PICTURES set to a folder, the pictures of the documentation are written into it:
`make pictures`.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rerun.chunk import Chunk

from tests.bundles import manifest_of, report_of
from tests.conftest import ROOT
from workbench.bundle import Bundle
from workbench.errors import WorkbenchError
from workbench.report import (
    Film,
    HeadlessViewer,
    picture_recording,
    write_recording,
    write_together,
)
from workbench.report.film import film
from workbench.report.load_run import load_comparison
from workbench.run import QuietOperator, carry_out, load_bench, make_bench, read_experiment

PICTURES = os.environ.get("WORKBENCH_PICTURES")
MOMENT_S = 8.2
GRAPHICS = "Software rasterizer"  # of the computer, not of the recording
PLAIN = ("/real/foot", "/twin/foot")


def measured(protocol: str, folder: Path) -> list[Bundle]:
    bench = load_bench("virtual")
    device = make_bench(bench.content)
    experiment = read_experiment(ROOT / "protocols" / protocol, bench, device.voltage_step)
    return list(carry_out(experiment, device, folder, QuietOperator(), lambda text: None))


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    (run,) = measured("hop-17.yaml", tmp_path_factory.mktemp("runs"))
    return run


@pytest.fixture(scope="module")
def recording(bundle: Bundle, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "again.rrd"
    write_recording(load_comparison(bundle), path)
    return path


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where pictures go: into the documentation when asked for, else into a temporary folder."""
    return Path(PICTURES) if PICTURES else tmp_path_factory.mktemp("pictures")


def column(chunks: list[Chunk], path: str, part: str) -> list[list[object]]:
    batches = [c.to_record_batch() for c in chunks if c.entity_path == path and not c.is_static]
    (found,) = [b.column(n) for b in batches for n in b.schema.names if part in n]
    return found.to_pylist()


def largest(bundle: Bundle) -> dict[str, float]:
    """Return the largest errors as the report prints them [mm]."""
    page = report_of(bundle)
    row = r'<th scope="row">(Foot|T)</th><td>[\d.]+ mm</td><td>([\d.]+) mm at'
    return {name: float(value) for name, value in re.findall(row, page)}


def test_the_error_plot_s_maximum_is_the_number_in_the_report(
    chunks: list[Chunk], bundle: Bundle
) -> None:
    told = largest(bundle)
    assert set(told) == {"Foot", "T"}
    for name, part in (("Foot", "foot"), ("T", "top")):
        cells = column(chunks, f"/plots/error_mm/{part}", "Scalars")
        plotted = max(float(str(cell[0])) for cell in cells if cell)
        assert f"{plotted:.1f}" == f"{told[name]:.1f}"


@pytest.mark.parametrize("path", PLAIN)
def test_both_robots_move(chunks: list[Chunk], bundle: Bundle, path: str) -> None:
    places = np.array([cell[0] for cell in column(chunks, path, "translation") if cell], float)
    who = "real" if path.startswith("/real") else "twin"
    assert places[-1, 0] == pytest.approx(manifest_of(bundle)[who]["distance_m"], abs=0.01)
    assert np.ptp(places[:, 2]) > 0.8 * manifest_of(bundle)[who]["hop_height_m"]
    moves = np.abs(np.diff(places[:, 0])) > 0
    assert moves.mean() > 0.5


@pytest.mark.viewer
def test_the_viewer_shows_every_view_without_a_warning(viewer: HeadlessViewer) -> None:
    viewer.set_time(MOMENT_S)
    state = viewer.state()
    names = [view.name for view in state.views]
    assert len(names) == len(set(names)) == 18
    assert all(view.visible for view in state.views)
    assert [report for view in state.views for report in view.reports] == []
    complaints = [log for log in viewer.logs() if log.level in ("WARN", "ERROR")]
    assert [log.message for log in complaints if GRAPHICS not in log.message] == []


@pytest.mark.viewer
def test_the_whole_window_makes_a_picture(
    viewer: HeadlessViewer, recording: Path, pictures: Path
) -> None:
    image = picture_recording(recording, MOMENT_S)
    assert image.size == (1600, 1000)
    red, _, blue = np.moveaxis(np.asarray(image, float) / 255, -1, 0)
    assert np.mean(red - blue > 0.4) > 0.005
    assert np.mean(blue - red > 0.4) > 0.005
    image.save(pictures / "recording.png", optimize=True)


def test_a_frame_of_the_film_makes_a_picture(bundle: Bundle, pictures: Path) -> None:
    comparison, how = load_comparison(bundle), Film(rate_hz=1)
    try:
        with film(comparison, how) as frames:
            shown = next(picture for time, picture in frames if time > 5)
    except WorkbenchError as error:
        pytest.skip(f"no picture can be rendered here: {error}")
    assert shown.shape == (how.height, how.width, 3)
    Image.fromarray(shown).quantize(256).save(pictures / "film.png", optimize=True)


@pytest.mark.viewer
@pytest.mark.skipif(PICTURES is None, reason="made for the documentation only: make pictures")
def test_several_runs_make_a_picture(tmp_path: Path, pictures: Path) -> None:
    bundles = measured("hop-both-speeds.yaml", tmp_path / "runs")
    write_together("Both speeds", [load_comparison(one) for one in bundles], tmp_path / "runs.rrd")
    image = picture_recording(tmp_path / "runs.rrd", MOMENT_S)
    image.save(pictures / "runs.png", optimize=True)
