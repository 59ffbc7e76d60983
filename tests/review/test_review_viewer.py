import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import psutil
import pytest

from workbench.errors import InputError, WorkbenchError
from workbench.review import Comparison, HeadlessViewer, open_viewer, write_recording

VIEWS = {
    "Real": "3D",
    "Twin": "3D",
    "Real (orange) and twin (blue)": "3D",
    "Foot forward x [m]": "TimeSeries",
    "Foot height z [m]": "TimeSeries",
    "T forward x [m]": "TimeSeries",
    "T height z [m]": "TimeSeries",
    "Rotor speed [rad/s]": "TimeSeries",
    "Rotor phase [deg]": "TimeSeries",
    "Rotor of the twin ahead by [deg]": "TimeSeries",
    "Distance from real to twin [mm]": "TimeSeries",
    "Supply [V]": "TimeSeries",
    "Supply [A]": "TimeSeries",
    "Notes": "TextDocument",
    "Protocol file": "TextDocument",
    "Journal": "TextLog",
    "Protocol": "StateTimeline",
}


@pytest.fixture(scope="module")
def recording(comparison: Comparison, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("viewer") / "compare.rrd"
    write_recording(comparison, path)
    return path


@pytest.mark.viewer
def test_every_view_is_shown_without_complaint(viewer: HeadlessViewer) -> None:
    views = viewer.state().views
    assert {view.name: view.view_class for view in views} == VIEWS
    assert [report for view in views for report in view.reports] == []
    assert all(view.visible for view in views)


@pytest.mark.viewer
def test_the_timeline_is_the_run_and_stands_still(
    viewer: HeadlessViewer, comparison: Comparison
) -> None:
    viewer.set_time(8.0)
    (recording,) = viewer.state().recordings
    (timeline,) = recording.timelines
    last = max(comparison.real.times[-1], comparison.twin.times[-1])
    assert (timeline.name, timeline.time_type) == ("t", "duration")
    assert timeline.start == -2_000_000_000
    assert timeline.end == pytest.approx(1e9 * last, abs=2)
    assert recording.current_timeline == "t"
    assert recording.current_time == 8_000_000_000


@pytest.mark.viewer
@pytest.mark.parametrize(("view", "colors"), [("Real", "o"), ("Twin", "b"), (None, "ob")])
def test_the_robots_are_seen_in_their_colours(
    viewer: HeadlessViewer, tmp_path: Path, view: str | None, colors: str
) -> None:
    viewer.set_time(8.0)
    ids = {shown.name: shown.view_id for shown in viewer.state().views}
    viewer.screenshot(tmp_path / "shot.png", ids[view] if view else None)
    red, _, blue = np.moveaxis(matplotlib.image.imread(tmp_path / "shot.png")[..., :3], -1, 0)
    shares = {"o": np.mean(red - blue > 0.4), "b": np.mean(blue - red > 0.4)}
    assert {color for color, share in shares.items() if share > 0.01} == set(colors)


@pytest.mark.viewer
def test_the_viewer_raises_no_errors(viewer: HeadlessViewer) -> None:
    assert [entry for entry in viewer.logs() if entry.level == "ERROR"] == []


@pytest.mark.viewer
def test_no_process_is_left_behind(viewer: HeadlessViewer) -> None:
    before = {child.pid for child in psutil.Process().children(recursive=True)}
    with HeadlessViewer(width=400, height=300):
        during = {child.pid for child in psutil.Process().children(recursive=True)}
    after = {child.pid for child in psutil.Process().children(recursive=True)}
    assert len(during - before) == 1
    assert after == before


@pytest.mark.skipif(sys.platform != "linux", reason="only here can the driver be hidden")
def test_a_viewer_without_graphics_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "none")
    monkeypatch.setenv("VK_ICD_FILENAMES", "none")
    with pytest.raises(WorkbenchError, match=r"needs a Vulkan driver.*panicked"), HeadlessViewer():
        pass


def test_a_recording_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no recording at .*compare\.rrd"):
        open_viewer(tmp_path / "compare.rrd")


@pytest.mark.parametrize(("web", "option"), [(False, "--port"), (True, "--web-viewer")])
def test_the_viewer_is_opened_on_the_recording(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, web: bool, option: str
) -> None:
    path = tmp_path / "compare.rrd"
    path.touch()
    asked: list[str] = []

    def start(arguments: list[str]) -> subprocess.Popen[bytes]:
        asked.extend(arguments)
        return subprocess.Popen([sys.executable, "-c", "raise SystemExit(3)"])

    monkeypatch.setattr("workbench.review.viewer._start", start)
    assert open_viewer(path, web=web) == 3
    assert asked[0] == str(path)
    assert option in asked
