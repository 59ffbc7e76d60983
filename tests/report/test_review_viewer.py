import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib.image
import numpy as np
import psutil
import pytest

from workbench.errors import InputError, WorkbenchError
from workbench.report import Comparison, HeadlessViewer, Phase, open_viewer, write_recording
from workbench.timeseries import TimeSeries

VIEWS = {
    "Real": "3D",
    "Twin": "3D",
    "Both robots": "3D",
    "Foot x [m]": "TimeSeries",
    "Foot z [m]": "TimeSeries",
    "T x [m]": "TimeSeries",
    "T z [m]": "TimeSeries",
    "Rotor [rad/s]": "TimeSeries",
    "Phase [deg]": "TimeSeries",
    "Twin lead [deg]": "TimeSeries",
    "Twin error [mm]": "TimeSeries",
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


def left_over(comparison: Comparison) -> dict[str, Comparison]:
    """Return runs that broke off earlier and earlier, and one that the cameras never saw."""
    real = comparison.real
    nothing = comparison.twin.between(100.0, 200.0)
    unseen = TimeSeries(real.times, real.values, real.names, np.zeros_like(real.valid))
    cut = replace(comparison, real=nothing, twin=nothing, mark="ABORTED")
    return {
        "no twin": replace(comparison, twin=nothing, mark="DAMAGED"),
        "no motion": cut,
        "one instant": replace(cut, supply=None, phases=(Phase(0.0, "rest"),), log=((0.0, "-"),)),
        "nothing": replace(cut, supply=None, phases=(), log=(), mark=None, warnings=()),
        "never seen": replace(comparison, real=unseen),
    }


@pytest.mark.viewer
@pytest.mark.parametrize("kind", ["no twin", "no motion", "one instant", "nothing", "never seen"])
def test_the_viewer_opens_what_is_left_of_a_run(
    viewer: HeadlessViewer, comparison: Comparison, tmp_path: Path, kind: str
) -> None:
    path = tmp_path / "left.rrd"
    write_recording(left_over(comparison)[kind], path)
    with HeadlessViewer(width=800, height=600) as fresh:
        views = fresh.open(path).views
        fresh.screenshot(tmp_path / "left.png")
        assert fresh.state().views != []
    assert [report for view in views for report in view.reports] == []


def test_a_viewer_that_ends_over_a_recording_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Gone:
        def open(self, path: str) -> None:
            """Take it."""

        def get_state(self) -> None:
            raise ConnectionError("transport error")

    path = tmp_path / "compare.rrd"
    path.touch()
    viewer = HeadlessViewer()
    with (tmp_path / "output").open("w+b") as output:
        output.write(b"started\nthread 'main' panicked at 'no rows'\n")
        monkeypatch.setattr(viewer, "_client", Gone(), raising=False)
        monkeypatch.setattr(viewer, "_output", output, raising=False)
        with pytest.raises(WorkbenchError, match=r"ended while it opened compare\.rrd: .*panicked"):
            viewer.open(path)


class Painting:
    """A viewer whose pictures are given, the last one for ever."""

    def __init__(self, *pictures: bytes) -> None:
        self.pictures = pictures
        self.taken = 0

    def take_screenshot(self, view_id: str | None = None) -> bytes:
        """Return the next."""
        self.taken += 1
        return self.pictures[min(self.taken, len(self.pictures)) - 1]


def test_a_picture_is_taken_when_it_has_stopped_changing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    viewer = HeadlessViewer()
    client = Painting(b"loading", b"loading.", b"painted")
    monkeypatch.setattr(viewer, "_client", client, raising=False)
    viewer.screenshot(tmp_path / "shot.png")
    assert (tmp_path / "shot.png").read_bytes() == b"painted"
    assert client.taken == 4


def test_a_picture_that_never_stops_changing_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    viewer = HeadlessViewer()
    client = Painting(*(str(k).encode() for k in range(100)))
    monkeypatch.setattr(viewer, "_client", client, raising=False)
    monkeypatch.setattr("workbench.report.viewer._PAINTING_S", 0.3)
    with pytest.raises(WorkbenchError, match=r"still changes after 0\.3 s"):
        viewer.screenshot(tmp_path / "shot.png")
    assert not (tmp_path / "shot.png").exists()


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


@pytest.mark.skipif(sys.platform != "linux", reason="a window needs no such variable elsewhere")
def test_without_a_display_the_ways_that_need_none_are_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "compare.rrd").touch()
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(WorkbenchError, match=r"no display here .*--web.*--save FILE.rrd"):
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

    monkeypatch.setattr("workbench.report.viewer._start", start)
    monkeypatch.setenv("DISPLAY", ":0")
    told: list[str] = []
    with pytest.raises(WorkbenchError, match=r"error \(exit code 3\); .*--web.*--save FILE.rrd"):
        open_viewer(path, web, told.append)
    assert [text.splitlines()[1] for text in told] == ["Ctrl-C ends it"] * web
    assert asked[0] == str(path)
    assert option in asked
